"""Anderson acceleration of a fixed-point iteration v <- v + f(v)."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array


class Anderson:
    """The next v from the last `memory` pairs (v, f): that of the combination of them with the least |f|_2
    (Anderson 1965; Walker & Ni 2011).
    """

    def __init__(self, memory: int) -> None:
        self.memory, self.v, self.f = memory, list[Array](), list[Array]()

    def __call__(self, v: Array, f: Array) -> Array:
        self.v, self.f = [*self.v[-self.memory :], v], [*self.f[-self.memory :], f]
        if self.memory == 0 or len(self.f) == 1:
            return v + f
        df, dv = np.diff(self.f, axis=0).T, np.diff(self.v, axis=0).T
        weights = np.linalg.lstsq(df, f, rcond=None)[0]
        return np.asarray(v + f - (dv + df) @ weights)
