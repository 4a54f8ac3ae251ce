"""The process of a job: it sets its limits, does the job, sends Ended, and exits.

python -P -m gradient_routes.bench.execution.isolation.worker DESCRIPTOR
"""

from __future__ import annotations

import io
import os
import pickle
import signal
import sys
from dataclasses import replace
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any

from gradient_routes.bench.cases.folder import from_here
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.channel import SAID, Channel, ended
from gradient_routes.bench.execution.isolation.inside import submit_to
from gradient_routes.bench.execution.isolation.messages import Ended
from gradient_routes.bench.execution.isolation.signals import STOPS
from gradient_routes.bench.execution.isolation.stack import told


class Stop:
    """Raises KeyboardInterrupt in the job at the first signal that ends it, after a message that is being sent.

    Later signals are ignored: the group and the parent may send one each.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection, self._pid = connection, os.getpid()
        self._told = self._sending = self._waiting = False
        self.signal: signal.Signals | None = None
        for number in STOPS:
            signal.signal(number, self._handle)

    def send(self, message: Any) -> None:
        self._end_copy()
        self._sending = True
        try:
            self._connection.send((SAID, message))
        finally:
            self._sending = False
        if self._waiting:
            self._waiting = False
            raise KeyboardInterrupt

    def send_last(self, message: Any) -> None:
        """Send a message that no signal interrupts."""
        self._end_copy()
        self._told = True
        self._connection.send((SAID, message))

    def _end_copy(self) -> None:
        """A copy that user code has forked says nothing: every message is that of one process."""
        if os.getpid() != self._pid:
            os._exit(1)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self._told:
            return
        self._told, self.signal = True, signal.Signals(number)
        if not self._sending:
            raise KeyboardInterrupt
        self._waiting = True


class Sent:
    """A job as it was sent: putting it together imports code of others, which may fail or end the process."""

    def __init__(self, data: bytes) -> None:
        self._data, self.name = data, "import"

    def __call__(self, channel: Channel) -> None:
        job = pickle.loads(self._data)
        self.name = job.name
        job(channel)


def main(descriptor: int) -> None:
    """Do the job that arrives on a descriptor."""
    os.set_inheritable(descriptor, False)  # processes that the job starts must not hold the connection open
    told()
    os.dup2(2, 1)  # stdout of user code goes to stderr
    assert isinstance(sys.stderr, io.TextIOWrapper)
    sys.stderr.reconfigure(write_through=True, errors="backslashreplace")  # nothing printed before a crash is lost
    sys.stdout = sys.stderr
    connection = Connection(descriptor)
    limits, parent, sys.path[:] = connection.recv()
    submit_to(limits, parent)
    stop = Stop(connection)
    try:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, STOPS)  # the parent blocked them: none came before the handlers
        with from_here():
            end = ended(Sent(connection.recv_bytes()), Channel(stop.send, connection.recv))
    except KeyboardInterrupt:  # before it has begun
        end = Ended(Status.INTERRUPTED)
    if end.status is Status.INTERRUPTED:  # who sent the signal is for the parent to say
        end = replace(end, reason="KeyboardInterrupt" if stop.signal is None else stop.signal.name)
    stop.send_last(end)
    sys.stderr.flush()
    os._exit(0)  # skip exit handlers of plug-ins and XLA


if __name__ == "__main__":
    main(int(sys.argv[1]))
