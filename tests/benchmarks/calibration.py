"""What this machine can do at this moment: the clock of `make benchmark-regression`.

Routes spend their time in three ways: in the interpreter, in BLAS and LAPACK, and in moving arrays. Machines differ in
each, so each is measured on its own, and their geometric mean is the unit: twice as slow a machine makes it twice as
long, and no part outweighs another.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from math import prod

import numpy as np

REPEATS = 5
RNG = np.random.default_rng(0)
A = RNG.random((160, 160))
B = RNG.random(160)
LONG = RNG.random(2**20)  # 8 MiB: beyond the caches that one core has to itself
TARGET = np.empty_like(LONG)


def interpreter() -> float:
    """Calls, attributes, small dictionaries: about 2 ms of Python."""
    counts: dict[int, float] = {}
    for i in range(20_000):
        counts[i % 64] = counts.get(i % 64, 0.0) + 0.5 * i
    return sum(counts.values())


def blas() -> float:
    """A product and a solve, small enough for one core."""
    return float(np.linalg.solve(A + 160.0 * np.eye(160), A @ (A @ B))[0] + (A @ A @ A)[0, 0])


def memory() -> None:
    """Arrays that stream through."""
    np.multiply(LONG, 1.5, out=TARGET)
    np.add(TARGET, LONG, out=TARGET)


PARTS: tuple[Callable[[], object], ...] = (interpreter, blas, memory)


def calibration() -> float:
    """Seconds: the geometric mean of the fastest of REPEATS calls of every part; noise only ever adds."""
    fastest = [min(_seconds(part) for _ in range(REPEATS)) for part in PARTS]
    return prod(fastest) ** (1 / len(fastest))


def _seconds(call: Callable[[], object]) -> float:
    start = time.process_time()  # as the benchmarks are timed: a process that has to wait does not work
    call()
    return time.process_time() - start
