"""One-step schemes for u' = v, M v' = f - K u - C v, by the weights of the new step.

u_t - u_{t-1} = h (a v_t + (1 - a) v_{t-1})
M (v_t - v_{t-1}) = h (b (f - K u)_t + (1 - b) (f - K u)_{t-1} - c (C v)_t - (1 - c) (C v)_{t-1})
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

SchemeName = Literal["newmark", "backward-euler", "central-difference"]


@dataclass(frozen=True)
class Scheme:
    """Weights a, b, c of velocities, forces and damping of the new step; explicit where none of its forces is used."""

    name: SchemeName
    of_velocity: float
    of_force: float
    of_damping: float

    @property
    def explicit(self) -> bool:
        return self.of_force == 0.0

    def velocity(self, x: Any) -> Any:
        """a x_t + (1 - a) x_{t-1} of x_0..x_T along the first axis, (T, ...)."""
        return self.of_velocity * x[1:] + (1.0 - self.of_velocity) * x[:-1]

    def force(self, x: Any) -> Any:
        """b x_t + (1 - b) x_{t-1}, likewise."""
        return self.of_force * x[1:] + (1.0 - self.of_force) * x[:-1]

    def damping(self, x: Any) -> Any:
        """c x_t + (1 - c) x_{t-1}, likewise."""
        return self.of_damping * x[1:] + (1.0 - self.of_damping) * x[:-1]


# Newmark 1959 with beta = 1/4, gamma = 1/2, which is the trapezoidal rule; central differences of u (leapfrog) have
# velocities half a step early
SCHEMES: dict[SchemeName, Scheme] = {
    scheme.name: scheme
    for scheme in (
        Scheme("newmark", 0.5, 0.5, 0.5),
        Scheme("backward-euler", 1.0, 1.0, 1.0),
        Scheme("central-difference", 1.0, 0.0, 1.0),
    )
}


def moved_on(z: Any, h: float, xp: Any = np) -> Any:
    """(u, v) after h by the velocity before: a prediction that leaves nothing in the rows of u."""
    u, v = z.reshape(2, -1)
    return xp.concatenate([u + h * v, v])
