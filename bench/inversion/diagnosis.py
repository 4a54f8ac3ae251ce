"""Why a line search returned without a step: J is at its minimum, or noise hides its slope, or J has a kink or an edge
there, or the gradient is not that of J.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.slopes import EPS, ROUNDED, Slopes, descent, examined

AT_MINIMUM = "converged to rounding: J cannot be told apart from its minimum"
MISLED = "gradient is not that of J"
LOOSE = 1e-6  # tolerance of a forward solve above which it may disturb J


def explained(objective: Objective) -> str:
    """Why the line search returned without a step, in a sentence."""
    tried: Sequence[str | None] = [each.outside for each in objective.tried]
    if tried and all(tried):
        return f"every step leaves the domain of J: {tried[-1]}"
    last = objective.accepted
    seen = examined(objective, last, descent(last))
    found, J = seen.slopes, last.J
    if found.edge is not None:
        return f"J is not defined beside this point: {found.edge}"
    if found.kink:
        return f"J has a kink here, with slopes {found.left:.4g} and {found.right:.4g} on its sides; see routes vcurve"
    if seen.blame == "gradient":
        return misled("at the last step its slope along the steepest descent", found)
    if seen.blame == "solves":
        rtol = objective.model.solver.rtol
        return f"the forward solves are too loose for the slope of J (--rtol {rtol:g}) - tighten them"
    if found.disagree and objective.route.accuracy > 0.0:
        return (
            f"the error of {objective.route.name} hides the slope of J ({found.promised:.4g} by the gradient,"
            f" {found.found:.4g} by differences of J) - use a more accurate route"
        )
    rounding = ROUNDED * EPS * abs(J)
    if found.to_gain <= rounding:
        return AT_MINIMUM
    if found.noise > rounding and found.hidden:
        return f"noise of J, about {found.noise:.2g}, hides a slope of {-found.promised:.2g}{_if_loose(objective)}"
    if found.hidden or J == 0.0 or abs(found.promised) < math.sqrt(EPS) * objective.slope_scale:
        return AT_MINIMUM
    return f"no step was found, though J falls by {-found.promised:.2g} as the gradient says - use another optimizer"


def misled(where: str, found: Slopes) -> str:
    return f"{MISLED}: {where} is {found.promised:.4g}, by differences of J {found.found:.4g}"


def _if_loose(objective: Objective) -> str:
    solver, problem = objective.model.solver, objective.problem
    iterates = not problem.linear or solver.linear.iterates
    if solver.rtol <= LOOSE or not iterates:
        return ""
    return f"; the forward solves are loose (--rtol {solver.rtol:g}): tighten them first"
