"""What the block's parts cost against each other: gradient, assembly, factorization, inexact steps, memory, growth.

    python -m benchmarks.block_limits

Every ratio is of one run with the same threads on both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from statistics import median
from typing import Any

import numpy as np
from rich.table import Table

from gradient_routes.bench.execution.memory import peak_of
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.render.format import bytes_, seconds
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State

SIZES = (8, 12, 16, 20)
INEXACT_AT = (12, 16)
LARGEST = 24  # 45 000 unknowns: forward solve and adjoint within 4 GiB
REPEATS = 5
ENOUGH = 0.5  # [s] of calls: milliseconds scatter


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

    state = model.solve(p)
    gradient_after(model, state)
    peak, _ = peak_of(lambda: gradient_after(model, model.solve(p)))
    K = block.tangent(state.u, p)
    return Parts(
        n_u=block.n_state,
        forward=steady_seconds(lambda: model.solve(p)),
        gradient=steady_seconds(lambda: gradient_after(model, state)),
        assembly=steady_seconds(lambda: block.tangent(state.u, p)),
        factorization=steady_seconds(lambda: model.factorize(K)),
        factors=state.factors.nbytes,
        peak=peak,
    )


def gradient_after(model: Model, state: State) -> Array:
    """The refined adjoint gradient at a solved state."""
    lin = model.linearize(state)
    return np.asarray(lin.R_p.T @ LinearizedSolver(model, state, "refined").solve_transposed(-lin.J_u))


@dataclass(frozen=True)
class Steps:
    """Medians of REPEATS calls, taken in turns: seconds of forward solve and gradient by full and inexact steps."""

    full: tuple[float, float]
    inexact: tuple[float, float]

    @property
    def forward_gain(self) -> float:
        return self.full[0] / self.inexact[0]

    @property
    def total_gain(self) -> float:
        return sum(self.full) / sum(self.inexact)


def steps(n: int) -> Steps:
    """Full against inexact Newton steps: both in turns, so that what else the machine does falls on both."""
    block = Block(n=n)
    p = block.parameters.start
    models = [Model(block, Solver(newton=newton)) for newton in ("full", "inexact")]
    taken: list[list[tuple[float, float]]] = [[], []]
    for _ in range(1 + REPEATS):
        for model, times in zip(models, taken, strict=True):
            forward, state = seconds_of(partial(model.solve, p))
            times.append((forward, seconds_of(partial(gradient_after, model, state))[0]))
            del state  # its factors leave their analysis to the next
    full, inexact = (tuple(map(median, zip(*times[1:], strict=True))) for times in taken)
    return Steps((full[0], full[1]), (inexact[0], inexact[1]))


def largest() -> tuple[int, int]:
    """n_u and the peak bytes of a forward solve and its gradient, PARDISO's factors included."""
    block = Block(n=LARGEST)
    model = Model(block)
    peak, _ = peak_of(lambda: gradient_after(model, model.solve(block.parameters.start)))
    return block.n_state, peak


def steady_seconds(call: Callable[[], Any]) -> float:
    """Median of calls after one that warms up: REPEATS of them, and more of what is soon done."""
    call()
    taken: list[float] = []
    while len(taken) < REPEATS or sum(taken) < ENOUGH:
        taken.append(seconds_of(call)[0])
    return median(taken)


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
    for n in INEXACT_AT:
        s = steps(n)
        out.print(
            f"n = {n}: inexact steps {seconds(s.inexact[0])}, full {seconds(s.full[0])}: {s.forward_gain:.2f} x;"
            f" with the gradient {s.total_gain:.2f} x"
        )
    n_u, peak = largest()
    out.print(f"n = {LARGEST}: {n_u} unknowns, forward and gradient peak at {bytes_(peak)}")


if __name__ == "__main__":
    main()
