"""The error that the solves leave in a gradient, estimated without a second, better gradient."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.execution.references import CANCELLED, error, norm2
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Offers, Reference
from gradient_routes.routes.corrected import Corrected, adjoint_at, error_bar
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.route import Result, Route


def error_estimate(model: Model, state: State | None, route: Route, result: Result) -> float | None:
    """|g - g'|_2 / |g'|_2, g' one Newton step and one adjoint correction from the state of the result.

    state  solved at the same p with the same solver. None for finite differences, whose error is that of their step,
    for problems without partial derivatives, and where the correction cannot be solved for. g' takes R_p, J_u and J_p
    from the problem: what is wrong there does not show.
    """
    better = _corrected(model, state, route, result)
    if better is None:
        return None
    relative, _ = error(np.asarray(result.gradient), Reference("corrected", better.gradient, better.terms))
    return float(relative) if np.isfinite(relative) else None


def beyond_rounding(model: Model, state: State | None, route: Route, result: Result) -> bool:
    """Whether g is further from g' than an adjoint gradient moves where the rounding of u does: g is wrong then.

    Near a minimum g is made of the rounding of u alone, and as far from g' as from anything else.
    """
    better = _corrected(model, state, route, result)
    if better is None or state is None:
        return False
    try:
        moved, _ = adjoint_at(model, state, better.v * (1.0 + CANCELLED * np.finfo(np.float64).eps))
    except RoutesError:
        return False
    return norm2(np.asarray(result.gradient) - better.gradient) > norm2(moved - better.gradient)


def _corrected(model: Model, state: State | None, route: Route, result: Result) -> Corrected | None:
    if route.accuracy > 0.0 or Offers.LINEARIZE not in model.problem.offers or state is None:
        return None
    try:
        return error_bar(model, state, state.u if result.u is None else np.asarray(result.u), result.lam)
    except RoutesError:
        return None
