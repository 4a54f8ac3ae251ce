"""pytest-benchmark: the bar's adjoint over N, and the start-up of the command line. Run by `make benchmark`."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

import pytest

from problems.bar import Bar
from routes.adjoint import adjoint
from routes.model import Model


@pytest.mark.benchmark(group="bar, adjoint")
@pytest.mark.parametrize("n", [10**3, 10**5, 10**6])
def test_bar_adjoint(benchmark, n: int) -> None:
    problem = Bar(n=n)
    p, model = problem.parameters.start, Model(problem)
    gradient = adjoint.prepare(model, p)
    before = model.tally.work
    gradient(p)
    benchmark.extra_info["work"] = asdict(model.tally.work - before)
    result = benchmark(gradient, p)
    assert not result.gradient[5:].any()


@pytest.mark.benchmark(group="start-up", min_rounds=5)
@pytest.mark.parametrize("arguments", [["--help"], ["list"]], ids=" ".join)
def test_start_up(benchmark, arguments: list[str]) -> None:
    command = [str(Path(sys.executable).with_name("routes")), *arguments]
    done = benchmark(subprocess.run, command, capture_output=True, check=True)
    assert b"bar" in done.stdout
