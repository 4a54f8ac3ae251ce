"""What would change the answer: of every number the nearest value at which another route is best, of a yes the no."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Literal

from gradient_routes.bench.advice.answers import LARGEST, Answers
from gradient_routes.bench.advice.bill import Bill
from gradient_routes.problems.problem import Offers

Best = Callable[[Answers], Bill | None]
Other = Callable[[float], Bill | None]
Bound = Literal["at most", "at least", "with", "without"]
GROWTH = 8.0  # from one value that is tried to the next
CLOSE = 1.01  # of the ends of an interval that holds a threshold, for numbers that are not whole


@dataclass(frozen=True)
class Scale:
    """The range of a numeric answer; at_hand: it may differ from that of a problem that is measured."""

    least: float
    most: float
    whole: bool = False
    at_hand: bool = True

    def outward(self, value: float, growth: float) -> Iterator[tuple[float, float]]:
        """Neighbouring values on the way from a value to the end of the range."""
        near = min(max(value, self.least), self.most)
        while True:
            far = min(max(near * growth, self.least), self.most)
            if self.whole:
                far = math.floor(far) if growth < 1 else math.ceil(far)
            if far == near:
                return
            yield near, far
            near = far


SCALES = {
    "n_p": Scale(1, LARGEST, whole=True),
    "outputs": Scale(1, LARGEST, whole=True),
    "newton": Scale(1, 100, whole=True, at_hand=False),
    "steps": Scale(1, LARGEST, whole=True, at_hand=False),
    "rtol": Scale(1e-16, 0.1),
    "error": Scale(1e-16, 0.1),
    "memory": Scale(1e3, 1e18),
    "gradients": Scale(1, LARGEST, whole=True),
    "budget": Scale(1e-6, 1e12),
}
CAPABILITIES = {
    Offers.SOLVE: Offers.STATE | Offers.PARTIALS | Offers.TRACE | Offers.COMPLEX,
    Offers.LINEARIZE: Offers.PARTIALS,
    Offers.TRACE: Offers.TRACE,
    Offers.COMPLEX: Offers.COMPLEX,
}  # what cannot be had without it


@dataclass(frozen=True)
class Change:
    """Another route is best where `answer`, an attribute of Answers, is at most or at least `value`; with or without
    the value, where it is one of Offers; where it is the value, for a yes or no (bound: with).
    """

    answer: str
    bound: Bound
    value: Any
    best: Bill


def changes(answers: Answers, best: Best) -> list[Change]:
    """Of every answer the nearest in each direction. Where no route is possible, what would make one possible."""
    now = best(answers)
    kind = None if now is None else now.kind

    def other(**changed: Any) -> Bill | None:
        found = best(replace(answers, **changed))
        return None if found is None or found.kind == kind else found

    found: list[Change] = []
    for name, scale in SCALES.items():
        value = getattr(answers, name)
        if value >= scale.least and (scale.at_hand or answers.measured is None):
            found += _of_number(name, scale, value, other)
    return [*found, *_of_offers(answers.offers, other), *_of_words(answers, other)]


def _of_number(name: str, scale: Scale, value: float, other: Callable[..., Bill | None]) -> Iterator[Change]:
    def at(x: float) -> Bill | None:
        return other(**{name: int(x) if scale.whole else x})

    bounds: dict[Bound, float] = {"at most": 1.0 / GROWTH, "at least": GROWTH}
    for bound, growth in bounds.items():
        for near, far in scale.outward(value, growth):
            if at(far) is not None:
                threshold = _between(near, far, scale.whole, at)
                best = at(threshold)
                assert best is not None
                yield Change(name, bound, int(threshold) if scale.whole else threshold, best)
                break


def _between(near: float, far: float, whole: bool, other: Other) -> float:
    """The threshold, by bisection: the nearest whole number, or a number of two digits beyond it."""
    while abs(far - near) > 1 if whole else max(near, far) > CLOSE * min(near, far):
        middle = (near + far) // 2 if whole else math.sqrt(near * far)
        near, far = (near, middle) if other(middle) else (middle, far)
    if whole:
        return far
    digit = 10.0 ** (math.floor(math.log10(far)) - 1)
    rounded = float(f"{(math.floor if far < near else math.ceil)(far / digit) * digit:.1e}")
    return rounded if other(rounded) else far


def _of_offers(offers: Offers, other: Callable[..., Bill | None]) -> Iterator[Change]:
    gained: set[str] = set()  # by less than what comes after it in the list
    for capability, lost in CAPABILITIES.items():
        bound: Bound = "without" if capability in offers else "with"
        changed = offers & ~lost if capability in offers else offers | Offers.SOLVE | capability
        best = other(offers=changed)
        if best is not None and best.kind not in gained:
            yield Change("offers", bound, capability, best)
        if best is not None and bound == "with":
            gained.add(best.kind)


def _of_words(answers: Answers, other: Callable[..., Bill | None]) -> Iterator[Change]:
    for name in ("smooth", "iterate"):
        value = not getattr(answers, name)
        if best := other(**{name: value}):
            yield Change(name, "with", value, best)
