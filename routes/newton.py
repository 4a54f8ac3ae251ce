"""The forward solve R(u, p) = 0 by Newton's method, written once for every problem."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.errors import NotConverged
from problems.problem import Array
from routes.factorization import Factorization, LinearSolver
from routes.tally import Work

STEP_LENGTHS = tuple(0.5**i for i in range(9))
DESCENT = 1e-4  # of |R|, times the step length, for a step to be taken
ROUNDING = 16.0 * np.finfo(np.float64).eps  # |R| <= ROUNDING |R_u| (|u| + |X|): no iteration can do better


@dataclass(frozen=True)
class Solver:
    """When a forward solve is done: |R|_inf <= rtol |R(u_0)|_inf, or R is rounding; at most max_steps steps.

    linear_solver  of sparse symmetric systems: pardiso, superlu, or the best that is installed
    """

    rtol: float = 1e-12
    max_steps: int = 50
    linear_solver: LinearSolver = "auto"


@dataclass(frozen=True)
class State:
    """A solved state: u (n_u,) and J at p (n_p,).

    factors belong to the last step (for a linear problem: to R_u itself), history holds |R|_inf of every
    iterate, scale is the |R|_inf that tolerances are relative to, work what the solve took.
    """

    p: Array
    u: Array
    J: Any
    history: tuple[float, ...]
    scale: float
    factors: Factorization
    work: Work

    @property
    def residual(self) -> float:
        """Achieved |R|_inf relative to scale."""
        return self.history[-1] / self.scale if self.scale else self.history[-1]


@dataclass(frozen=True)
class Step:
    """The doorways Newton's method needs, bound to one p; what |u| is added to before it is rounded."""

    offset: float
    residual: Callable[[Array], Array]
    factorize: Callable[[Array], Factorization]
    correct: Callable[[Factorization, Array], Array]


def newton(
    step: Step,
    u: Array,
    solver: Solver,
    who: str,
    scale: float | None = None,
    factors: Factorization | None = None,
    polish: int = 0,
) -> tuple[Array, tuple[float, ...], float, Factorization]:
    """u <- u - a R_u^{-1} R until |R| is small; with `factors`, chord steps u <- u - a A^{-1} R that keep them.

    The step length a is halved until |R| falls; an inverted element or an overflow gives no finite |R| and is
    stepped back from in the same way. At least one step is taken, so that a warm start is never returned untouched
    and the factors are those of the neighbourhood; after convergence, `polish` more. Returns u, the history of
    |R|_inf, the scale and the last factors. Raises NotConverged with the history.
    """
    chord = factors
    R = step.residual(u)
    history = [norm(R)]
    scale = history[0] if scale is None else scale
    while len(history) <= solver.max_steps and math.isfinite(history[-1]):
        factors = None  # let go of the old ones first: the new ones can then take over their analysis
        factors = chord or step.factorize(u)
        du = step.correct(factors, R)
        for a in STEP_LENGTHS:
            u_next = u - a * du
            R = step.residual(u_next)
            rounding = ROUNDING * factors.norm * (norm(u_next) + step.offset)
            small = norm(R) <= max(solver.rtol * scale, rounding)
            if small or norm(R) <= (1.0 - DESCENT * a) * history[-1]:
                break
        else:
            raise NotConverged(_report(who, history, "no step along Newton's direction lowers |R|"), tuple(history))
        u = u_next
        history.append(norm(R))
        if small:
            if polish == 0:
                return u, tuple(history), scale, factors
            polish -= 1
    raise NotConverged(_report(who, history, f"wanted {solver.rtol * scale:.3g}"), tuple(history))


def _report(who: str, history: list[float], why: str) -> str:
    last = " ".join(f"{r:.2g}" for r in history[-8:])
    return f"{who}: not converged in {len(history) - 1} steps: {why}; |R| = {last} - lower the load or start nearer"


def norm(v: Array) -> float:
    """|v|_inf."""
    return float(np.abs(v).max(initial=0.0))


@dataclass(frozen=True)
class ForwardWork:
    """What declared bills are made of: the work of one cold forward solve, and estimates for perturbed ones.

    cold         counted for one solve at the p in question; a black box counts just that one
    linear       R is affine in u
    rtol         of the solver
    counted      of a whole gradient: how many Newton steps and refinements p needed is taken from it, once known
    matrix_free  products with R_u need no assembly
    """

    cold: Work
    linear: bool = True
    rtol: float = Solver.rtol
    counted: Work | None = None
    matrix_free: bool = False

    def polished(self) -> Work:
        """A cold solve and one step more."""
        return self.cold if self.linear else self.cold + self._newton(1)

    def solves(self, times: int, polish: int = 0) -> Work:
        """`times` cold solves near p, each with `polish` steps more: see Model.solve."""
        extra = 0 if self.linear else times * polish
        if self.counted is not None and not self.linear:
            extra = self.counted.newton_iterations - times * self.cold.newton_iterations
        return times * self.cold + self._newton(extra)

    def factors_at_solution(self) -> Work:
        """See Model.factors_at."""
        return Work() if self.linear else Work(assemblies=1, factorizations=1)

    def tangent_operator(self) -> Work:
        """See Model.tangent_operator."""
        return Work() if self.matrix_free else Work(assemblies=1)

    def sweeps(self, solves: int) -> int:
        """Refinements of `solves` linearized solves together: one each, unless they are known."""
        return solves if self.counted is None else self.counted.matvecs

    def warm(self, times: int, h: float) -> Work:
        """A polished solve and `times` from its state, |R| ~ h away: a step squares that (linear: one is enough)."""
        each = 1 if self.linear else max(1, math.ceil(math.log2(self._decades(h))))
        return self.polished() + Work(forward_solves=times, residuals=times) + self._newton(self._near(times * each))

    def chord(self, times: int, h: float) -> Work:
        """The same on the factors of the first: every step multiplies |R| by about h."""
        steps = self._near(times * max(1, math.ceil(self._decades(h)) - 1))
        return self.polished() + Work(times, newton_iterations=steps, residuals=times + steps, solves=steps)

    def _near(self, estimate: int) -> int:
        """Newton steps of the perturbed solves together, exactly once they are counted."""
        if self.counted is None:
            return estimate
        return self.counted.newton_iterations - self.polished().newton_iterations

    def _decades(self, h: float) -> float:
        """log rtol / log h, how often the perturbation must multiply itself to vanish."""
        return math.log(self.rtol) / math.log(min(h, 0.5))

    @staticmethod
    def _newton(k: int) -> Work:
        return Work(newton_iterations=k, residuals=k, assemblies=k, factorizations=k, solves=k)
