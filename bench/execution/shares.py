"""What a gradient in time owes to the initial state, and what to the rates."""

from __future__ import annotations

from gradient_routes.bench.cases.column import Row
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.route import Result


def shares(problem: Problem, p: Array, result: Result) -> Row:
    """The columns; none where u_0 does not depend on p, or the route has no adjoint state."""
    if not isinstance(problem, Transient) or problem.initial_by(p) is None:
        return {}
    initial = result.initial
    if result.u is not None and result.lam is not None:
        initial = problem.initial_share(p, result.u, result.lam)
    if initial is None:
        return {}
    return {"gradient_initial": initial.tolist(), "gradient_rates": (result.gradient - initial).tolist()}
