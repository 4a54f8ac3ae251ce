"""The error that the solves leave in a gradient, estimated without a second, better gradient."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.execution.references import error
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Offers, Reference
from gradient_routes.routes.corrected import error_bar
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.route import Result, Route


def error_estimate(model: Model, state: State | None, route: Route, result: Result) -> float | None:
    """|g - g'|_2 / |g'|_2, g' one Newton step and one adjoint correction from the state of the result.

    state  solved at the same p with the same solver. None for finite differences, whose error is that of their step,
    for problems without partial derivatives, and where the correction cannot be solved for. g' takes R_p, J_u and J_p
    from the problem: what is wrong there does not show.
    """
    if route.accuracy > 0.0 or Offers.LINEARIZE not in model.problem.offers or state is None:
        return None
    u = state.u if result.u is None else np.asarray(result.u)
    try:
        better = error_bar(model, state, u, result.lam)
    except RoutesError:
        return None
    relative, _ = error(np.asarray(result.gradient), Reference("corrected", better.gradient, better.terms))
    return float(relative) if np.isfinite(relative) else None
