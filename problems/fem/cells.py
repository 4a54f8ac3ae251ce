"""Sums over the quadrature points of cells, a chunk of cells at a time, as products of matrices.

Arrays at points have their components first, then the points of a cell, then the cells: H is (d, m, n_q n_e), d = 3 in
space, 2 of a plane body, m as many as dN has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.fem.element_matrices import element_matrices, positions
from gradient_routes.problems.problem import Array

PER_CHUNK = 125  # cells: their arrays stay in cache; with a power of two, rows share few cache sets


class Congruent:
    """dN of cells that share it, (n_q, n_a, m), as matrices."""

    def __init__(self, dN: Array) -> None:
        self.dN = dN

    @cached_property
    def D(self) -> Array:
        """dN_a,J, rows J q, (m n_q, n_a)."""
        return np.ascontiguousarray(self.dN.transpose(2, 0, 1).reshape(-1, self.dN.shape[1]))

    @cached_property
    def DD(self) -> Array:
        """dN_a,J dN_b,L, rows a b, columns J L q, (n_a n_a, m m n_q)."""
        products = np.einsum("qaJ,qbL->abJLq", self.dN, self.dN)
        return np.ascontiguousarray(products.reshape(self.dN.shape[1] ** 2, -1))


@dataclass(frozen=True, eq=False)
class Cells:
    """Some of the cells: dN (n_e, n_q, n_a, m), None if `congruent` holds it, and dx (n_q, n_e)."""

    which: slice
    congruent: Congruent | None
    dN: Array | None
    dx: Array

    @property
    def m(self) -> int:
        """Columns of H."""
        dN = self.congruent.dN if self.congruent is not None else self.dN
        assert dN is not None
        return int(dN.shape[-1])

    def gradients(self, u_e: Array) -> Array:
        """H = grad u (d, m, n_q n_e) of u_e, the displacements (all cells, n_a, d) of the cells' nodes."""
        u, d = u_e[self.which], u_e.shape[2]
        if self.congruent is not None:
            return np.asarray(self.congruent.D @ np.ascontiguousarray(u.transpose(2, 1, 0))).reshape(d, self.m, -1)
        assert self.dN is not None
        return (u.swapaxes(1, 2)[:, None] @ self.dN).transpose(2, 3, 1, 0).reshape(d, self.m, -1)

    def at_points(self, q: Any) -> tuple[Any, ...]:
        """Constants, numbers or (all cells,), as numbers or (n_q n_e,)."""
        return tuple(np.tile(c[self.which], len(self.dx)) if np.ndim(c) else c for c in q)

    def forces(self, P: Array) -> Array:
        """Sum over points of P_iJ dN_a,J dx, (n_e, n_a, d), P (d, m, n_q n_e)."""
        (n_q, n_e), (d, m) = self.dx.shape, P.shape[:2]
        P_dx = P.reshape(d, m, n_q, n_e) * self.dx
        if self.congruent is not None:
            return np.asarray(self.congruent.D.T @ P_dx.reshape(d, m * n_q, n_e)).transpose(2, 1, 0)
        assert self.dN is not None
        by_q_J = self.dN.transpose(0, 2, 1, 3).reshape(n_e, -1, m * n_q)
        return np.asarray(by_q_J @ P_dx.transpose(3, 2, 1, 0).reshape(n_e, m * n_q, d))

    def matrices(self, A: Array, selected: Array) -> Array:
        """Entries (n_e, k) of the matrices, see `element_matrices`, of A (d, m, d, m, n_q n_e), A_iJkL = A_kLiJ."""
        (n_q, n_e), (d, m) = self.dx.shape, A.shape[:2]
        if self.congruent is None:
            assert self.dN is not None
            A_dx = (A.reshape(d, m, d, m, n_q, n_e) * self.dx).transpose(5, 4, 1, 0, 2, 3)
            return element_matrices(np.ascontiguousarray(A_dx), self.dN, selected)
        pairs = np.triu_indices(d)  # (i, k) of A_iJkL = A_kLiJ
        A_dx = np.stack([A[i, :, k] for i, k in zip(*pairs, strict=True)]).reshape(-1, m * m, n_q, n_e) * self.dx
        K = self.congruent.DD @ A_dx.reshape(-1, m * m * n_q, n_e)  # (pairs, a b, n_e)
        return np.asarray(K.reshape(-1, n_e)[self._rows(selected, pairs, d)].T)

    def _rows(self, selected: Array, pairs: tuple[Array, Array], d: int) -> Array:
        """Where the entries stand in K: (ai)(bk) as the entry a b of the pair i k, or b a of k i."""
        assert self.congruent is not None
        n_a = self.congruent.dN.shape[1]
        a, i, b, k = positions(selected, n_a, d)
        swap = i > k
        a, b, i, k = np.where(swap, b, a), np.where(swap, a, b), np.minimum(i, k), np.maximum(i, k)
        number = np.zeros((d, d), dtype=int)
        number[pairs] = np.arange(len(pairs[0]))
        return np.asarray((number[i, k] * n_a + a) * n_a + b)


def in_chunks(dN: Array, dx: Array) -> Iterator[Cells]:
    """All cells, of dN (n_e, n_q, n_a, m), or (1, n_q, n_a, m) if they are congruent, and dx (n_e, n_q)."""
    congruent = Congruent(dN[0]) if len(dN) == 1 else None
    for first in range(0, len(dx), PER_CHUNK):
        which = slice(first, first + PER_CHUNK)
        yield Cells(which, congruent, None if congruent else dN[which], np.ascontiguousarray(dx[which].T))
