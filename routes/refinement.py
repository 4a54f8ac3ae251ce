"""Linearized solves at a solved state: which factors of R_u to use, and what that does to the gradient."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from problems.errors import NotConverged
from problems.problem import Array
from routes.model import Model
from routes.newton import State, norm
from routes.route import ForwardWork, Work

Factors = Annotated[
    Literal["refined", "fresh", "stale"],
    "the last Newton factors corrected with R_u at u; new ones at u; the last ones as they are",
]
RTOL = 1e-12  # |b - R_u x|_inf / |b|_inf of a refined solve
SAFETY = 10.0  # on the contraction seen, before it is trusted once more


class LinearizedSolver:
    """R_u^{-1} and R_u^{-T} at a solved state.

    The last Newton factors belong to the iterate before: used as they are (`stale`), the gradient is off by the
    size of the last step. `refined` corrects with them, x <- x + A^{-1} (b - R_u x), which converges by that same
    factor a sweep; where it does not, and for `fresh`, R_u is factorized at u. A linear problem's factors fit.
    """

    def __init__(self, model: Model, state: State, factors: str) -> None:
        self.model, self.state, self.factors = model, state, factors
        exact = model.problem.linear or factors == "stale"
        self.R_u = None if exact or factors == "fresh" else model.tangent_operator(state)
        self.A = model.factors_at(state) if factors == "fresh" and not exact else state.factors

    def solve(self, b: Array) -> Array:
        """x with R_u x = b."""
        return self._solve(b, transposed=False)

    def solve_transposed(self, b: Array) -> Array:
        """x with R_u^T x = b."""
        return self._solve(b, transposed=True)

    def _solve(self, b: Array, transposed: bool) -> Array:
        substitute = self.model.solve_transposed if transposed else self.model.solve_linear
        x = substitute(self.A, b)
        if self.R_u is None:
            return x
        R_u = self.R_u.T if transposed else self.R_u
        before, wanted = norm(b), RTOL * norm(b)
        while before > 0.0:
            r = b - self.model.matvec(R_u, x)
            contraction, before = norm(r) / before, norm(r)
            if not contraction < 0.5:
                return self._with_fresh_factors(b, transposed)
            x = x + substitute(self.A, r)
            if SAFETY * contraction * before <= wanted:  # what the correction leaves: no product to look at it
                break
        return x

    def _with_fresh_factors(self, b: Array, transposed: bool) -> Array:
        self.A, self.R_u = self.model.factors_at(self.state), None
        x = self._solve(b, transposed)
        if not np.isfinite(x).all():
            raise NotConverged(f"{self.model.problem.name}: linearized solve is not finite - check p", ())
        return x


def work(forward: ForwardWork, solves: int, transposed: bool, factors: str) -> Work:
    """Declared: a forward solve and `solves` linearized ones; each refinement is a product and a substitution."""
    kind = "transposed_solves" if transposed else "solves"
    if forward.linear or factors == "stale":
        return forward.cold + Work(**{kind: solves})
    if factors == "fresh":
        return forward.cold + forward.factors_at_solution() + Work(**{kind: solves})
    sweeps = forward.sweeps(solves)
    return forward.cold + forward.tangent_operator() + Work(matvecs=sweeps, **{kind: solves + sweeps})
