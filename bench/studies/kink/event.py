"""What is found at a kink: visits along the ray, slopes on both sides of the event, stencils over it; the answer."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Literal

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.studies.kink.ray import Ray
from gradient_routes.problems.transient import ActiveSteps

Side = Literal["left", "right"]
NOTHING = 1e-13  # of the terms of a slope: its rounding
EXACT = 1e-10  # relative error of a gradient on its branch
NEAR = 1.05  # a factor on s that stays near the event


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
        sets = f"at s = {self.s:.10g}{where}, {self._change}"
        if self.slope_left is None or self.slope_right is None:
            return f"{sets}; dJ/ds is not known on both sides"
        left, right, jump = (
            in_words(slope, self.size)
            for slope in (self.slope_left, self.slope_right, self.slope_right - self.slope_left)
        )
        return f"{sets}: dJ/ds = {left} from the left, {right} from the right, a jump of {jump}"

    @property
    def _change(self) -> str:
        left, right = self.left.active_set, self.right.active_set
        if not (isinstance(left, ActiveSteps) and isinstance(right, ActiveSteps)):
            return f"{left} becomes {right}"
        flipped = left.flips(right)
        first = flipped[0]
        steps = f"step {first}" if len(flipped) == 1 else f"{len(flipped)} steps of {len(left)}, {first} first,"
        return f"the active set of {steps} flips from {left[first - 1]} to {right[first - 1]}"


def in_words(slope: float, size: float) -> str:
    """Six digits; 0 where it is the rounding of its terms."""
    return "0" if abs(slope) <= NOTHING * size else f"{slope:.6g}"


@dataclass(frozen=True)
class Kink:
    """Everything measured along a ray.

    events   how many the sweep has seen; `event` is the first of them, None where `reason` says why it cannot be had
    rounded  there can be none, the law of the stop being smooth
    """

    ray: Ray
    visits: tuple[Visit, ...]
    slopes: tuple[Slope, ...]
    skipped: tuple[tuple[RouteSpec, str], ...]
    events: int
    event: Event | None = None
    stencils: tuple[Stencil, ...] = ()
    reason: str | None = None
    rounded: bool = False

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
        if self.rounded:
            smooth = (
                f"the law of the stop is rounded over a width, and dJ/ds does not jump for s from {low:g} to {high:g}"
            )
            return f"no event: {smooth}{moves}"
        if self.event is None:
            stays = f"no event: stays {solved[0].active_set} for s from {low:g} to {high:g}{moves}"
            return f"{stays} - widen --range, start elsewhere with --at, or change the problem (the gap of a bar, say)"
        return f"{self.event.says}{_others(self.events)}"


def _others(events: int) -> str:
    return f"; {events - 1} more in this range, narrow --range to see them" if events > 1 else ""
