"""A confined process that does a job, as its parent sees it."""

from __future__ import annotations

import io
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing import Pipe
from queue import Empty, Queue
from typing import Any

from gradient_routes.bench.cases.declared import is_foreign
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.channel import SAID, Job
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Order
from gradient_routes.bench.execution.isolation.process import STACK, Confined, Killed
from gradient_routes.bench.execution.isolation.signals import EXPIRED, STOPS, blocked

WORKER = "gradient_routes.bench.execution.isolation.worker"


class Loaded(pickle.Unpickler):
    """A message, put together without importing a module of the user's own."""

    def find_class(self, module: str, name: str) -> Any:
        """Raises UnpicklingError for what is of such a module."""
        if is_foreign(module):
            raise pickle.UnpicklingError(f"{module}.{name} is not imported here")
        return super().find_class(module, name)


def unsolicited(end: Ended) -> Ended:
    """The end of a job that nobody here has interrupted: its own code has sent the signal, or another process."""
    if end.status is not Status.INTERRUPTED:
        return end
    return replace(end, status=Status.CRASHED, reason=f"its process was told to end by {end.reason}")


class WorkerProcess:
    """A worker that does a job, and its messages, read by a thread so that an incomplete message blocks nothing else.

    echo        copy its stderr to that of this process
    last_words  seconds for messages after the time limit; None: the worker writes its stack to stderr instead, and
                later messages are dropped
    """

    def __init__(
        self, job: Job, limits: Limits, *, cwd: str | None = None, echo: bool = False, last_words: float | None = None
    ) -> None:
        self._left, self._all_counts = limits.timeout, last_words is not None
        self.connection, other = Pipe()
        with other, blocked(STOPS):
            self.process = Confined(
                WORKER,
                [str(other.fileno())],
                limits,
                talkative=echo,
                last_words=STACK if last_words is None else (EXPIRED, last_words) if last_words else None,
                pass_fds=[other.fileno()],
                cwd=cwd or located(""),
                stdin=subprocess.DEVNULL,
            )
        with suppress(OSError):  # it has ended: hear() reports that
            self.connection.send((limits, os.getpid(), sys.path))
            self.connection.send(job)
        # no SimpleQueue: its get(timeout) waits for ever where a signal's handler runs beyond the timeout
        self._heard: Queue[Any] = Queue()
        self._message: Any = None
        self._ended: Ended | None = None
        self._listening = threading.Thread(target=self._listen, daemon=True)
        self._listening.start()

    def hear(self, look: Callable[[], None] = lambda: None) -> Message:
        """Its next message, Ended when there are no more. `look` is called while waiting; what it raises is raised."""
        if self._ended is None:
            start = time.monotonic()
            try:
                self.process.watch(lambda seconds: self._came(seconds, look), start + self._left)
            except Killed as limit:
                self._ended = Ended(limit.status, limit.reason, killed=True)
            finally:
                self._left -= time.monotonic() - start
        if self._ended is None:
            if isinstance(self._message, Ended):
                self._ended = unsolicited(self._message)
            elif self._message is None:
                self._ended = self.process.ending()
            else:
                return self._message
        self.close()  # every message and all of stderr have arrived by now
        return self._rest()

    def say(self, order: Order) -> None:
        """Send an order; that the worker has ended is reported by hear()."""
        with suppress(OSError):
            self.connection.send(order)

    def interrupt(self, seconds: float) -> None:
        """Interrupt the job. It may send messages for so many seconds, or until Ctrl-C; hear() returns them."""
        self._ended, self._all_counts = Ended(Status.INTERRUPTED, killed=True), True
        with suppress(OSError):
            self.process.process.send_signal(signal.SIGINT)
        with suppress(KeyboardInterrupt):
            self.process.ended(seconds)

    def close(self) -> None:
        """Kill the process and its descendants, end the thread, then close the connection: a thread that still reads
        would read from the next file that gets the descriptor.
        """
        self.process.kill()
        self._hang_up()
        self._listening.join()
        self.connection.close()

    def _rest(self) -> Message:
        """The next message that was not returned yet, where later messages count, else Ended."""
        assert self._ended is not None
        while self._all_counts and not self._heard.empty():
            message = self._heard.get()
            if isinstance(message, Ended):
                self._ended = replace(self._ended, killed=False)  # it ended by itself after the limit or the interrupt
            elif message is not None:
                return message
        return replace(self._ended, stderr=self.process.stderr)

    def _listen(self) -> None:
        """Queue its messages, then None: at its end, at an incomplete message, at one that cannot be unpickled."""
        message: Message = ()
        while message is not None:
            try:
                said, message = Loaded(io.BytesIO(self.connection.recv_bytes())).load()
                assert said == SAID
            except Exception:
                message = None
            self._heard.put(message)

    def _came(self, seconds: float, look: Callable[[], None]) -> bool:
        """Whether a message arrives within so many seconds."""
        look()
        if self.process.gone:
            self._hang_up()  # a child of it may hold the connection open; what was sent is still read
        try:
            self._message = self._heard.get(timeout=seconds)
        except Empty:
            return False
        return True

    def _hang_up(self) -> None:
        """Shut the connection down, whichever processes hold its other end."""
        with suppress(OSError), socket.fromfd(self.connection.fileno(), socket.AF_UNIX, socket.SOCK_STREAM) as line:
            line.shutdown(socket.SHUT_RDWR)
