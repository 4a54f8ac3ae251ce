"""One protocol: a job says the same in a process of its own and in this one, however it ends."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from functools import partial

import psutil
import pytest
from example_jobs import Endless, Work

from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.cases.study import Kept, Note
from gradient_routes.bench.execution.isolation import process as watching
from gradient_routes.bench.execution.isolation import run
from gradient_routes.bench.execution.isolation.channel import Call
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Returned
from gradient_routes.bench.execution.isolation.run import here, stream
from gradient_routes.bench.execution.isolation.signals import interruptible
from gradient_routes.bench.execution.isolation.worker_process import WorkerProcess
from gradient_routes.problems.errors import InputError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes with limits")

ENDS: dict[str, Ended] = {
    "works": Ended(Status.OK),
    "refused": Ended(Status.REFUSED, "n = 3 is odd - choose an even n"),
    "outside": Ended(Status.REFUSED, "E_1 = -1 - choose E > 0"),
    "diverges": Ended(Status.NOT_CONVERGED, "Newton stops at 1e-3 - loosen --rtol"),
    "singular": Ended(Status.FAILED, "R_u is singular - fix more"),
    "foreign": Ended(Status.FAILED, "foreign: ZeroDivisionError: division by zero - see --debug"),
    "quits": Ended(Status.FAILED, "quits: SystemExit: 4 - see --debug"),
    "exhausted": Ended(Status.OUT_OF_MEMORY, "MemoryError: 1 TB"),
    "XLA": Ended(Status.OUT_OF_MEMORY, "RuntimeError: RESOURCE_EXHAUSTED: 1 TB"),
}


def said(name: str, messages: list[Message]) -> Ended:
    """The end of a job, after the same messages wherever it was done."""
    *first, last = messages
    assert first == [Kept("table", {"x": 1}), Note("half of it")]
    assert isinstance(last, Ended)
    assert (last.status, last.reason, last.killed) == (ENDS[name].status, ENDS[name].reason, False)
    assert bool(last.traceback) == (name != "works")
    return last


@pytest.mark.parametrize("name", ENDS)
def test_a_job_ends_with_a_status_and_a_reason(name: str) -> None:
    taken: list[Message] = []
    end = here(Work(name), taken.append)
    assert end is said(name, taken)


@pytest.mark.parametrize("name", ["works", "diverges", "foreign", "quits", "exhausted"])
def test_a_job_says_the_same_in_a_process_of_its_own(name: str) -> None:
    assert "garbage" in said(name, list(stream(Work(name), Limits(), echo=False))).stderr


def test_an_end_is_a_line_with_its_exit_code() -> None:
    assert ENDS["foreign"].line("tolerance") == "foreign: ZeroDivisionError: division by zero - see --debug"
    assert (
        ENDS["exhausted"].line("tolerance")
        == "tolerance: out-of-memory: MemoryError: 1 TB - raise --memory, or ask for less"
    )
    codes = {status: status.exit_code for status in Status}
    assert codes == dict.fromkeys(Status, 1) | {Status.OK: 0, Status.REFUSED: 2, Status.INTERRUPTED: 130}


def test_a_job_that_crashes_or_takes_too_much_has_said_what_it_said() -> None:
    for name, status, says in (
        ("crashes", Status.CRASHED, "exit code 3"),
        ("takes", Status.OUT_OF_MEMORY, "MemoryError"),
        ("grows", Status.OUT_OF_MEMORY, "of --memory"),
    ):
        *said, last = stream(Work(name), Limits(memory=300 * 10**6), echo=False)
        assert said == [Kept("table", {"x": 1}), Note("half of it")]
        assert isinstance(last, Ended)
        assert last.status is status
        assert says in last.reason or "MemoryError" in last.reason


def test_the_value_of_a_function() -> None:
    first, last = stream(Call(divmod, (7, 2)), Limits())
    assert first == Returned((3, 1))
    assert last == Ended(Status.OK)


class Late:
    """A clock on which a limit of an hour is met once that is asked for, however slow the machine."""

    def __init__(self) -> None:
        self.met = False

    def monotonic(self) -> float:
        return time.monotonic() + (7200.0 if self.met else 0.0)


@pytest.mark.parametrize(("deaf", "last_words"), [(False, 60.0), (True, 0.5), (False, 0.0)])
def test_at_its_limit_a_job_hands_over_what_it_has(
    deaf: bool, last_words: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Unless it is deaf, or has no time for last words."""
    clock = Late()
    monkeypatch.setattr(watching, "time", clock)
    said: list[Message] = []
    for message in stream(Endless(deaf=deaf), Limits(timeout=3600.0), last_words=last_words):
        clock.met = True
        said.append(message)
    began, *kept, last = said
    assert began == Note("begins")
    assert kept == ([Kept("table", {"x": 10**6 * "x"})] if last_words == 60.0 else [])
    assert isinstance(last, Ended)
    assert (last.status, last.reason) == (Status.TIMEOUT, "after 3600 s of --timeout")
    assert last.killed == (last_words < 60.0)


