"""What becomes of dJ/dp where the active set changes? J over a common factor s on all parameters.

R is smooth in pieces, u(s) continuous across them, hence J too; dJ/ds jumps. On either side every exact route gives the
derivative of its own branch, and a difference quotient over the event gives neither.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from bench.accuracy import Judge, Judges
from bench.bill import prices, unaffordable
from bench.case import RouteSpec
from bench.studies.ray import Gradients, Ray, bisect
from problems.errors import InputError, RoutesError
from problems.problem import Offers, Problem
from routes.model import Model
from routes.route import Route

Side = Literal["left", "right"]
ONE_SIDED = float(np.finfo(np.float64).eps) ** 0.5  # step of one-sided quotients, relative to s
STENCILS = tuple(10.0**-k for k in range(1, 9))  # steps over the event, relative to s
NEAR, NEARBY = 1.05, 24  # from s / NEAR to s NEAR so many more visits, to see the event from near
NOTHING = 1e-13  # of the terms of a slope: its rounding
EXACT = 1e-10  # relative error of a gradient on its branch
CHOICES = (
    "choose a problem that has, bar[stop=penalty] or bar[stop=multiplier] say, or one rounded, bar[stop=softplus] or"
    " bar[stop=quadratic]"
)


@dataclass(frozen=True)
class Visit:
    """J at one s, its branch, the tip of a bar, one-sided quotients in s; `reason` where it cannot be had."""

    s: float
    objective: float | None = None
    active_set: Hashable | None = None
    tip: float | None = None
    forward: float | None = None
    backward: float | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Slope:
    """dJ/ds = g . dp/ds by a route at one s, `side` of the event or None elsewhere.

    size   sum of |g_i dp_i/ds|: what the slope is rounding of, if it is
    error  |g - g_ref| / |g_ref| of the whole gradient g; reference: whose g_ref that is, or why there is none
    """

    route: RouteSpec
    s: float
    side: Side | None
    slope: float | None = None
    size: float = 0.0
    error: float | None = None
    reference: str | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Stencil:
    """(J(s + h s) - J(s - h s)) / 2 h s over the event, and how far it is from dJ/ds on either side."""

    step: float
    quotient: float | None = None
    off_left: float | None = None
    off_right: float | None = None
    reason: str | None = None


@dataclass(frozen=True)
class Event:
    """Where the active set changes: between the visits left and right, 1e-12 apart relative to s.

    slope_left, slope_right  dJ/ds by the problem's closed form, or by the first exact route; None where nobody knows
    size                     of the terms whose sum they are
    judge                    who says so
    """

    left: Visit
    right: Visit
    slope_left: float | None
    slope_right: float | None
    size: float = 0.0
    judge: str | None = None

    @property
    def s(self) -> float:
        return 0.5 * (self.left.s + self.right.s)

    @property
    def jump(self) -> float | None:
        if self.slope_left is None or self.slope_right is None:
            return None
        return self.slope_right - self.slope_left

    @property
    def says(self) -> str:
        where = "" if self.left.tip is None else f" (E = s E_hat), the tip at {self.left.tip:.6g} m"
        sets = f"at s = {self.s:.10g}{where}, {self.left.active_set} becomes {self.right.active_set}"
        if self.slope_left is None or self.slope_right is None:
            return f"{sets}; dJ/ds is not known on both sides"
        left, right, jump = (
            in_words(slope, self.size)
            for slope in (self.slope_left, self.slope_right, self.slope_right - self.slope_left)
        )
        return f"{sets}: dJ/ds = {left} from the left, {right} from the right, a jump of {jump}"


def in_words(slope: float, size: float) -> str:
    """Six digits; 0 where it is the rounding of its terms."""
    return "0" if abs(slope) <= NOTHING * size else f"{slope:.6g}"


@dataclass(frozen=True)
class Kink:
    """Everything measured along a ray.

    events  how many the sweep has seen; `event` is the first of them, None where `reason` says why it cannot be had
    """

    ray: Ray
    visits: tuple[Visit, ...]
    slopes: tuple[Slope, ...]
    skipped: tuple[tuple[RouteSpec, str], ...]
    events: int
    event: Event | None = None
    stencils: tuple[Stencil, ...] = ()
    reason: str | None = None

    @property
    def routes(self) -> list[RouteSpec]:
        """Those that ran."""
        return [s.route for i, s in enumerate(self.slopes) if s.route not in [t.route for t in self.slopes[:i]]]

    def on(self, side: Side) -> list[Slope]:
        return [s for s in self.slopes if s.side == side]

    @property
    def failed(self) -> bool:
        """Whether there is no answer, as forward solves failed."""
        return self.reason is not None or all(v.reason is not None for v in self.visits)

    @property
    def says(self) -> str:
        """The answer in one sentence."""
        solved = [v for v in self.visits if v.reason is None]
        if not solved:
            low, high = self.visits[0].s, self.visits[-1].s
            return f"no s from {low:g} to {high:g} could be solved at: {self.visits[0].reason}"
        low, high = solved[0].s, solved[-1].s
        tips = [v.tip for v in solved if v.tip is not None]
        if self.reason is not None:
            return f"the active set changes, yet where cannot be told: {self.reason}"
        moves = f", its tip at {max(tips):.4g} to {min(tips):.4g} m" if tips else ""
        if self.event is None:
            stays = f"no event: stays {solved[0].active_set} for s from {low:g} to {high:g}{moves}"
            return f"{stays} - widen --range, start elsewhere with --at, or change the problem (the gap of a bar, say)"
        return f"{self.event.says}{_others(self.events)}"


def _others(events: int) -> str:
    return f"; {events - 1} more in this range, narrow --range to see them" if events > 1 else ""


def kink(ray: Ray, routes: Sequence[RouteSpec], s: Sequence[float], budget: float = math.inf) -> Kink:
    """Sweep J and its gradient by every route over the factors s, ascending; find the first event, look at both sides.

    Routes that cannot run, or whose gradients would take more than `budget` seconds, are skipped. Raises InputError
    where the problem has no active set.
    """
    problem = ray.problem
    if Offers.SOLVE not in problem.offers or type(problem).active_set is Problem.active_set:
        raise smooth(problem)
    visits = tuple(visit(ray, float(one)) for one in s)
    solved = [v for v in visits if v.reason is None]
    if any(v.active_set is None for v in solved):
        raise smooth(problem)
    reasons = [(r, why_not(ray, r, solved[0].s if solved else None, len(s) + NEARBY + 2, budget)) for r in routes]
    runnable = [r for r, reason in reasons if reason is None]
    skipped = tuple((r, reason) for r, reason in reasons if reason is not None)
    pairs = [(a.s, b.s) for a, b in pairwise(solved) if a.active_set != b.active_set]
    places: list[tuple[float, Side | None]] = [(v.s, None) for v in solved]
    if not pairs:
        return Kink(ray, visits, tuple(slopes(ray, runnable, places)), skipped, 0)
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
    """Why a route is skipped, in a sentence; None if it runs. Its bill is priced at s, where that is given."""
    objection = spec.route.objection(ray.problem, **spec.options)
    if objection is not None or s is None or budget == math.inf:
        return objection
    try:
        p = ray.p(s)
        options = spec.route.expect(ray.model, p, **(spec.route.defaults | spec.options))
        bill = prices(ray.model, p)[0]
    except RoutesError as failure:
        return str(failure)
    work = spec.route.cost(len(p), bill.declared, **options)
    tape = None if spec.route.tape is None else spec.route.tape(ray.problem, **options)
    reason = unaffordable(gradients * bill.seconds(work), tape, work, budget)
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
