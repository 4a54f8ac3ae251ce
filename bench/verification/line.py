"""Lines through p along which J is differenced, and the differences on one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

LIKELY = 1e-6  # where truncation and round-off of central differences balance on a well-scaled problem

NO_ROOM = 1e-3  # of a natural change, between p and a bound


@dataclass(frozen=True)
class Line:
    """The line p + t v. v (n_p,) is a natural change: w_i e_i for component i, xi_i w_i for a random direction."""

    name: str
    v: Array
    index: int | None = None


@dataclass(frozen=True)
class Sweep:
    """J on both sides of p for steps h (m,), ascending; NaN where J is not to be had or the step changes nothing.

    J_plus, J_minus (m,) at p +- h v; s_plus, s_minus (m,) the slopes the gradient predicts there,
    g . (p_plus - p) / h and g . (p - p_minus) / h, with the steps as they were rounded.
    """

    line: Line
    J: float
    h: Array
    J_plus: Array
    J_minus: Array
    s_plus: Array
    s_minus: Array

    @property
    def forward(self) -> Array:
        """(J_plus - J) / h, (m,); where no point ahead is to be had, the backward quotient."""
        ahead, behind = (self.J_plus - self.J) / self.h, (self.J - self.J_minus) / self.h
        return ahead if np.isfinite(ahead).any() else behind

    @property
    def central(self) -> Array:
        """(J_plus - J_minus) / 2 h, (m,)."""
        return (self.J_plus - self.J_minus) / (2.0 * self.h)

    @property
    def off_forward(self) -> Array:
        """Signed difference of the one-sided quotient from the gradient's slope."""
        ahead, behind = (self.J_plus - self.J) / self.h - self.s_plus, (self.J - self.J_minus) / self.h - self.s_minus
        return ahead if np.isfinite(ahead).any() else behind

    @property
    def off_central(self) -> Array:
        """The same of the central quotient."""
        return self.central - 0.5 * (self.s_plus + self.s_minus)

    @property
    def jump(self) -> Array:
        """Forward less backward quotient: h v.J''v where J is smooth, a number of its own at a kink."""
        return (self.J_plus - 2.0 * self.J + self.J_minus) / self.h

    @property
    def two_sided(self) -> bool:
        return bool(np.isfinite(self.central).any())

    def joined(self, other: Sweep) -> Sweep:
        """Both, in the order of their steps."""
        order = np.argsort(np.concatenate([self.h, other.h]), kind="stable")
        arrays = [np.concatenate([getattr(self, a), getattr(other, a)])[order] for a in ARRAYS]
        return Sweep(self.line, self.J, *arrays)


ARRAYS = ("h", "J_plus", "J_minus", "s_plus", "s_minus")


def sweep(J: Guarded, J_0: float, subject: Subject, gradient: Array, line: Line, h: Array) -> Sweep:
    """Evaluate J on both sides for every step, as far as the budget goes, the likeliest steps first; sides out of
    bounds are left out."""
    J_side, s_side = np.full((2, len(h)), np.nan), np.full((2, len(h)), np.nan)
    for k in np.argsort(np.abs(np.log10(h / LIKELY)), kind="stable"):
        if J.left() < 2:
            break
        step = h[k]
        for side, sign in enumerate((1.0, -1.0)):
            q = subject.p + sign * step * line.v
            change = q - subject.p
            if change.any() and subject.inside(q):
                J_side[side, k] = J(q)
                s_side[side, k] = sign * float(gradient @ change) / step
    return Sweep(line, J_0, h, *J_side, *s_side)


def components(subject: Subject, indices: Sequence[int]) -> list[Line]:
    """A line along each of these components."""
    probes = []
    for i in indices:
        v = np.zeros_like(subject.p)
        v[i] = subject.natural[i]
        probes.append(Line(subject.label(int(i)), v, int(i)))
    return probes


def directions(subject: Subject, count: int, seed: int) -> list[Line]:
    """Random lines that miss no component: xi_i of either sign and of size 1/2 to 3/2. Never the gradient's own.

    Components on a bound, or next to it, are moved inward by positive steps: one side of the line is then inside.
    """
    rng, n_p = np.random.default_rng(seed), len(subject.p)
    xi = rng.choice([-1.0, 1.0], (count, n_p)) * rng.uniform(0.5, 1.5, (count, n_p))
    no_room = NO_ROOM * subject.natural
    xi = np.where(subject.p - subject.lower < no_room, np.abs(xi), xi)
    xi = np.where(subject.upper - subject.p < no_room, -np.abs(xi), xi)
    return [Line(f"random direction {k + 1}", x * subject.natural) for k, x in enumerate(xi)]


def chosen_components(gradient: Array, natural: Array, count: int) -> list[int]:
    """The largest, the median and the smallest sensitivity, then others between them."""
    order = np.argsort(-np.abs(gradient * natural), kind="stable")
    n, picked = len(order), []
    for place in [0, n // 2, n - 1, *np.linspace(0, n - 1, count + 2).astype(int)[1:-1]]:
        if int(order[place]) not in picked:
            picked.append(int(order[place]))
    return picked[:count]
