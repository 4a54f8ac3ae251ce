"""What becomes of dJ/dp where the active set changes? J over a common factor s on all parameters.

R is smooth in pieces, u(s) continuous across them, hence J too; dJ/ds jumps. On either side every exact route gives the
derivative of its own branch, and a difference quotient over the event gives neither.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.cases.study import Found, Kept, Note, Say
from gradient_routes.bench.execution.cost_model import prices, unaffordable
from gradient_routes.bench.execution.references import Judge, Judges
from gradient_routes.bench.studies.kink.event import NEAR, Event, Kink, Side, Slope, Stencil, Visit
from gradient_routes.bench.studies.kink.ray import Gradients, Ray, bisect
from gradient_routes.bench.studies.kink.rounding import GRADIENTS, Trade, is_rounded, trade, yielding
from gradient_routes.bench.studies.kink.rows import rows
from gradient_routes.bench.studies.options import problem_at, routes_of
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route

ONE_SIDED = float(np.finfo(np.float64).eps) ** 0.5  # step of one-sided quotients, relative to s
STENCILS = tuple(10.0**-k for k in range(1, 8))  # steps over the event, relative to s: it is known to 1e-12
NEARBY = 24  # visits from s / NEAR to s NEAR, to see the event from near
CHOICES = (
    "choose a problem that has, bar[stop=penalty] or bar[stop=multiplier] say, or one rounded, bar[stop=softplus] or"
    " bar[stop=quadratic]"
)


def run(
    say: Say,
    *,
    selector: str,
    routes: Sequence[str],
    at: str,
    s_range: tuple[float, float],
    points: int,
    budget: float,
    solver: Solver,
    kept: Path | None = None,
) -> int:
    low, high = s_range
    if not 0 < low < high < math.inf:
        raise InputError(f"--range {low:g} {high:g} - give two factors, 0 < least < largest")
    specs = routes_of(routes or ["all"], say)
    ray = Ray(*problem_at(selector, at), solver)
    failure = traded = None
    with np.errstate(all="ignore"):
        swept = kink(ray, specs, np.geomspace(low, high, points).tolist(), budget)
        try:
            traded = _traded(swept, specs if routes else case.routes(["adjoint"]), budget)
        except RoutesError as unsolved:
            failure = unsolved
    for row in rows(swept, traded, {"problem": selector, "at": at}):
        say(Kept("kink", row))
    say(Found((selector, swept, traded)))
    if swept.rounded and not swept.failed and traded is None and failure is None:
        say(Note("kink: the cost of the width is left out: no route runs for it - name another with --route"))
    if failure is not None:
        say(Note(f"kink: the cost of the contact law is not known: {failure}"))
    return 1 if swept.failed or failure is not None else 0


def _traded(swept: Kink, specs: list[RouteSpec], budget: float) -> Trade | None:
    """What a stop that yields costs, by the first of the routes that runs, an exact one before others.

    None where there is no such stop or route, or nothing to compare. Raises what the solve of exact contact raises.
    """
    ray, stop = swept.ray, yielding(swept.ray.problem)
    if stop is None or swept.failed or (swept.event is None and not swept.rounded):
        return None
    for spec in sorted(specs, key=lambda spec: spec.route.accuracy > 0.0):
        if why_not(ray, spec, 1.0, GRADIENTS, budget) is None:
            return trade(ray, stop, spec, swept.visits[0].s, swept.visits[-1].s)
    return None


def kink(ray: Ray, routes: Sequence[RouteSpec], s: Sequence[float], budget: float = math.inf) -> Kink:
    """Sweep J and its gradient by every route over the factors s, ascending; find the first event, look at both sides.

    Where the law of a stop is rounded there is none: the sweep is all. Routes that cannot run, or whose gradients would
    take more than `budget` seconds, are skipped. Raises InputError where the problem has no active set.
    """
    problem = ray.problem
    if Offers.SOLVE | Offers.ACTIVE_SET not in problem.offers:
        raise smooth(problem)
    visits = tuple(visit(ray, float(one)) for one in s)
    solved = [v for v in visits if v.reason is None]
    rounded = is_rounded(problem)
    if any(v.active_set is None for v in solved) and not rounded:
        raise smooth(problem)
    gradients = len(s) + (0 if rounded else NEARBY + 2)
    reasons = [(r, why_not(ray, r, solved[0].s if solved else None, gradients, budget)) for r in routes]
    runnable = [r for r, reason in reasons if reason is None]
    skipped = tuple((r, reason) for r, reason in reasons if reason is not None)
    pairs = [(a.s, b.s) for a, b in pairwise(solved) if a.active_set != b.active_set]
    places: list[tuple[float, Side | None]] = [(v.s, None) for v in solved]
    if not pairs:
        return Kink(ray, visits, tuple(slopes(ray, runnable, places)), skipped, 0, rounded=rounded)
    try:
        left, right = (visit(ray, one) for one in bisect(ray, *pairs[0]))
        why = left.reason or right.reason
    except RoutesError as failure:
        why = str(failure)
    if why is not None:
        return Kink(ray, visits, tuple(slopes(ray, runnable, places)), skipped, len(pairs), reason=why)
    nearby = [visit(ray, left.s * NEAR ** float(t)) for t in np.linspace(-1.0, 1.0, NEARBY)]
    places += [(v.s, None) for v in nearby if v.reason is None]
    found = tuple(slopes(ray, runnable, [*places, (left.s, "left"), (right.s, "right")]))
    event = between(ray, left, right, found)
    stencils = tuple(stencil(ray, event, h) for h in STENCILS)
    visits = tuple(sorted([*visits, *nearby], key=lambda v: v.s))
    return Kink(ray, visits, found, skipped, len(pairs), event, stencils)


def smooth(problem: Problem) -> InputError:
    return InputError(f"kink: {problem.name} has no active set that could change: its R is smooth - {CHOICES}")


def visit(ray: Ray, s: float) -> Visit:
    """J(s) and its neighbours, each solved for from scratch."""
    try:
        state, h = ray.solve(s), ONE_SIDED * s
        ahead, behind = ray.objective(s + h), ray.objective(s - h)
        forward, backward = (ahead - state.J) / (s + h - s), (state.J - behind) / (s - (s - h))
        branch = ray.problem.active_set(state.u, state.p)
        return Visit(s, float(state.J), branch, ray.tip(state.u), float(forward), float(backward))
    except RoutesError as failure:
        return Visit(s, reason=str(failure))


def why_not(ray: Ray, spec: RouteSpec, s: float | None, gradients: int, budget: float) -> str | None:
    """Why a route is skipped, in a sentence; None if it runs. Its bill is priced at s, where that is given.

    Raises what a solve there raises.
    """
    objection = spec.route.objection(ray.problem, **spec.options)
    if objection is not None or s is None or budget == math.inf:
        return objection
    p = ray.p(s)
    options = spec.route.expect(ray.model, p, **(spec.route.defaults | spec.options))
    bill = prices(ray.model, p)[0]
    work = spec.route.cost(len(p), bill.declared, **options)
    tape = None if spec.route.tape is None else spec.route.tape(ray.problem, **options)
    reason = unaffordable(bill, tape, work, budget, gradients)
    return None if reason is None else f"{gradients} gradients: {reason}"


def slopes(ray: Ray, routes: Sequence[RouteSpec], places: Sequence[tuple[float, Side | None]]) -> Iterator[Slope]:
    """dJ/ds by every route at every place."""
    gradients = [Gradients(ray, spec) for spec in routes]
    for s, side in places:
        judges = Judges(Model(ray.problem, ray.solver), ray.p(s), lambda route, n: None)
        for gradient in gradients:
            yield slope(gradient, s, side, judges.judge)


def slope(gradient: Gradients, s: float, side: Side | None, judge: Callable[[Route], Judge | str]) -> Slope:
    """dJ/ds by one route, and how wrong its gradient is; what it raises becomes the reason."""
    spec, by_s = gradient.route, gradient.ray.by_s(s)
    try:
        g, found = gradient(s), judge(spec.route)
        error, reference = found.error(g) if isinstance(found, Judge) else (None, found)
        return Slope(spec, s, side, float(g @ by_s), float(abs(g) @ abs(by_s)), error, reference)
    except RoutesError as failure:
        return Slope(spec, s, side, reason=str(failure))
    except Exception as failure:  # the code of a plug-in may raise anything
        return Slope(spec, s, side, reason=f"{type(failure).__name__}: {' '.join(str(failure).split())}")


def between(ray: Ray, left: Visit, right: Visit, found: Sequence[Slope]) -> Event:
    """The event between two visits, with dJ/ds on both sides by the one who knows best."""
    known = [ray.problem.reference(ray.p(v.s)) for v in (left, right)]
    terms = [r.gradient * ray.by_s(v.s) for r, v in zip(known, (left, right), strict=True) if r is not None]
    if known[0] is not None and len(terms) == 2:
        a, b = (float(t.sum()) for t in terms)
        return Event(left, right, a, b, max(float(abs(t).sum()) for t in terms), known[0].name)
    for one in (s for s in found if s.side == "left" and s.route.route.accuracy == 0.0):
        other = next(s for s in found if s.side == "right" and s.route == one.route)
        if one.slope is not None and other.slope is not None:
            return Event(left, right, one.slope, other.slope, max(one.size, other.size), one.route.route.name)
    return Event(left, right, None, None)


def stencil(ray: Ray, event: Event, step: float) -> Stencil:
    """The central quotient over the event."""
    h = step * event.s
    try:
        q = (ray.objective(event.s + h) - ray.objective(event.s - h)) / (2.0 * h)
    except RoutesError as failure:
        return Stencil(step, reason=str(failure))
    left, right = (None if one is None else abs(q - one) for one in (event.slope_left, event.slope_right))
    return Stencil(step, q, left, right)
