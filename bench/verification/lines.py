"""Lines through p along which J is differenced: single components and random directions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

MARGIN = 1e-3  # distance to a bound, in natural changes, below which a line only goes inward


@dataclass(frozen=True)
class Line:
    """The line p + t v. v (n_p,) is a natural change: w_i e_i for component i, xi_i w_i for a random direction."""

    name: str
    v: Array
    index: int | None = None

    @property
    def whole(self) -> bool:
        """Whether the line changes every component."""
        return bool(self.v.all())


def components(subject: Subject, indices: Sequence[int]) -> list[Line]:
    """One line along each of these components."""
    every = np.arange(len(subject.p))
    return [Line(subject.label(int(i)), np.where(every == i, subject.natural, 0.0), int(i)) for i in indices]


def directions(subject: Subject, count: int, seed: int) -> list[Line]:
    """Random lines that change every component: xi_i of random sign and of size 1/2 to 3/2.

    They are independent of the gradient. Components on or near a bound move inward for positive steps, so that one
    side of the line is admissible.
    """
    rng, n_p = np.random.default_rng(seed), len(subject.p)
    xi = rng.choice([-1.0, 1.0], (count, n_p)) * rng.uniform(0.5, 1.5, (count, n_p))
    xi = np.where(inward(subject) > 0.0, np.abs(xi), np.where(inward(subject) < 0.0, -np.abs(xi), xi))
    return [Line(f"random direction {k + 1}", x * subject.natural) for k, x in enumerate(xi)]


def inward(subject: Subject) -> Array:
    """The side (n_p,) to which components on or near a bound move: 1 up, -1 down, 0 either."""
    below, above = subject.p - subject.lower, subject.upper - subject.p
    near = np.minimum(below, above) < MARGIN * subject.natural
    return np.where(near, np.where(below <= above, 1.0, -1.0), 0.0)


def by_sensitivity(gradient: Array, natural: Array, count: int) -> list[int]:
    """The components of largest, median and smallest sensitivity |g_i w_i|, then others between them."""
    order = np.argsort(-np.abs(gradient * natural), kind="stable")
    n = len(order)
    places = [0, n // 2, n - 1, *np.linspace(0, n - 1, count + 2).astype(int)[1:-1]]
    return list(dict.fromkeys(int(order[place]) for place in places))[:count]
