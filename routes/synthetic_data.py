"""Synthetic data: the readings of the sensors at the true parameters."""

from __future__ import annotations

from gradient_routes.problems.problem import Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

CONVERGED = Solver(rtol=1e-14)  # so that the only noise in the data is the noise asked for


def with_synthetic_data(problem: Problem, solver: Solver = CONVERGED) -> Problem:
    """The problem with the data of its true parameters, by one forward solve; the problem itself where it has data."""
    twin, truth = problem.twin(), problem.truth()
    return problem if twin is None or truth is None else problem.observed(Model(twin, solver).solve(truth).u)
