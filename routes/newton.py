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
RESOLVED = 1e-6  # of |u|: where rounding of X + u is more, u is not resolved
CANCELLED = 1e4  # |u| / |u - du| beyond which u - du has lost digits, which |R| may not show
LAST = 8  # iterates in a message

Newton = Literal["auto", "full", "inexact"]


@dataclass(frozen=True)
class Solver:
    """When a forward solve is done: |R|_inf <= rtol |R(u_0)|_inf, or R is rounding (see `rounding`); max_steps at most.

    linear_solver  the name of a registered LinearSolver; auto: the best direct one that is installed
    newton         full: R_u is factorized at every step; inexact: once, and again where that is cheaper than
                   iterating; auto: where a solve and an adjoint after it are cheaper so, iterations as far as one
                   factorization more ends the solve, by full steps from a state nearby. Solvers that iterate end
                   inexact steps and those of auto early. Full steps are taken on linear problems, for complex p, whose
                   imaginary part no tolerance controls, on problems without line search, where convergence is
                   proved for full steps, and with auto where J is differenced
    adjoint_rtol   |b - R_u x|_inf / |b|_inf of linearized solves, transposed or not, where they iterate
    polish         Newton steps after convergence, on nonlinear problems
    """

    rtol: float = 1e-12
    max_steps: int = 50
    linear_solver: str = DEFAULT
    newton: Newton = "auto"
    adjoint_rtol: float = 1e-12
    polish: int = 0

    @property
    def linear(self) -> LinearSolver:
        """The solver of that name. Raises InputError."""
        return linear_solver(self.linear_solver)


@dataclass(frozen=True)
class State:
    """A solved state: u (n_u,) and J at p (n_p,).

    factors  of R_u at the last step, for a linear problem R_u itself; after inexact steps, of an earlier step
    rate     after inexact steps, the contraction by a product preconditioned with these factors, measured or expected
    history  |R|_inf of every iterate
    scale    the |R|_inf that tolerances are relative to
    work     counted in the solve
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


def unwatched(a: float, u: Array) -> None:
    return None


@dataclass(frozen=True)
class System:
    """R(u) = 0 for Newton's method: a problem bound to one p, and how its steps are found.

    taken  is called with the length of every step that is taken, and the iterate it leads to
    """

    offset: float
    residual: Callable[[Array], Array]
    direction: Direction
    line_search: bool
    active_set: Callable[[Array], Hashable | None]
    taken: Callable[[float, Array], None] = unwatched


def newton(
    system: System,
    u: Array,
    solver: Solver,
    who: str,
    scale: float | None = None,
    polish: int = 0,
) -> tuple[Array, tuple[float, ...], float]:
    """u <- u - a du until |R| is small, du being R_u^{-1} R or an approximation of it: see newton_steps.

    The step length a is halved until |R| falls, also where an inverted element or an overflow gives no finite |R|; if
    no a is small enough, the direction is made exact first. Without line search a = 1 and |R| may rise. At least one
    step is taken, so that a warm start is improved and factors near the solution exist; after convergence, `polish`
    more. Convergence is not accepted
    - where the step has changed the active set of a piecewise smooth R, because |R_u| of a stiff penalty makes any |R|
      rounding, unless |R| was below the tolerance before the step, too, as at a kink;
    - where digits cancelled in u - a du, because |R| of a soft structure does not show the loss.
    Returns u, the history of |R|_inf and the scale. Raises NotConverged with the history.
    """
    R = system.residual(u)
    history, sets = [norm(R)], [system.active_set(u)]
    scale = history[0] if scale is None else scale
    goal = solver.rtol * scale
    while len(history) <= solver.max_steps and math.isfinite(history[-1]):
        du, norm_of_R_u = system.direction(u, R, scale, goal)
        for a in STEP_LENGTHS if system.line_search else (1.0,):
            u_next = u - a * du
            R_next, set_next = system.residual(u_next), system.active_set(u_next)
            small = norm(R_next) <= max(solver.rtol * scale, rounding(u_next, norm_of_R_u, system.offset))
            small &= set_next == sets[-1]
            small |= max(norm(R_next), history[-1]) <= solver.rtol * scale
            small &= norm(u) <= CANCELLED * (norm(u_next) + system.offset)
            lower = norm(R_next) <= (1.0 - DESCENT * a) * history[-1]
            if small or lower or (not system.line_search and math.isfinite(norm(R_next))):
                break
        else:
            if system.direction.renew():
                continue
            raise _failure(who, history, sets, scale, f"no step lowers |R|, wanted {solver.rtol:g}")
        u, R = u_next, R_next
        system.taken(a, u)
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
    raise _failure(who, history, sets, scale, f"wanted {solver.rtol:g}, max-steps={solver.max_steps}")


def rounding(u: Array, norm_of_R_u: float, offset: float) -> float:
    """|R| that rounding of u, or of X + u with |X| = offset, leaves at a solution u (n_u,)."""
    size = norm(u)
    return norm_of_R_u * min(ROUNDING * (size + offset), RESOLVED * size)


def _failure(who: str, history: list[float], sets: list[Hashable | None], scale: float, why: str) -> NotConverged:
    last = " ".join(f"{r:.2g}" for r in history[-LAST:])
    relative = f"|R| / |R_0| = {history[-1] / scale:.2g}, " if scale else ""
    report = (
        f"not converged in {len(history) - 1} steps: {relative}{why}; |R| = {last} - lower the load or start nearer"
    )
    visited = "" if sets[-1] is None else f"; active sets: {' '.join(str(one) for one in sets[-LAST:])}"
    return NotConverged(f"{who}: {report}{visited}", tuple(history))


def norm(v: Array) -> float:
    """|v|_inf."""
    return float(np.abs(v).max(initial=0.0))
