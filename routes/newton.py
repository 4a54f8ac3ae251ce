"""The forward solve R(u, p) = 0 by Newton's method, written once for every problem."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array
from gradient_routes.routes.newton_steps import Direction
from gradient_routes.routes.solvers.registry import DEFAULT, linear_solver
from gradient_routes.routes.solvers.solver import Factorization, LinearSolver
from gradient_routes.routes.tally import Work

STEP_LENGTHS = tuple(0.5**i for i in range(9))
DESCENT = 1e-4  # of |R|, times the step length, for a step to be taken
ROUNDING = 16.0 * np.finfo(np.float64).eps  # |R| <= ROUNDING |R_u| (|u| + |X|): no iteration can do better
CANCELLED = 1e4  # |u| / |u - du| beyond which u - du has lost digits that |R| need not show
LAST = 8  # iterates that a report shows

Newton = Literal["full", "inexact"]


@dataclass(frozen=True)
class Solver:
    """When a forward solve is done: |R|_inf <= rtol |R(u_0)|_inf, or R is rounding; at most max_steps steps.

    linear_solver  the name of a registered LinearSolver; auto: the best direct one that is installed
    newton         full: R_u is factorized at every step; inexact: once, and again where that pays. A linear problem
                   takes one full step, complex p full ones: the imaginary part is not watched; and so do problems
                   without line search: that full steps converge is known of exact ones
    adjoint_rtol   |b - R_u x|_inf / |b|_inf of linearized solves, transposed or not, where they iterate
    polish         Newton steps after convergence, on nonlinear problems
    """

    rtol: float = 1e-12
    max_steps: int = 50
    linear_solver: str = DEFAULT
    newton: Newton = "full"
    adjoint_rtol: float = 1e-12
    polish: int = 0

    @property
    def linear(self) -> LinearSolver:
        """The solver of that name. Raises InputError."""
        return linear_solver(self.linear_solver)


@dataclass(frozen=True)
class State:
    """A solved state: u (n_u,) and J at p (n_p,).

    factors belong to the last step (for a linear problem: to R_u itself), or to an earlier one after inexact steps:
    rate is then the contraction a product that iterations with them saw, or that the steps before let expect, else
    None. history holds |R|_inf of every iterate, scale is the |R|_inf that tolerances are relative to, work what the
    solve took.
    """

    p: Array
    u: Array
    J: Any
    history: tuple[float, ...]
    scale: float
    factors: Factorization
    work: Work
    rate: float | None = None

    @property
    def residual(self) -> float:
        """Achieved |R|_inf relative to scale."""
        return self.history[-1] / self.scale if self.scale else self.history[-1]


@dataclass(frozen=True)
class Step:
    """What Newton's method needs of a problem, bound to one p."""

    offset: float
    residual: Callable[[Array], Array]
    direction: Direction
    line_search: bool
    active_set: Callable[[Array], Hashable | None]


def newton(
    step: Step,
    u: Array,
    solver: Solver,
    who: str,
    scale: float | None = None,
    polish: int = 0,
) -> tuple[Array, tuple[float, ...], float]:
    """u <- u - a du until |R| is small, du being R_u^{-1} R or what the step's direction takes for it.

    The step length a is halved until |R| falls; an inverted element or an overflow gives no finite |R| and is
    stepped back from in the same way, once the direction is as exact as it can be. At least one step is taken, so that
    a warm start is never returned untouched and the factors are those of the neighbourhood; after convergence,
    `polish` more. Without line search a is 1 and |R| may rise. Where R is smooth in pieces, a small |R| counts only on
    the piece that the step was made for, as |R_u| of a stiff penalty makes everything rounding; or where |R| was small
    before, too, as at a kink. An iterate in which much cancelled is followed by another: |R| of a soft structure does
    not feel what was lost. Returns u, the history of |R|_inf and the scale. Raises NotConverged with the history.
    """
    R = step.residual(u)
    history, sets = [norm(R)], [step.active_set(u)]
    scale = history[0] if scale is None else scale
    goal = solver.rtol * scale
    while len(history) <= solver.max_steps and math.isfinite(history[-1]):
        du, norm_of_R_u = step.direction(u, R, scale, goal)
        for a in STEP_LENGTHS if step.line_search else (1.0,):
            u_next = u - a * du
            R_next, set_next = step.residual(u_next), step.active_set(u_next)
            rounding = ROUNDING * norm_of_R_u * (norm(u_next) + step.offset)
            small = norm(R_next) <= max(solver.rtol * scale, rounding) and set_next == sets[-1]
            small |= max(norm(R_next), history[-1]) <= solver.rtol * scale
            small &= norm(u) <= CANCELLED * (norm(u_next) + step.offset)
            lower = norm(R_next) <= (1.0 - DESCENT * a) * history[-1]
            if small or lower or (not step.line_search and math.isfinite(norm(R_next))):
                break
        else:
            if step.direction.renew():
                continue
            raise _failure(who, history, sets, "no step along Newton's direction lowers |R|")
        u, R = u_next, R_next
        history.append(norm(R))
        sets.append(set_next)
        if small:
            if polish == 0:
                return u, tuple(history), scale
            polish, goal = polish - 1, 0.0
    if not math.isfinite(history[-1]):
        raise NotConverged(
            f"{who}: R is not finite where the solve starts - lower the load or choose another p", tuple(history)
        )
    raise _failure(who, history, sets, f"wanted {solver.rtol * scale:.3g}, max-steps={solver.max_steps}")


def _failure(who: str, history: list[float], sets: list[Hashable | None], why: str) -> NotConverged:
    last = " ".join(f"{r:.2g}" for r in history[-LAST:])
    report = f"not converged in {len(history) - 1} steps: {why}; |R| = {last} - lower the load or start nearer"
    visited = "" if sets[-1] is None else f"; active sets: {' '.join(str(one) for one in sets[-LAST:])}"
    return NotConverged(f"{who}: {report}{visited}", tuple(history))


def norm(v: Array) -> float:
    """|v|_inf."""
    return float(np.abs(v).max(initial=0.0))
