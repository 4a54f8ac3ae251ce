"""The forward solve R(u, p) = 0 by Newton's method, written once for every problem."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.errors import NotConverged
from problems.problem import Array
from routes.factorization import Factorization
from routes.tally import Work

ROUNDING = 16.0 * np.finfo(np.float64).eps  # |R| <= ROUNDING |R_u| |u|: no iteration can do better


@dataclass(frozen=True)
class Solver:
    """When a forward solve is done: |R|_inf <= rtol |R(u_0)|_inf, or R is rounding; at most max_steps steps."""

    rtol: float = 1e-12
    max_steps: int = 50


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
    """The doorways Newton's method needs, bound to one p."""

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
    """u <- u - R_u^{-1} R until |R| is small; with `factors`, chord steps u <- u - A^{-1} R that keep them.

    At least one step is taken, so that a warm start is never returned untouched and the factors are those
    of the neighbourhood; after convergence, `polish` more. Returns u, the history of |R|_inf, the scale and
    the last factors. Raises NotConverged with the history.
    """
    chord = factors
    R = step.residual(u)
    history = [norm(R)]
    scale = history[0] if scale is None else scale
    for _ in range(solver.max_steps):
        factors = chord or step.factorize(u)
        u = u - step.correct(factors, R)
        R = step.residual(u)
        history.append(norm(R))
        if history[-1] <= max(solver.rtol * scale, ROUNDING * factors.norm * norm(u)):
            if polish == 0:
                return u, tuple(history), scale, factors
            polish -= 1
        if not math.isfinite(history[-1]):
            break
    steps = f"|R| = {history[-1]:.3g} after {len(history) - 1} steps, started at {history[0]:.3g}"
    wanted = f"wanted {solver.rtol * scale:.3g}"
    raise NotConverged(f"{who}: not converged: {steps}, {wanted} - lower the load or start nearer", tuple(history))


def norm(v: Array) -> float:
    """|v|_inf."""
    return float(np.abs(v).max(initial=0.0))


@dataclass(frozen=True)
class ForwardWork:
    """What declared bills are made of: the work of one cold forward solve, and estimates for perturbed ones.

    cold     counted for one solve at the p in question; a black box counts just that one
    linear   R is affine in u
    rtol     of the solver
    steps    Newton and chord steps of all solves together, once they are known; None estimates them
    """

    cold: Work
    linear: bool = True
    rtol: float = Solver.rtol
    steps: int | None = None

    def solves(self, times: int, polish: int = 0) -> Work:
        """`times` cold solves near p; at complex p, `polish` = 1: see Model.solve."""
        extra = 0 if self.linear else times * polish
        if self.steps is not None and not self.linear:
            extra = self.steps - times * self.cold.newton_iterations
        return times * self.cold + self._newton(extra)

    def factors_at_solution(self) -> Work:
        """See Model.factors_at."""
        return Work() if self.linear else Work(assemblies=1, factorizations=1)

    def warm(self, times: int, h: float) -> Work:
        """A cold solve and `times` from its state, |R| ~ h away: a step squares that, a linear problem takes one."""
        each = 1 if self.linear else max(1, math.ceil(math.log2(self._decades(h))))
        return self.cold + Work(forward_solves=times, residuals=times) + self._newton(self._perturbed(times * each))

    def chord(self, times: int, h: float) -> Work:
        """The same on the factors of the cold one: every step multiplies |R| by about h."""
        steps = self._perturbed(times * max(1, math.ceil(self._decades(h)) - 1))
        return self.cold + Work(times, newton_iterations=steps, residuals=times + steps, solves=steps)

    def _perturbed(self, estimate: int) -> int:
        return estimate if self.steps is None else self.steps - self.cold.newton_iterations

    def _decades(self, h: float) -> float:
        """log rtol / log h, how often the perturbation must multiply itself to vanish."""
        return math.log(self.rtol) / math.log(min(h, 0.5))

    @staticmethod
    def _newton(k: int) -> Work:
        return Work(newton_iterations=k, residuals=k, assemblies=k, factorizations=k, solves=k)
