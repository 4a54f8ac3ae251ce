"""J and its gradient asked for again: what gives another answer at the same point cannot be judged.

A gradient that uses the state of the last objective call, that accumulates, races, or changes J is right once.
So J is asked for elsewhere before the gradient is asked for at p, and both are asked for twice.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.verification.guarded import Guarded, Returned, gradient_of
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

REPEATS = 4  # further evaluations at p, where two differ
ROUNDING = 1e-12  # relative change of J(p) that parallel sums make
CLEAR = 10.0  # standard deviations of J by which a change of J(p) is one


@dataclass(frozen=True)
class Repeated:
    """values (m,): J(p), m times; again: the gradient (n_p,) asked for once more, None where the budget did not allow.

    by_gradient, by_calls  |J(p) - J(p)|, the first value and one after the gradient, or J elsewhere, was asked for
    """

    values: Array
    returned: Returned
    again: Array | None = None
    by_gradient: float = 0.0
    by_calls: float = 0.0

    @property
    def J(self) -> float:
        """The first value, or the mean of values that scatter; NaN where there is none."""
        if not self.values.size:
            return float("nan")
        return float(self.values.mean() if self.scatters else self.values[0])

    @property
    def scatters(self) -> bool:
        """Whether values asked for without anything between them differ."""
        return bool((self.values != self.values[:1]).any())

    def moved(self, natural: Array) -> float:
        """|(g - g') w|_2 of the two gradients."""
        return 0.0 if self.again is None else norm2((self.returned.gradient - self.again) * natural)


def once(subject: Subject, J: Guarded) -> Repeated:
    """J(p) and the gradient, each once. Raises Unusable."""
    value = J(subject.p)
    J.account.gradients += 1
    return Repeated(np.array([value])[np.isfinite([value])], gradient_of(subject))


def repeated(subject: Subject, J: Guarded, values: list[float], elsewhere: Array | None) -> Repeated:
    """After J(p), twice, and J elsewhere: J(p), J elsewhere, the gradient, J(p), the gradient. Raises Unusable."""
    before = J(subject.p) if elsewhere is not None else values[0]
    if elsewhere is not None:
        J(elsewhere)
    J.account.gradients += 1
    first = gradient_of(subject)
    if not np.isfinite(values).all():
        return Repeated(np.array([v for v in values if np.isfinite(v)]), first)
    if values[0] != values[1]:
        values += [J(subject.p) for _ in range(REPEATS) if J.left() > 0]
    after = J(subject.p)
    J.account.gradients += 1
    again = gradient_of(subject).gradient
    noise = CLEAR * float(np.std(values)) + ROUNDING * abs(values[0])
    by_calls, by_gradient = (_changed(value, values[0], noise) for value in (before, after))
    if by_calls or by_gradient:
        if J.left() > 1 and J(subject.p) == values[0]:
            by_calls = by_gradient = 0.0  # one value that was another
        return Repeated(np.array(values), first, again, 0.0 if by_calls else by_gradient, by_calls)
    return Repeated(np.array([v for v in (*values, after) if np.isfinite(v)]), first, again)


def _changed(value: float, first: float, noise: float) -> float:
    """|value - first|, 0 within the noise."""
    change = abs(value - first)
    return change if np.isfinite(change) and change > noise else 0.0
