"""Synthetic data: what the sensors would read if the truth were so."""

from __future__ import annotations

from gradient_routes.problems.problem import Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

CONVERGED = Solver(rtol=1e-14)  # data should carry the noise they are given, and no other


def with_synthetic_data(problem: Problem, solver: Solver = CONVERGED) -> Problem:
    """The problem with data solved for at its true parameters; itself where it has data. One forward solve."""
    twin, truth = problem.twin(), problem.truth()
    return problem if twin is None or truth is None else problem.observed(Model(twin, solver).solve(truth).u)
