"""Run a job: in a confined process, or in this one. Its messages are the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing

from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.execution.isolation.channel import Channel, Job, ended
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import Ended, Message
from gradient_routes.bench.execution.isolation.signals import Interrupt
from gradient_routes.bench.execution.isolation.worker_process import WorkerProcess

GRACE = 5.0  # [s] between an interrupt and the end of a job that does not react to it


def stream(job: Job, limits: Limits, *, echo: bool = True, last_words: float = 0.0) -> Iterator[Message]:
    """Yield each message as it arrives; the last is Ended, however the job ends.

    At the time limit the job is interrupted and may send messages for `last_words` s, at Ctrl-C for GRACE s; then it
    is killed with its descendants. It is killed at once where it uses too much memory. A first Ctrl-C does not
    interrupt the caller while it handles a message, a second one does. `echo`: copy its stderr to this process.
    """
    with Interrupt() as interrupt, closing(WorkerProcess(job, limits, echo=echo, last_words=last_words)) as line:
        look, message = interrupt.heard, None
        while not isinstance(message, Ended):
            try:
                message = line.hear(look)
            except KeyboardInterrupt:
                look = nothing
                line.interrupt(GRACE)
                continue
            yield message


def nothing() -> None:
    """The look of a job that is being interrupted already."""


def here(job: Job, take: Callable[[Message], None]) -> Ended:
    """Do the job in this process, without limits. take(message) receives each message, Ended last.

    What `take` raises ends the job. stdout of the job goes to stderr, that of `take` does not.
    """
    failures: list[BaseException] = []

    def say(message: Message) -> None:
        if failures:
            raise KeyboardInterrupt
        with restored(), Interrupt() as interrupt:
            try:
                take(message)
            except BaseException as failure:
                failures.append(failure)
                raise KeyboardInterrupt from failure
        interrupt.heard()

    with stdout_to_stderr() as restored:
        end = ended(job, Channel(say))
    if failures:
        raise failures[0]
    take(end)
    return end
