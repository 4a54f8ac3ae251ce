"""How near estimates of a gradient's error come to the error, and what an estimate costs.

    python -m benchmarks.error_bars

All problems below, all exact routes, tolerances from 1e-1 to 1e-12. Errors are against a closed form, complex steps or
tangents of tight direct solves; those that are rounding are not compared. Costs are of one run.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from statistics import median

import numpy as np
from rich.table import Table

from gradient_routes.bench.cases import case
from gradient_routes.bench.execution.error_estimate import error_estimate
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.studies.tolerance.measure import ToleranceSweep, decades, tolerance
from gradient_routes.bench.studies.tolerance.view import ROUNDING, WITHIN
from gradient_routes.problems.block import Block
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model

PROBLEMS = (
    *("bar", "bar[n=100,parametrization=raw]", "bar[n=21,sensors=21,noise=0.01,alpha=0.1]", "bar[n=1000]"),
    *(f"bar[n=6,sensors=4,stop={stop}]" for stop in ("penalty", "softplus", "quadratic", "multiplier")),
    *("advection[n=6]", "advection[n=4,unknown=source]"),
    *("block[n=2]", "block[n=3,traction=0.5]", "block[n=2,law=ogden,load=follower]", "block[n=2,unknown=shape]"),
    *("block[n=2,derivatives=hand,load=displacement]", "block[n=2,law=linear]"),
)
ROUTES = ("tangent", "adjoint", "adjoint[correct=yes]", "implicit-ad", "complex-step", "unrolled-ad")
TOLERANCES = ToleranceSweep(decades(1e-1, 1e-12))
SOLVERS = {True: ("descent", "krylov"), False: ("auto", "krylov")}  # of linear problems, of others
SHARE, COST = 0.95, 0.3  # of the estimates that are to be near, of a forward solve
SIZES = (6, 8, 12)
BUDGET = 20.0


@dataclass(frozen=True)
class Estimate:
    """The estimated error over the error, of a route on a problem with a linear solver."""

    problem: str
    linear_solver: str
    route: str
    error: float
    ratio: float

    @property
    def near(self) -> bool:
        return 1.0 / WITHIN <= self.ratio <= WITHIN


def estimates() -> Iterator[Estimate]:
    """Of all gradients whose error is no rounding; those without an estimate have the ratio 0."""
    for selector in PROBLEMS:
        (problem,) = case.problems([selector])
        for linear_solver in SOLVERS[problem().linear]:
            done = tolerance(problem, case.routes(ROUTES), TOLERANCES, linear_solver=linear_solver, budget=BUDGET)
            for row in done.rows:
                if row["gradient_error"] is not None and row["gradient_error"] > ROUNDING:
                    ratio = (row["gradient_error_estimate"] or 0.0) / row["gradient_error"]
                    yield Estimate(selector, linear_solver, row["route"], row["gradient_error"], ratio)


def cost(n: int) -> float:
    """Of an estimate for the adjoint of the block, in forward solves."""
    model = Model(Block(n=n))
    p = model.problem.parameters.start
    state, result = model.solve(p), adjoint.function(model, p)
    rounds = [
        (
            seconds_of(lambda: error_estimate(model, state, adjoint, result))[0],
            seconds_of(lambda: model.solve(p))[0],
        )
        for _ in range(9)
    ]
    return median(estimate / forward for estimate, forward in rounds[1:])


def main() -> None:
    found = list(estimates())
    table = Table("problem", "solver", "route", "error", "estimate / error", box=None, header_style="bold")
    for one in found:
        if not one.near:
            table.add_row(one.problem, one.linear_solver, one.route, f"{one.error:.2g}", f"{one.ratio:.2g}")
    out = console()
    out.print(table)
    for route, count in Counter(one.route for one in found).items():
        ratios = [one.ratio for one in found if one.route == route]
        out.print(
            f"{route}: {count} gradients, ratio {np.quantile(ratios, 0.05):.2f} to {np.quantile(ratios, 0.95):.2f}"
        )
    share = sum(one.near for one in found) / len(found)
    out.print(f"within a factor of {WITHIN:g}: {share:.1%} of {len(found)}, {SHARE:.0%} wanted")
    costs = {n: cost(n) for n in SIZES}
    for n, of in costs.items():
        out.print(f"an estimate on block[n={n}]: {of:.2f} forward solves, {COST:g} at most wanted")
    sys.exit(share < SHARE or min(costs.values()) > COST)


if __name__ == "__main__":
    main()
