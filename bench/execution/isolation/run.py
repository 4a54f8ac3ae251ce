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
    """Each message as soon as it is said; the last is Ended, however the job ends.

    At its limit of time, and at Ctrl-C here, the job is interrupted and has `last_words` s, and GRACE s, to say what it
    has; then it is killed with all it started. Where it uses too much memory it is killed at once. Ctrl-C does not
    interrupt who takes a message; a second one does. `echo`: its stderr appears on that of this process.
    """
    with closing(WorkerProcess(job, limits, echo=echo, last_words=last_words)) as line, Interrupt() as interrupt:
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
    """Ctrl-C has been heard."""


def here(job: Job, take: Callable[[Message], None]) -> Ended:
    """The job in this process: take(message) gets each, the last of them, Ended, too. What it raises ends the job.

    Nothing limits it. What the job prints to stdout comes out on stderr, what `take` prints does not.
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
