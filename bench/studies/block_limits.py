"""What the block's parts cost against each other: gradient, assembly, factorization, memory, growth.

    python -m bench.studies.block_limits

Every ratio is of one run with the same threads on both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any

import numpy as np
from rich.table import Table

from bench.memory import peak_of
from bench.timing import seconds_of
from bench.views.format import bytes_, seconds
from bench.views.tables import console
from problems.block import Block
from routes.model import Model
from routes.refinement import LinearizedSolver

SIZES = (8, 12, 16, 20)
REPEATS = 5


@dataclass(frozen=True)
class Parts:
    """Of the block with n^3 cells: seconds of its parts, bytes of its factors and of a whole gradient."""

    n_u: int
    forward: float
    gradient: float
    assembly: float
    factorization: float
    factors: int
    peak: int


def parts(n: int) -> Parts:
    """Measure forward solve, refined adjoint gradient after it, assembly and numeric factorization at the solution."""
    block = Block(n=n)
    p, model = block.parameters.start, Model(block)

    def gradient_after(state: Any) -> Any:
        lin = model.linearize(state)
        return lin.R_p.T @ LinearizedSolver(model, state, "refined").solve_transposed(-lin.J_u)

    state = model.solve(p)
    gradient_after(state)
    peak, _ = peak_of(lambda: gradient_after(model.solve(p)))
    K = block.tangent(state.u, p)
    return Parts(
        n_u=block.n_state,
        forward=steady_seconds(lambda: model.solve(p)),
        gradient=steady_seconds(lambda: gradient_after(state)),
        assembly=steady_seconds(lambda: block.tangent(state.u, p)),
        factorization=steady_seconds(lambda: model.factorize(K)),
        factors=state.factors.nbytes,
        peak=peak,
    )


def steady_seconds(call: Callable[[], Any]) -> float:
    """Median of REPEATS calls after one that warms up."""
    call()
    return median(seconds_of(call)[0] for _ in range(REPEATS))


def main() -> None:
    out = console()
    table = Table(box=None, pad_edge=False, title="block, neo-Hookean, full Newton", title_justify="left")
    columns = (
        "n",
        "n_u",
        "forward",
        "gradient",
        "gradient/forward",
        "assembly/factorization",
        "factors",
        "peak/factors",
    )
    for name in columns:
        table.add_column(name, justify="right")
    measured = [parts(n) for n in SIZES]
    for n, m in zip(SIZES, measured, strict=True):
        table.add_row(
            str(n),
            str(m.n_u),
            seconds(m.forward),
            seconds(m.gradient),
            f"{m.gradient / m.forward:.3f}",
            f"{m.assembly / m.factorization:.2f}",
            bytes_(m.factors),
            f"{m.peak / m.factors:.1f}",
        )
    out.print(table)
    log_n_u = np.log([m.n_u for m in measured])
    for name in ("forward", "gradient", "assembly", "factorization"):
        slope = np.polyfit(log_n_u, np.log([getattr(m, name) for m in measured]), 1)[0]
        out.print(f"{name} ~ n_u^{slope:.2f}")


if __name__ == "__main__":
    main()
