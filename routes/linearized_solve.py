"""Linearized solves at a solved state: which factors of R_u to use, and what that does to the gradient."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Literal

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State, norm
from gradient_routes.routes.route import ForwardWork, Work
from gradient_routes.routes.solvers.krylov import conjugate_gradients, conjugate_residuals, products_to
from gradient_routes.routes.solvers.solver import Factorization

Factors = Annotated[
    Literal["refined", "fresh", "stale"],
    "the last Newton factors corrected with R_u at u; new ones at u; the last ones as they are",
]
SAFETY = 10.0  # on the contraction seen, before it is trusted once more
WORTH = 15  # products, each with a substitution, that cost what an assembly and a factorization cost


class LinearizedSolver:
    """R_u^{-1} and R_u^{-T} at a solved state, for about `solves` right-hand sides.

    The last Newton factors belong to the iterate before: used as they are (`stale`), the gradient is off by the
    size of the last step. `refined` corrects with them by Krylov iterations on products with R_u; where those would
    take longer than new factors, as after inexact steps, and for `fresh`, R_u is factorized at u. A linear problem's
    factors fit. Solves that iterate end at the solver's adjoint_rtol; a solver that factorizes nothing takes R_u at u.
    """

    def __init__(self, model: Model, state: State, factors: str, solves: int = 1) -> None:
        self.model, self.state = model, state
        self.rtol = model.solver.adjoint_rtol
        self.A, self.R_u = state.factors.to(self.rtol), None
        if model.problem.linear or factors == "stale":
            return
        known = state.rate is not None and math.isfinite(state.rate)
        too_far = known and solves * products_to(state.rate or 0.0, 1.0, self.rtol) > WORTH
        if factors == "fresh" or too_far or not model.solver.linear.factors:
            self.A = model.factors_at(state).to(self.rtol)
        else:
            self.R_u = model.tangent_operator(state)

    def solve(self, b: Array) -> Array:
        """x with R_u x = b."""
        return self._solve(b, self.model.solve_linear, transposed=False)

    def solve_transposed(self, b: Array) -> Array:
        """x with R_u^T x = b."""
        return self._solve(b, self.model.solve_transposed, transposed=True)

    def _solve(self, b: Array, substitute: Callable[[Factorization, Array], Array], transposed: bool) -> Array:
        if self.R_u is None:
            return substitute(self.A, b)
        R_u = self.R_u.T if transposed else self.R_u
        symmetric = self.model.problem.structure != "general"
        done = (conjugate_gradients if symmetric else conjugate_residuals)(
            lambda v: self.model.matvec(R_u, v),
            lambda r: substitute(self.A, r),
            b,
            self.rtol / SAFETY * norm(b),
            at_most=WORTH,
        )
        if done.converged:
            return done.x
        self._renew()
        x = substitute(self.A, b)
        if not np.isfinite(x).all():
            raise NotConverged(f"{self.model.problem.name}: linearized solve is not finite - check p", ())
        return x

    def _renew(self) -> None:
        """Factors of R_u itself, from what is assembled already if it is."""
        free = self.model.problem.matrix_free
        self.A = self.model.factors_at(self.state) if free else self.model.factorize(self.R_u)
        self.R_u = None


def work(forward: ForwardWork, solves: int, transposed: bool, factors: str) -> Work:
    """Declared: a forward solve and `solves` linearized ones; each refinement is a product and a substitution."""
    kind = "transposed_solves" if transposed else "solves"
    if forward.linear or factors == "stale":
        return forward.cold + Work(**{kind: solves})
    if factors == "fresh":
        return forward.cold + forward.factors_at_solution() + Work(**{kind: solves})
    sweeps, renewals = forward.sweeps(solves), forward.renewals()
    assemblies = renewals if forward.matrix_free else 1
    return forward.cold + Work(0, 0, 0, sweeps, assemblies, renewals) + Work(**{kind: solves + sweeps})
