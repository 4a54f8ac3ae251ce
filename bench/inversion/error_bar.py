"""Where the error that the solves leave in dJ/dp hides what is left of it, no step along it means anything."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.objective import Evaluation, Objective
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.corrected import adjoint_at, error_bar
from gradient_routes.routes.model import Model

NEAR = 100.0  # times its last known error, beyond which a gradient is not tested: errors change little between steps


class ErrorBar:
    """The estimated error of dJ/dx, `known` at the last step where it was asked for: no forward solve is made."""

    def __init__(self, objective: Objective) -> None:
        problem, route = objective.problem, objective.route
        self.objective, self.known = objective, 0.0
        self.able = route.accuracy == 0.0 and Offers.LINEARIZE in problem.offers
        self.asked = False

    def hides(self, found: Evaluation) -> bool:
        """Whether |dJ/dx| is less than its own error; never where that cannot be estimated: without a state."""
        size = norm2(found.by_x)
        if not self.able or found.u is None or size == 0.0 or (self.asked and size > NEAR * self.known):
            return False
        self.asked, self.known = True, self._error(found)
        return size < self.known

    @property
    def says(self) -> str:
        left = self.known / self.objective.slope_0
        rtol = self.objective.model.solver.rtol
        return (
            f"stopped: dJ/dp is less than the error that the solves leave in it, about {left:.1e} of that at the start"
            f" (--rtol {rtol:g}) - tighten them"
        )

    def _error(self, found: Evaluation) -> float:
        objective = self.objective
        model = Model(objective.problem, objective.model.solver)
        try:
            u = np.asarray(found.u)
            state = model.state_at(u, found.p)
            gradient, lam = adjoint_at(model, state, u)  # a mistake of the route is no error of its solves
            better = error_bar(model, state, u, lam)
        except OUTSIDE:
            return 0.0
        return norm2((gradient - better.gradient) * objective.variables.slope(found.x))
