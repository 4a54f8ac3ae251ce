"""A problem as models that others call: the objective J(p), and the observations S u(p)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.sensitivity import Sensitivity


@dataclass(frozen=True)
class Served:
    """F: p (n_p,) -> (m,), w -> (dF/dp)^T w (n_p,), v -> (dF/dp) v (m,). Each raises RoutesError where it fails."""

    m: int
    value: Callable[[Array], Array]
    pullback: Callable[[Array, Array], Array]
    pushforward: Callable[[Array, Array], Array]


def models(problem: Problem, spec: RouteSpec, solver: Solver) -> dict[str, Served]:
    """`objective`, its gradient by the route; `observations`, where the problem has any, by one solve a product.

    Raises InputError where the route cannot run on the problem, RoutesError where it has no state at its start.
    """
    objection = spec.route.objection(problem, **spec.options)
    if objection is not None:
        raise InputError(f"serve: {objection} - choose another route or problem")
    model, start = Model(problem, solver), problem.parameters.start
    found = {"objective": _objective(model, spec)}
    if Offers.LINEARIZE | Offers.OBSERVATION in problem.offers:
        state = model.solve(start)
        seen = problem.observation(state.u, state.p)
        if seen is not None and len(seen.data):
            found["observations"] = _observations(model, state, len(seen.data))
    return found


def _objective(model: Model, spec: RouteSpec) -> Served:
    def gradient(p: Array) -> Array:
        return spec.route.prepare(model, p, **spec.options)(p).gradient

    return Served(
        1,
        lambda p: np.array([model.value(p)]),
        lambda p, w: w[0] * gradient(p),
        lambda p, v: np.array([gradient(p) @ v]),
    )


def _observations(model: Model, state: State, m: int) -> Served:
    """S u, without the weights of the misfit; the last state is kept for the products that follow."""
    last = [state]

    def at(p: Array) -> State:
        if not np.array_equal(last[0].p, p):
            last[0] = model.solve(p)
        return last[0]

    def H(p: Array) -> tuple[Sensitivity, float]:
        found = Sensitivity(model, at(p))
        return found, found.seen.weight

    def value(p: Array) -> Array:
        u = at(p).u
        seen = model.problem.observation(u, p)
        assert seen is not None
        return np.asarray(seen.predicted / seen.weight)

    def pullback(p: Array, w: Array) -> Array:
        of, weight = H(p)
        return np.asarray(of.T @ (w / weight))

    def pushforward(p: Array, v: Array) -> Array:
        of, weight = H(p)
        return np.asarray((of @ v) / weight)

    return Served(m, value, pullback, pushforward)
