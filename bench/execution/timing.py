"""The one timer: samples of a gradient and of forward solves in turn, so that their ratio is of one run."""

from __future__ import annotations

import gc
import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from gradient_routes.bench.cases.samples import LEAST, Elapsed, Samples

LONG = 1.0  # [s] gradients that take longer are timed once, not repeated
SAMPLE = 1e-3  # [s] of a sample: the clock and the call of a function are nothing beside it
AVERAGED = 0.1  # [s] over which a machine's short disturbances average out
MOST = 100  # rounds
TURNS = 5  # in which a case has its rounds, others having theirs between


def seconds_of(call: Callable[[], Any]) -> tuple[float, Any]:
    """Wall time of one call, and what it returned."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def elapsed(call: Callable[[], Any]) -> tuple[Elapsed, Any]:
    """Wall and CPU time of one call, and what it returned."""
    start = _cpu()  # read outside the wall time: reading it takes longer than some calls do
    wall, result = seconds_of(call)
    return Elapsed(wall, _cpu() - start), result


def _cpu() -> float:
    """Of this process, and of its children that have ended."""
    of = os.times()
    return time.process_time() + of.children_user + of.children_system


class Rounds:
    """Samples of a gradient, each beside one of forward solves, until the gradient has run for `min_time` s.

    Calls a sample are calibrated by up to three more. min_time 0: one round of one call.
    """

    def __init__(self, gradient: Callable[[], Any], forward: Callable[[], Any], first_s: float, min_time: float):
        self._gradient, self._forward, self._min_time = gradient, forward, min_time
        self.long = first_s >= LONG
        self._least = LEAST if min_time > 0.0 and not self.long else 1
        self._repeats: tuple[int, int] | None = None
        self._samples: list[tuple[float, float]] = []

    @property
    def enough(self) -> bool:
        spent = math.fsum(g for g, _ in self._samples) * self._calls[0]
        rounds = len(self._samples)
        return rounds >= self._least and (spent >= self._min_time or self.long)

    def turn(self) -> bool:
        """Rounds for a while, with the garbage collector off; whether more are wanted."""
        if not self._samples:
            gc.collect()
        with no_garbage_collection():
            both, calls = (self._gradient, self._forward), self._calls
            until = time.perf_counter() + 2.0 * self._min_time / TURNS  # half of that is the forward solves'
            while not self.enough:
                # each is the first of every other round: on a busy machine the second waits more often
                order = (0, 1) if len(self._samples) % 2 == 0 else (1, 0)
                seconds = {which: mean_of(both[which], calls[which]) for which in order}
                self._samples.append((seconds[0], seconds[1]))
                if time.perf_counter() >= until:
                    break
        return not self.enough

    @property
    def samples(self) -> Samples:
        gradients, forwards = zip(*self._samples, strict=True)
        return Samples(gradients, forwards, self._calls[0])

    @property
    def _calls(self) -> tuple[int, int]:
        """Gradients and forward solves a sample."""
        if self._repeats is None:
            self._repeats = (1, 1) if self.long or self._min_time == 0.0 else self._calibrated()
        return self._repeats

    def _calibrated(self) -> tuple[int, int]:
        """Calls of each that last as long as one of the longer, up to a limit: both see the same machine."""
        once = typical(self._gradient), typical(self._forward)
        sample = max(SAMPLE, self._min_time / MOST, min(AVERAGED, max(once)))
        gradients, forwards = (max(1, round(sample / max(seconds, 1e-9))) for seconds in once)
        return gradients, forwards


def typical(call: Callable[[], Any]) -> float:
    """Seconds of one call, of some more where it is short."""
    seconds, _ = seconds_of(call)
    return seconds if seconds > AVERAGED else mean_of(call, 2)


def mean_of(call: Callable[[], Any], calls: int) -> float:
    """Seconds of one of so many calls in a row."""
    start = time.perf_counter()
    for _ in range(calls):
        call()
    return (time.perf_counter() - start) / calls


def rounds(gradient: Callable[[], Any], forward: Callable[[], Any], min_time: float) -> Samples:
    """All rounds at once, of calls that are short."""
    measured = Rounds(gradient, forward, 0.0, min_time)
    while measured.turn():
        pass
    return measured.samples


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Collections would fall into some rounds and not into others."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
