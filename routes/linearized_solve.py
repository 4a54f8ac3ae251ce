"""Linearized solves at a solved state: which factors of R_u to use, and what that does to the gradient."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Annotated, Literal

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array, Operator
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State, norm
from gradient_routes.routes.route import ForwardWork, Work
from gradient_routes.routes.solvers.krylov import conjugate_gradients, conjugate_residuals, products_to
from gradient_routes.routes.solvers.solver import Factorization

Factors = Annotated[
    Literal["refined", "fresh", "stale"],
    "the last Newton factors corrected with R_u at u; new ones at u; the last ones as they are",
]
SAFETY = 10.0  # of the tolerance: the last correction relies on the mean contraction of those before it
WORTH = 15  # products, each with a substitution, that cost as much as an assembly and a factorization


class LinearizedSolver:
    """R_u^{-1} and R_u^{-T} at a solved state, for about `solves` right-hand sides.

    The last Newton factors are those of R_u at the iterate before: used as they are (`stale`), they give a gradient
    with an error of the size of the last step. `refined` uses them as preconditioner of Krylov iterations with R_u at
    u. R_u is factorized at u for `fresh`, where these iterations would take longer, as after inexact steps, and by
    solvers without factors. R_u of a linear problem does not depend on u. Iterations end at the solver's adjoint_rtol.
    """

    def __init__(self, model: Model, state: State, factors: str, solves: int = 1) -> None:
        self.model, self.state = model, state
        self.rtol = model.solver.adjoint_rtol
        self.A, self.R_u = state.factors.to(self.rtol), None
        if model.problem.linear or model.problem.steps or factors == "stale":  # a march leaves factors at u
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


def state_derivatives(R_u: LinearizedSolver, R_p: Operator, components: Iterable[int]) -> Iterator[Array]:
    """du/dp_i (n_u,), R_u du/dp_i = -R_p e_i, for each of the components i, counted from 0: one solve each."""
    e = np.zeros(len(R_u.state.p))
    for i in components:
        e[i] = 1.0
        yield R_u.solve(-(R_p @ e))
        e[i] = 0.0


def work(forward: ForwardWork, solves: int, transposed: bool, factors: str) -> Work:
    """Declared: a forward solve and `solves` linearized ones; each refinement is a product and a substitution."""
    kind = "transposed_solves" if transposed else "solves"
    if forward.linear or factors == "stale":
        return forward.cold + Work(**{kind: solves})
    if factors == "fresh" or forward.cold.steps:
        return forward.cold + forward.factors_at_solution() + Work(**{kind: solves})
    sweeps, renewals = forward.sweeps(solves), forward.renewals()
    assemblies = renewals if forward.matrix_free else 1
    return forward.cold + Work(0, 0, 0, sweeps, assemblies, renewals) + Work(**{kind: solves + sweeps})
