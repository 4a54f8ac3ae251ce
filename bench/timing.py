"""The one timer: steady calls in rounds, each followed by a forward solve, so that their ratio is of one run."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median
from typing import Any

ENOUGH_ROUNDS = 200


@dataclass(frozen=True)
class Samples:
    """Seconds of each round's gradient and forward solve."""

    gradient: tuple[float, ...]
    forward: tuple[float, ...]

    @property
    def ratio(self) -> float:
        """median(gradient) / median(forward)."""
        return median(self.gradient) / median(self.forward)


def seconds_of(call: Callable[[], Any]) -> tuple[float, Any]:
    """Wall time of one call, and what it returned."""
    start = time.perf_counter()
    result = call()
    return time.perf_counter() - start, result


def rounds(gradient: Callable[[], Any], forward: Callable[[], Any], min_time: float) -> Samples:
    """Alternate the two until the gradient has run for `min_time` seconds; at least 1 round, at most ENOUGH_ROUNDS."""
    samples: list[tuple[float, float]] = []
    with no_garbage_collection():
        while not samples or (sum(g for g, _ in samples) < min_time and len(samples) < ENOUGH_ROUNDS):
            samples.append((seconds_of(gradient)[0], seconds_of(forward)[0]))
    gradients, forwards = zip(*samples, strict=True)
    return Samples(gradients, forwards)


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Collections would fall into some rounds and not into others."""
    gc.collect()
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()
