"""What studies of wrong gradients judge by: J and dJ/dp solved for directly at a tight tolerance."""

from __future__ import annotations

from typing import Any

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.case_context import CaseContext
from gradient_routes.bench.execution.error_estimate import error_estimate
from gradient_routes.bench.execution.references import Judge
from gradient_routes.problems.errors import RoutesError
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.route import Result, Route

TIGHT = Solver(rtol=1e-13, adjoint_rtol=1e-13)


class Bench(CaseContext):
    """A problem at one p, its references and prices those of direct solves. Raises InputError, DomainError."""

    def __init__(self, problem: ProblemSpec, at: str, budget: float) -> None:
        super().__init__(problem, Settings(at=at, budget=budget, solver=TIGHT))
        self.J = self.objective()

    def errors(
        self, route: Route, result: Result, model: Model | None = None, state: State | None = None
    ) -> dict[str, Any]:
        """The columns of J and of the error of the gradient, which is estimated by a model and a state solved with it,
        those of this bench where none is given. Raises RoutesError for no gradient.
        """
        g, J = np.asarray(result.gradient), result.J
        if g.shape != self.p.shape or not np.isfinite(g).all():
            raise RoutesError(
                f"{route.name}: no finite gradient of {self.p.size} components - mend the route or check p"
            )
        judge = self.judges.judge(route)
        error, reference = judge.error(g) if isinstance(judge, Judge) else (None, None)
        return {
            "objective": J,
            "objective_error": None if J is None or self.J == 0.0 else abs(J - self.J) / abs(self.J),
            "gradient_error": error,
            "reference": reference,
            "gradient_error_estimate": error_estimate(model or self.model(), state or self.price()[1], route, result),
        }


def said(failure: Exception) -> str:
    """One line; of what should not have been raised, its type, too."""
    line = " ".join(str(failure).split())
    return line if isinstance(failure, RoutesError) else f"{type(failure).__name__}: {line}"
