"""Difference quotients of J along a line, over many steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.lines import Line
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array

LIKELY = 1e-6  # step at which truncation and round-off of central differences balance on a well-scaled problem
SAMPLED = ("h", "J_plus", "J_minus", "s_plus", "s_minus")


@dataclass(frozen=True)
class Quotients:
    """J at p +- h v for ascending steps h (m,).

    J_plus, J_minus  (m,) values of J; NaN where J has none or the step is lost to rounding
    s_plus, s_minus  (m,) slopes g . (p_plus - p) / h and g . (p - p_minus) / h, with the steps as rounded
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
        """(J_plus - J) / h, (m,); the backward quotient where no point ahead has a value."""
        return self._one_sided(0.0, 0.0)

    @property
    def central(self) -> Array:
        """(J_plus - J_minus) / 2 h, (m,)."""
        return (self.J_plus - self.J_minus) / (2.0 * self.h)

    @property
    def off_forward(self) -> Array:
        """The one-sided quotient less the slope of the gradient, (m,)."""
        return self._one_sided(self.s_plus, self.s_minus)

    @property
    def off_central(self) -> Array:
        """The central quotient less the slope of the gradient, (m,)."""
        return self.central - 0.5 * (self.s_plus + self.s_minus)

    @property
    def off(self) -> Array:
        """The central difference where there is one, else the one-sided one."""
        return self.off_central if self.two_sided else self.off_forward

    @property
    def jump(self) -> Array:
        """Forward less backward quotient: h v.J''v where J is smooth, the jump of the slope at a kink."""
        return (self.J_plus - 2.0 * self.J + self.J_minus) / self.h

    @property
    def two_sided(self) -> bool:
        return bool(np.isfinite(self.central).any())

    def joined(self, other: Quotients) -> Quotients:
        """The steps of both, ascending."""
        order = np.argsort(np.concatenate([self.h, other.h]), kind="stable")
        arrays = [np.concatenate([getattr(self, name), getattr(other, name)])[order] for name in SAMPLED]
        return Quotients(self.line, self.J, *arrays)

    def _one_sided(self, s_plus: Array | float, s_minus: Array | float) -> Array:
        ahead, behind = (self.J_plus - self.J) / self.h - s_plus, (self.J - self.J_minus) / self.h - s_minus
        return np.asarray(ahead if np.isfinite(ahead).any() else behind)


def quotients(J: Guarded, J_0: float, subject: Subject, gradient: Array, line: Line, h: Array) -> Quotients:
    """J on both sides of p, within the bounds and the budget; steps nearest to LIKELY are evaluated first."""
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
    return Quotients(line, J_0, h, *J_side, *s_side)
