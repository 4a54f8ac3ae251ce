"""Accuracy and cost of checks: floors and slopes of V-curves, calls, wall time.

python -m benchmarks.verdicts
"""

from __future__ import annotations

import numpy as np

from benchmarks.bar_limits import wall_seconds
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.verification.api import check as check_code
from gradient_routes.bench.verification.check import check
from gradient_routes.bench.verification.plan import THOROUGH
from gradient_routes.bench.verification.registered import subject
from gradient_routes.bench.verification.result import Check
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.newton import Solver

N_P = 1000  # parameters of the black box
VCURVE = ("vcurve", "--no-store", "--problem", "bar", "--route", "adjoint")


def vcurve(problem: Problem) -> Check:
    """The adjoint's V-curves at the start."""
    p = problem.parameters.start
    return check(subject(problem, adjoint, adjoint.defaults, p, Solver()), THOROUGH)


def black_box(wrong: int | None = None) -> Check:
    """A check of J = sum a_i sin p_i + p_i^3 / 10, its gradient right or doubled in one component."""
    rng = np.random.default_rng(0)
    a, p = rng.uniform(0.5, 2.0, N_P), rng.uniform(0.2, 1.0, N_P)

    def gradient(p: Array) -> Array:
        g: Array = a * np.cos(p) + 0.3 * p**2
        if wrong is not None:
            g[wrong] *= 2.0
        return g

    return check_code(lambda p: float(np.sum(a * np.sin(p) + 0.1 * p**3)), gradient, p)


def main() -> None:
    out = console()
    for name, problem, wanted in (("bar", Bar(), 1e-10), ("block n = 4", Block(n=4), 1e-9)):
        found = vcurve(problem)
        for reading in found.readings:
            out.print(
                f"{name}, {reading.name}: central floor {number(reading.central.floor, 2)} (<= {wanted:g}),"
                f" slope {number(reading.central.slope)}; one-sided floor {number(reading.one_sided.floor, 2)},"
                f" slope {number(reading.one_sided.slope)}",
                soft_wrap=True,
            )
    for wrong in (None, 417):
        found = black_box(wrong)
        what = "right" if wrong is None else f"component {wrong + 1} doubled"
        out.print(
            f"black box, {N_P} parameters, {what}: {found.verdict}, {found.calls} objective calls (<= 200),"
            f" {found.gradients} gradient; culprit: {found.culprit}",
            soft_wrap=True,
        )
    out.print(f"routes {' '.join(VCURVE)}: {wall_seconds(VCURVE):.2f} s wall (<= 3 s)")


if __name__ == "__main__":
    main()
