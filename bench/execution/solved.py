"""Whether the gradient of a route belongs to a solved state and a solved adjoint, measured at what it returns."""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np

from gradient_routes.bench.execution.case_context import CaseContext
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import ROUNDING, State, norm
from gradient_routes.routes.route import Result, Route

APART = 10.0  # Newton corrections: two states further apart are not approximations of one
LOOSE = 1e-5  # of |u|: more than default tolerances of other codes leave in their states
SAME = 1e-8  # of |u|: nearer than that they are, whatever the corrections say


def unsolved(context: CaseContext, route: Route, result: Result) -> str | None:
    """Why the state of a result does not solve R(u, p) = 0 as the forward solve does, with figures; None if it does.

    Law: |R(u, p)| <= rtol |R(u_0, p)|, or R is rounding there (Model.tolerance); and u is the forward solve's. Routes
    that return no state solve for theirs by Model.solve, which raises NotConverged. A residual or two, not counted.
    """
    state = context.price()[1]
    if state is None or result.u is None or np.shape(result.u) != state.u.shape:
        return None
    model, u = context.model(), np.asarray(result.u)
    residual, wanted = model.relative_residual(u, context.p), model.tolerance(u, state)
    if not residual <= wanted:
        return (
            f"{route.name}: |R| / |R_0| = {residual:.2g} at the state of this gradient, wanted {wanted:.2g}"
            " - iterate further, or take implicit-ad or adjoint"
        )
    return None if np.array_equal(u, state.u) else _elsewhere(model, route, u, state)


def other_functional(context: CaseContext, route: Route, result: Result) -> str | None:
    """That the J of another code is not ours, with both; None where it is, up to what a loose solve leaves in it.

    A state off by delta |u| changes J = 1/2 |r|^2 by |r| delta |u| + delta^2 |u|^2 / 2, of which the terms tell |u|.
    """
    if result.peer is None or result.J is None:
        return None
    ours, terms = context.objective(), context.judges.terms
    delta = max(LOOSE, APART * context.settings.solver.rtol)
    if abs(result.J - ours) <= 2.0 * delta * math.sqrt(abs(ours) * terms) + delta**2 * terms:
        return None
    return f"{route.name}: its J is {result.J:.9g}, ours {ours:.9g} - compare the signs of its loads first"


def rounding(context: CaseContext, result: Result) -> str | None:
    """That R is rounding at the state of a result where that is above rtol; None where |R| <= rtol |R_0|."""
    rtol = context.settings.solver.rtol
    if result.residual is None or not result.residual > rtol:
        return None
    return f"|R| / |R_0| = {result.residual:.2g} is rounding of R, rtol {rtol:g} is out of reach"


def adjoint(context: CaseContext, result: Result) -> tuple[float | None, str | None]:
    """|R_u^T lam + J_u| / |J_u| where a route returns lam, and a note where it exceeds adjoint_rtol and rounding."""
    state = context.price()[1]
    if state is None or result.lam is None or result.u is None:
        return None, None
    model, lam = context.model(), np.asarray(result.lam)
    left, J_u = model.adjoint_residual(np.asarray(result.u), lam, context.p)
    rtol, found = model.solver.adjoint_rtol, left / (J_u or 1.0)
    if left <= max(rtol * J_u, ROUNDING * state.factors.norm * norm(lam)):
        return found, None
    return found, f"|R_u^T lam + J_u| / |J_u| = {found:.2g}, wanted {rtol:g}: the adjoint is not solved"


def _elsewhere(model: Model, route: Route, u: Array, state: State) -> str | None:
    """That u is another solution than the forward solve's."""
    off, size = norm(u - state.u), norm(state.u)
    with suppress(RoutesError):  # of a linear solver that iterates
        both = (model.problem.residual(at, state.p) for at in (u, state.u))
        near = APART * sum(norm(state.factors.solve(R)) for R in both)
        if off > SAME * size + near:
            return (
                f"{route.name}: its state is off that of the forward solve by {off / (size or 1.0):.2g} |u|, Newton"
                f" corrections explain {near / (size or 1.0):.2g} - take implicit-ad or adjoint"
            )
    return None
