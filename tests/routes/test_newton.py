"""Newton's method where full steps do not help."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Offers, Parameters, Problem
from gradient_routes.routes.model import Model

CYCLE = 1.3917452002707  # 2 u = (1 + u^2) arctan u: full steps for arctan u = 0 go from u to -u and back


class Arctan(Problem):
    """arctan u = 0 from the start p."""

    name = "arctan"
    offers = Offers.SOLVE
    n_state = 1
    parameters = Parameters(start=np.array([CYCLE]), scale=np.ones(1))

    def initial(self, p):
        return p.copy()

    def residual(self, u, p):
        return np.arctan(u)

    def tangent(self, u, p):
        return np.diag(1.0 / (1.0 + u**2))

    def objective(self, u, p):
        return u[0]


def test_a_step_that_leaves_the_residual_as_it_is_is_halved() -> None:
    """Taken, it would come back, for dozens of steps."""
    problem = Arctan()
    for p in (CYCLE - 1e-9, CYCLE, CYCLE + 1e-9):
        state = Model(problem).solve(np.array([p]))
        assert abs(state.u[0]) < 1e-12
        assert len(state.history) <= 7
        assert all(b <= a for a, b in zip(state.history, state.history[1:], strict=False))