@pytest.fixture
def signals() -> Iterator[None]:
    """The system's handlers, whatever a generator that a failed test has left open would do at a signal."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("ignored", [False, True])
@pytest.mark.parametrize("deaf", [False, True])
def test_an_interrupted_job_hands_over_what_it_has(
    deaf: bool, ignored: bool, signals: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where this process was started with SIGINT ignored, as shells start what runs in the background."""
    monkeypatch.setattr(run, "GRACE", 0.5 if deaf else 60.0)
    if ignored:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    interruptible()
    said = []
    for message in stream(Endless(deaf=deaf), Limits()):
        if message == Note("begins"):
            signal.raise_signal(signal.SIGINT)
            said.append(Note("taken whole"))
        else:
            said.append(message)
    kept = [] if deaf else [Kept("table", {"x": 10**6 * "x"})]
    assert said[:-1] == [Note("taken whole"), *kept]
    assert (said[-1].status, said[-1].killed) == (Status.INTERRUPTED, deaf)


def test_a_second_interrupt_is_raised_at_once(signals: None) -> None:
    interruptible()
    messages = stream(Endless(deaf=True), Limits())
    next(messages)
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    messages.close()


def test_an_interrupt_here_is_raised_in_the_job(signals: None) -> None:
    interruptible()
    said: list[Message] = []

    def take(message: Message) -> None:
        if message == Note("begins"):
            signal.raise_signal(signal.SIGINT)
        said.append(message)

    end = here(Endless(), take)
    assert said == [Note("begins"), Kept("table", {"x": 10**6 * "x"}), end]
    assert end.status is Status.INTERRUPTED


def children() -> set[psutil.Process]:
    """Those of this process, among them what other tests or libraries keep."""
    return set(psutil.Process().children())


def test_what_taking_a_message_raises_is_no_failure_of_the_job() -> None:
    def refuse(message: Message) -> None:
        raise InputError("the disk is full")

    with pytest.raises(InputError, match="disk is full"):
        here(Endless(), refuse)
    before = children()
    messages = stream(Endless(), Limits())
    with pytest.raises(InputError, match="disk is full"):
        refuse(next(messages))
    messages.close()
    assert not children() - before


def test_stdout_is_for_who_takes_the_messages(capfd: pytest.CaptureFixture[str]) -> None:
    def show(message: Message) -> None:
        print("result")
        os.write(1, b"by the system\n")

    here(Work("works"), show)
    captured = capfd.readouterr()
    assert sorted(captured.out.split("\n")) == ["", *["by the system"] * 3, *["result"] * 3]
    assert captured.err == "garbage\n"
    for _ in stream(Work("works"), Limits()):
        print("result")
    captured = capfd.readouterr()
    assert (captured.out, captured.err) == ("result\n" * 3, "garbage\n")


def test_a_closed_stream_leaves_no_process() -> None:
    before = children()
    messages = stream(Endless(deaf=True), Limits())
    next(messages)
    assert children() - before
    messages.close()
    assert not children() - before


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="signals to threads are POSIX")
def test_a_signal_handler_that_outlasts_a_look_does_not_end_the_looking() -> None:
    """An interrupt that is handled meanwhile is heard at the next look. The job says something long afterwards."""
    handled: list[int] = []

    def handle(number: int, frame: object) -> None:
        time.sleep(2.0 * watching.TICK)
        handled.append(number)

    def look() -> None:
        if handled:
            raise KeyboardInterrupt

    before = signal.signal(signal.SIGUSR1, handle)
    job = Call(time.sleep, (20.0,))
    try:
        with closing(WorkerProcess(job, Limits())) as worker:
            send = partial(signal.pthread_kill, threading.main_thread().ident, signal.SIGUSR1)
            threading.Timer(0.5 * watching.TICK, send).start()
            with pytest.raises(KeyboardInterrupt):
                worker.hear(look)
    finally:
        signal.signal(signal.SIGUSR1, before)
