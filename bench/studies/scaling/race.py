"""Routes side by side on a few of the parameters: m = 1, 2, 4, ... in interleaved rounds of one process."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.cases.partial import Partial
from gradient_routes.bench.execution.timing import no_garbage_collection, seconds_of
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

ROUNDS, MOST_ROUNDS = 5, 50
NUMBERS, MOST_PARAMETERS = 4, 64  # of parameters: how many different ones at least, and up to which


@dataclass(frozen=True)
class Race:
    """Median seconds of every runner at every m, over `rounds` rounds."""

    m: tuple[int, ...]
    seconds: Mapping[str, tuple[float, ...]]
    rounds: int


def race(
    problem: Problem, p: Array, runners: Mapping[str, RouteSpec], solver: Solver, afford: float, min_time: float
) -> Race:
    """m is doubled up to n_p or MOST_PARAMETERS while ROUNDS rounds are predicted to take less than `afford` seconds.

    Rounds go on for `min_time` seconds, at most MOST_ROUNDS. Raises what routes raise.
    """
    numbers: list[int] = []
    calls: list[dict[str, Callable[[], Any]]] = []
    spent = 0.0
    for m in doublings(min(len(p), MOST_PARAMETERS)):
        prepared = {name: _prepared(problem, p, m, spec, solver) for name, spec in runners.items()}
        spent += sum(_second(call) for call in prepared.values())
        if len(numbers) >= NUMBERS and ROUNDS * spent > afford:
            break
        numbers.append(m)
        calls.append(prepared)
    return _raced(numbers, calls, min_time)


def doublings(last: int) -> list[int]:
    """1, 2, 4, ... and `last`."""
    return [*(2**j for j in range(last.bit_length()) if 2**j < last), last]


def _prepared(problem: Problem, p: Array, m: int, spec: RouteSpec, solver: Solver) -> Callable[[], Any]:
    few = Partial("components", m).restrict(problem, p)
    q = p if few is None else few.parameters.start.copy()
    model = Model(problem if few is None else few, solver)
    gradient = spec.route.prepare(model, q, **spec.options)
    return lambda: gradient(q)


def _second(call: Callable[[], Any]) -> float:
    """Seconds of a call after the first, which may compile."""
    call()
    return seconds_of(call)[0]


def _raced(m: Sequence[int], calls: Sequence[Mapping[str, Callable[[], Any]]], min_time: float) -> Race:
    samples: list[list[dict[str, float]]] = []
    start = time.perf_counter()
    with no_garbage_collection():
        while len(samples) < ROUNDS or (time.perf_counter() - start < min_time and len(samples) < MOST_ROUNDS):
            samples.append([{name: seconds_of(call)[0] for name, call in at_m.items()} for at_m in calls])
    seconds = {
        name: tuple(median(sample[i][name] for sample in samples) for i in range(len(calls))) for name in calls[0]
    }
    return Race(tuple(m), seconds, len(samples))
