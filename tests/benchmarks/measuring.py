"""Fixtures of benchmarks: before and after each the machine is measured, for what slows both slows no route.

No conftest: tests import theirs by that name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any

import pytest
from calibration import calibration

from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Route


@pytest.fixture(autouse=True)
def calibrated(benchmark: Any) -> Iterator[None]:
    before = calibration()
    yield
    benchmark.extra_info["calibration_s"] = [before, calibration()]


@pytest.fixture
def timed(benchmark: Any):
    """Times a call that has been made before: by a first one pytest-benchmark would reckon too few rounds."""

    def run(call: Callable[..., Any], *arguments: Any) -> Any:
        for _ in range(3):
            call(*arguments)
        return benchmark(call, *arguments)

    return run


@pytest.fixture
def gradient_of(benchmark: Any, timed: Callable[..., Any]):
    """Times a route's gradient at p and notes the work of one call."""

    def run(route: Route, model: Model, p: Array, **options: Any) -> Array:
        gradient = route.prepare(model, p, **options)
        gradient(p)  # compiled
        before = model.tally.work
        gradient(p)
        benchmark.extra_info["work"] = asdict(model.tally.work - before)
        return timed(gradient, p).gradient

    return run
