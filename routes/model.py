"""Model = problem + solver + tally: all a route sees. Work passes its few doorways, and only they count."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from problems.problem import Array, Linearization, Offers, Parameters, Problem, Traced
from routes.factorization import Factorization, factorize
from routes.newton import Solver, State, Step, newton, norm
from routes.tally import Tally


class Model:
    """A problem that can be solved, with its work counted in `tally`."""

    def __init__(self, problem: Problem, solver: Solver | None = None) -> None:
        self.problem = problem
        self.solver = solver or Solver()
        self.tally = Tally()

    @property
    def parameters(self) -> Parameters:
        return self.problem.parameters

    @cached_property
    def traced(self) -> Traced:
        """R and J in jax.numpy: one object, so that JAX recognizes what it has compiled."""
        return self.problem.traced()

    def residual(self, u: Array, p: Array) -> Array:
        self.tally.count("residuals")
        return self.problem.residual(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        self.tally.count("assemblies")
        return self.problem.tangent(u, p)

    def factorize(self, A: Any) -> Factorization:
        self.tally.count("factorizations")
        return factorize(A, self.problem.name)

    def matvec(self, A: Any, v: Array) -> Array:
        self.tally.count("matvecs")
        return np.asarray(A @ v)

    def solve_linear(self, factors: Factorization, b: Array) -> Array:
        """R_u^{-1} b."""
        self.tally.count("solves")
        return factors.solve(b)

    def solve_transposed(self, factors: Factorization, b: Array) -> Array:
        """R_u^{-T} b."""
        self.tally.count("transposed_solves")
        return factors.solve_transposed(b)

    def factors_at(self, state: State) -> Factorization:
        """Factors of R_u at the solved state itself.

        The last Newton factors belong to the iterate before: a linearized solve with them is off by the size of
        the last step (1e-8 and worse). Only a linear problem's fit.
        """
        return state.factors if self.problem.linear else self.factorize(self.tangent(state.u, state.p))

    def newton_correction(self, factors: Factorization, R: Array) -> Array:
        self.tally.count("newton_iterations")
        return self.solve_linear(factors, R)

    def linearize(self, state: State) -> Linearization:
        """R_p, J_u, J_p at a solved state: about a residual's worth, and of no kind that is counted."""
        return self.problem.linearize(state.u, state.p)

    def solve(self, p: Array, start: State | None = None, factors: Factorization | None = None) -> State:
        """Solve R(u, p) = 0: cold, warm from the state `start`, by chord steps if `factors` are given.

        p may be complex where the problem offers COMPLEX: the imaginary part, a derivative, converges one Newton
        step behind the real part that is watched, so one more is taken. Raises NotConverged, SingularMatrix.
        """
        before = self.tally.work
        self.tally.count("forward_solves")
        step = Step(
            residual=lambda u: self.residual(u, p),
            factorize=lambda u: self.factorize(self.tangent(u, p)),
            correct=self.newton_correction,
        )
        u = self.problem.initial(p) if start is None else start.u.astype(p.dtype)
        scale = None if start is None else start.scale
        polish = int(np.iscomplexobj(p) and not self.problem.linear)
        u, history, scale, last = newton(step, u, self.solver, self.problem.name, scale, factors, polish)
        J = self.problem.objective(u, p)
        return State(p, u, J, history, scale, last, self.tally.work - before)

    def relative_residual(self, u: Array, p: Array) -> float:
        """|R(u, p)|_inf / |R(u_0, p)|_inf of a state that was not solved for here: two residuals."""
        scale = norm(self.residual(self.problem.initial(p), p))
        return norm(self.residual(u, p)) / (scale or 1.0)

    def value(self, p: Array) -> float:
        """J(p), one forward solve; the way into a black box, too."""
        if Offers.SOLVE in self.problem.offers:
            return float(self.solve(p).J)
        self.tally.count("forward_solves")
        return float(self.problem.value(p))
