"""Symmetric sparse matrices with a fixed pattern: assembled by adding element entries into slots found once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from problems.problem import Array


@dataclass(frozen=True, eq=False)
class SymmetricPattern:
    """Where the upper triangle of a symmetric (n, n) matrix has entries, in CSR form with sorted columns.

    slots (n_e, m (m + 1) / 2) sends the upper triangle of every (m, m) element matrix, row by row, to its entry;
    entries of constrained unknowns go to slot nnz, which is dropped.
    """

    n: int
    indptr: Array
    indices: Array
    slots: Array

    @classmethod
    def of_elements(cls, unknowns: Array, n: int) -> SymmetricPattern:
        """From unknowns (n_e, m), the numbers 0..n-1 of every element's unknowns, -1 where constrained."""
        i, j = np.triu_indices(unknowns.shape[1])
        a, b = unknowns[:, i].astype(np.int64), unknowns[:, j].astype(np.int64)
        free = (a >= 0) & (b >= 0)
        keys, slots_of_free = np.unique(np.minimum(a, b)[free] * n + np.maximum(a, b)[free], return_inverse=True)
        slots = np.full(a.shape, len(keys), dtype=np.int32)
        slots[free] = slots_of_free
        indptr = np.searchsorted(keys, n * np.arange(n + 1, dtype=np.int64)).astype(np.int32)
        return cls(n, indptr, (keys % n).astype(np.int32), slots.ravel())

    def assemble(self, entries: Array) -> SymmetricSparse:
        """Sum entries (n_e, m (m + 1) / 2), the upper triangles of the element matrices, into a matrix."""
        flat = entries.ravel()
        if np.iscomplexobj(flat):
            return SymmetricSparse(self, self._summed(flat.real) + 1j * self._summed(flat.imag))
        return SymmetricSparse(self, self._summed(flat))

    def _summed(self, flat: Array) -> Array:
        return np.bincount(self.slots, weights=flat, minlength=len(self.indices) + 1)[:-1]


@dataclass(frozen=True, eq=False)
class SymmetricSparse:
    """A symmetric matrix (not Hermitian where complex): data (nnz,) of the upper triangle of its pattern."""

    pattern: SymmetricPattern
    data: Array

    @property
    def T(self) -> SymmetricSparse:
        return self

    @property
    def shape(self) -> tuple[int, int]:
        return self.pattern.n, self.pattern.n

    @cached_property
    def upper(self) -> Any:
        """The upper triangle as a SciPy CSR array that shares this one's memory."""
        from scipy.sparse import csr_array

        return csr_array((self.data, self.pattern.indices, self.pattern.indptr), shape=self.shape)

    @cached_property
    def diagonal(self) -> Array:
        """Its diagonal (n,): first in every sorted row of the upper triangle."""
        return np.asarray(self.data[self.pattern.indptr[:-1]])

    def full(self) -> Any:
        """Both triangles, as a SciPy CSC array."""
        from scipy.sparse import triu

        return (self.upper + triu(self.upper, k=1).T).tocsc()

    def __matmul__(self, v: Array) -> Array:
        return np.asarray(self.upper @ v + self.upper.T @ v - self.diagonal * v)

    @property
    def norm(self) -> float:
        """|A|_inf."""
        rows = abs(self.upper) @ np.ones(self.pattern.n) + abs(self.upper).T @ np.ones(self.pattern.n)
        return float((rows - abs(self.diagonal)).max())
