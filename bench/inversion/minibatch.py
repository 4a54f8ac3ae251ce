"""Gradients of a few load cases at a time, for optimizers without a line search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.invert import Engine
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.optimizers import Limits, adam, defined
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem


def minibatched(problem: Problem, route: RouteSpec, engine: Engine, count: int, seed: int) -> Callable[..., str]:
    """Adam on `count` load cases drawn anew for every step: an unbiased gradient of the misfit, and Phi whole.

    Raises InputError for a problem with fewer load cases.
    """
    cases = problem.load_cases()
    if len(cases) < 2 or count > len(cases):
        raise InputError(
            f"--minibatch {count}: {problem.name} has {len(cases) or 'no'} load cases - choose fewer of several, cases="
        )
    rng = np.random.default_rng(seed)

    def run(objective: Objective, history: History, limits: Limits) -> str:
        parts = [Objective(case, route.route, route.options, engine.solver, objective.variables) for case in cases]
        for part in parts:
            part.model.tally = objective.model.tally  # all work is counted together
            part.start(objective.accepted.p)

        def batch(x: Array) -> Array:
            """(C / K) sum of the misfits of K of the C cases, and alpha Phi once."""
            prior = objective.problem.prior(objective.variables.p(x))
            by_prior = np.zeros_like(x)
            if prior is not None:
                Phi, theta, by_p = prior
                by_prior = Phi.gradient(theta) * by_p * objective.variables.slope(x)
            drawn = rng.choice(len(parts), count, replace=False)
            by_cases = [defined(parts[k].accept(x)).by_x - by_prior for k in drawn]
            return np.asarray(len(parts) / count * np.sum(by_cases, axis=0) + by_prior)

        return adam(objective, history, limits, batch, every=-(-len(parts) // count))  # once an epoch

    return run
