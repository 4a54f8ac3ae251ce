"""Impulses on the nodes of the vibrating bar in its steps, by what is sought of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.problem import Array


class ImpulsesByParameters:
    """R_p of k steps, (k 2 N, n_p), of p = (moduli, damping, velocities).

    w            (k, N): column e of the moduli is the impulses [N s] of element e, stretched by w
    resistances  (k, N) [N s] each, of the coefficients of damping
    """

    def __init__(self, w: Array | None, resistances: Sequence[Array], n_p: int, shape: tuple[int, int]) -> None:
        self.w, self.resistances, self.n_p, self.shape = w, resistances, n_p, shape
        self.first = 0 if w is None else w.shape[1]

    @property
    def T(self) -> ByProducts:
        return ByProducts(lambda lam: self.each_transposed(lam.reshape(len(self), -1)).sum(axis=0), self.__matmul__)

    def __len__(self) -> int:
        return self.shape[0]

    def __matmul__(self, dp: Array) -> Array:
        driven = np.zeros(
            self.shape, np.result_type(dp, *(part for part in (self.w, *self.resistances) if part is not None))
        )
        if self.w is not None:
            driven += spread(self.w * dp[: self.first], np)
        for resistance, dc in zip(self.resistances, dp[self.first :], strict=False):
            driven += resistance * dc
        return np.concatenate([np.zeros_like(driven), driven], axis=1).ravel()

    def each_transposed(self, lam: Array) -> Array:
        impulses = lam[:, self.shape[1] :]
        parts = [] if self.w is None else [self.w * elongation(impulses, np)]
        parts += [(resistance * impulses).sum(axis=1, keepdims=True) for resistance in self.resistances]
        known = sum(part.shape[1] for part in parts)
        return np.concatenate([*parts, np.zeros((len(lam), self.n_p - known), lam.dtype)], axis=1)


def elongation(x: Any, xp: Any) -> Any:
    """B x of every row, (.., N)."""
    return xp.concatenate([x[:, :1], x[:, 1:] - x[:, :-1]], axis=1)


def spread(q: Any, xp: Any) -> Any:
    """B^T q of every row, (.., N)."""
    return xp.concatenate([q[:, :-1] - q[:, 1:], q[:, -1:]], axis=1)
