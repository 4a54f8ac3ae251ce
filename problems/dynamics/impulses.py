"""Impulses of forces that depend on the state after a step and on that before it."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array, Operator


class ImpulsesByMaterial:
    """R_p of m steps, (m 2 n, n_p): h/2 (f_p + f_p before) in the rows of v, from f_p of the m + 1 states."""

    def __init__(self, f_p: list[Operator], h: float, transposed: bool = False) -> None:
        self.f_p, self.h, self.transposed = f_p, h, transposed

    @property
    def T(self) -> ImpulsesByMaterial:
        return ImpulsesByMaterial(self.f_p, self.h, not self.transposed)

    def __matmul__(self, x: Array) -> Array:
        m, half = len(self.f_p) - 1, 0.5 * self.h
        if self.transposed:
            lam = x.reshape(m, 2, -1)[:, 1]
            none = np.zeros_like(lam[:1])
            along = half * (np.concatenate([none, lam]) + np.concatenate([lam, none]))
            return np.asarray(sum(f_p.T @ w for f_p, w in zip(self.f_p, along, strict=True)))
        f = np.stack([f_p @ x for f_p in self.f_p])
        driven = half * (f[1:] + f[:-1])
        return np.stack([np.zeros_like(driven), driven], axis=1).ravel()

    def each_transposed(self, lam: Array) -> Array:
        """R_p^T lam of every step by itself, (m, n_p), from lam (m, 2 n)."""
        driven = 0.5 * self.h * lam.reshape(len(lam), 2, -1)[:, 1]
        steps = zip(self.f_p[1:], self.f_p[:-1], driven, strict=True)
        return np.stack([f_p.T @ w + before.T @ w for f_p, before, w in steps])
