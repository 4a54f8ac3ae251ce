"""Ctrl-C reaches its reader, also where Python would have dropped it."""

from __future__ import annotations

import os
import signal
import threading
from queue import SimpleQueue

import pytest
from commands import PATIENCE

from gradient_routes.bench.execution.isolation.signals import Interrupt


@pytest.fixture(autouse=True)
def as_ever():
    """The handlers that `routes run` has."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number in before:
        signal.signal(number, signal.default_int_handler)
    yield
    assert all(signal.getsignal(number) is signal.default_int_handler for number in before)
    for number, handler in before.items():
        signal.signal(number, handler)


class Mortal:
    """Interrupted when it is collected."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_is_raised_where_it_is_heard(number: signal.Signals) -> None:
    with Interrupt(lambda: None) as interrupt:
        interrupt.heard()
        signal.raise_signal(number)
        with pytest.raises(KeyboardInterrupt):
            interrupt.heard()


def test_a_finalizer_does_not_swallow_it() -> None:
    with Interrupt(lambda: None) as interrupt:
        Mortal()
        with pytest.raises(KeyboardInterrupt):
            interrupt.heard()


def test_who_waits_is_woken() -> None:
    events: SimpleQueue[str] = SimpleQueue()
    with Interrupt(lambda: events.put("wake")):
        timer = threading.Timer(0.1, os.kill, [os.getpid(), signal.SIGINT])
        timer.start()
        assert events.get(timeout=PATIENCE) == "wake"
        timer.join()


def test_impatience_is_raised_at_once() -> None:
    with Interrupt(lambda: None):
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


def test_what_somebody_else_handles_is_left_to_them() -> None:
    heard = []
    before = signal.signal(signal.SIGTERM, lambda *_: heard.append(True))
    with Interrupt(lambda: None) as interrupt:
        signal.raise_signal(signal.SIGTERM)
        interrupt.heard()
    signal.signal(signal.SIGTERM, before)
    assert heard == [True]


def test_another_thread_has_no_signals_to_note() -> None:
    def enter() -> None:
        with Interrupt(lambda: None):
            handlers.append(signal.getsignal(signal.SIGINT))

    handlers: list[object] = []
    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert handlers == [signal.default_int_handler]
