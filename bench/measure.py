"""Steady calls of a gradient: their time beside forward solves of the same rounds, and their memory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bench.memory import peak_of
from bench.timing import Samples, rounds, seconds_of

LONG = 1.0  # [s] calls that take longer are not repeated: one call is timed and its memory read


def steady(
    gradient: Callable[[], Any], forward: Callable[[], Any], first_s: float, min_time: float
) -> tuple[Samples, tuple[int, str]]:
    """Raw timings, and the peak memory of a call in bytes with how it was measured.

    Memory is read in a call of its own, but for gradients that took longer than LONG the first time.
    """
    if first_s < LONG:
        peak = peak_of(gradient)
        return rounds(gradient, forward, min_time), peak
    seconds: list[float] = []
    peak = peak_of(lambda: seconds.append(seconds_of(gradient)[0]))
    return Samples(tuple(seconds), (seconds_of(forward)[0],)), peak
