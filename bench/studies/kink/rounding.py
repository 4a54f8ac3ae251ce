"""What does it cost to round a kink, or to let the stop yield? Contact laws against exact contact, on the same data.

Where the stop presses, a stiffness k_c leaves an error of 1 / k_c that no width removes; where the bar just meets it,
rounding over a width w costs an error of w and buys a curvature of 1 / w, no longer a kink.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.studies.kink.ray import Gradients, Ray, bisect
from gradient_routes.problems.contact import CompliantStop, Penalty, Quadratic, RigidStop, Softplus
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Problem

WIDTHS = tuple(10.0**-k for k in range(-1, 6))  # times the problem's own
STIFFNESSES = tuple(10.0**k for k in range(-1, 6))
GRADIENTS = 2 * 3 * len(WIDTHS) + 3  # of one trade
LOCAL = 1e-2  # of the width: steps by which the curvature is differenced


@dataclass(frozen=True)
class Traded:
    """A stop at one s against exact contact.

    penetration    u_N - gap [m]
    off_objective  |J - J_exact|, off_slope the same of dJ/ds, at the kink of the nearer of its two
    curvature      d2J/ds2, None where the law has a kink itself
    iterations     Newton steps
    """

    stop: CompliantStop
    s: float
    penetration: float | None = None
    objective: float | None = None
    slope: float | None = None
    off_objective: float | None = None
    off_slope: float | None = None
    curvature: float | None = None
    iterations: int | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Trade:
    """All stops at s = 1 and, if they round the kink that exact contact has there, at s = `event`."""

    ray: Ray
    route: RouteSpec
    rows: tuple[Traded, ...]
    event: float | None = None

    @property
    def at(self) -> list[float]:
        return list(dict.fromkeys(row.s for row in self.rows))


def yielding(problem: Problem) -> CompliantStop | None:
    """The stop that gives way, or None."""
    return problem.stop if isinstance(problem.stop, CompliantStop) else None


def width_of(stop: CompliantStop) -> float | None:
    """[m], None of the penalty, which has none."""
    return stop.law.width if isinstance(stop.law, Softplus | Quadratic) else None


def is_rounded(problem: Problem) -> bool:
    """Whether a stop has a kink that its law rounds over a width."""
    stop = yielding(problem)
    return stop is not None and width_of(stop) is not None


def variants(stop: CompliantStop) -> list[CompliantStop]:
    """Over decades of the width, or of the stiffness of a stop that has none; the problem's own among them."""
    law = stop.law
    if isinstance(law, Penalty):
        return [replace(stop, law=replace(law, k_c=law.k_c * factor)) for factor in STIFFNESSES]
    assert isinstance(law, Softplus | Quadratic)
    return [replace(stop, law=replace(law, width=law.width * factor)) for factor in WIDTHS]


def trade(ray: Ray, stop: CompliantStop, route: RouteSpec, low: float, high: float) -> Trade:
    """Measure all variants of the stop; the kink of exact contact is looked for between the factors low and high.

    Raises what a solve of exact contact at s = 1 raises.
    """
    exact = replace(ray, problem=ray.problem.with_stop(RigidStop(stop.gap)))
    rays = [(one, replace(ray, problem=ray.problem.with_stop(one))) for one in variants(stop)]

    def compared(s: float, sides: Sequence[float]) -> list[Traded]:
        J, gradients = exact.objective(s), Gradients(exact, route)
        slopes = [gradients.slope(side) for side in sides]
        return [against(behind, one, route, s, J, slopes) for one, behind in rays]

    if width_of(stop) is None or exact.active_set(low) == exact.active_set(high):
        return Trade(ray, route, tuple(compared(1.0, [1.0])))
    sides = bisect(exact, low, high)
    event = 0.5 * (sides[0] + sides[1])
    return Trade(ray, route, (*compared(1.0, [1.0]), *compared(event, sides)), event)


def against(ray: Ray, stop: CompliantStop, route: RouteSpec, s: float, J: float, slopes: Sequence[float]) -> Traded:
    """One variant at s against J and dJ/ds of exact contact."""
    gradients, width = Gradients(ray, route), width_of(stop)
    try:
        state, slope = ray.solve(s), gradients.slope(s)
        tip, curvature = ray.tip(state.u) or 0.0, None
        if width is not None:
            h = LOCAL * s * min(1.0, width / abs(tip) if tip else 1.0)  # moves the tip by so much of the width
            curvature = (gradients.slope(s + h) - gradients.slope(s - h)) / (2.0 * h)
    except RoutesError as failure:
        return Traded(stop, s, reason=str(failure))
    return Traded(
        stop,
        s,
        tip - stop.gap,
        float(state.J),
        slope,
        abs(float(state.J) - J),
        min(abs(slope - one) for one in slopes),
        curvature,
        state.work.newton_iterations,
    )
