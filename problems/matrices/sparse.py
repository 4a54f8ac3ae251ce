"""Sparse matrices with a fixed pattern: element matrices are added into precomputed slots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class SymmetricPattern:
    """Sparsity pattern of the upper triangle of a symmetric (n, n) matrix, in CSR form with sorted columns.

    slots (n_e, m (m + 1) / 2) maps the upper triangle of every (m, m) element matrix, row by row, to its entry; entries
    of constrained degrees of freedom go to slot nnz, which is dropped. near_nullspace (n, k), such as the rigid-body
    modes, is used by multigrid.
    """

    n: int
    indptr: Array
    indices: Array
    slots: Array
    near_nullspace: Array | None = None

    @classmethod
    def of_elements(cls, dofs: Array, n: int, near_nullspace: Array | None = None) -> SymmetricPattern:
        """From dofs (n_e, m), the degrees of freedom 0..n-1 of every element, -1 where constrained."""
        i, j = np.triu_indices(dofs.shape[1])
        a, b = dofs[:, i].astype(np.int64), dofs[:, j].astype(np.int64)
        free = (a >= 0) & (b >= 0)
        return cls(n, *_slots(np.minimum(a, b), np.maximum(a, b), free, n), near_nullspace)

    def assemble(self, entries: Array) -> SymmetricSparse:
        """Sum entries (n_e, m (m + 1) / 2), the upper triangles of the element matrices, into a matrix."""
        return SymmetricSparse(self, accumulate(self.slots, entries.ravel(), len(self.indices)))


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
        """The upper triangle as a SciPy CSR array that shares `data`."""
        from scipy.sparse import csr_array

        return csr_array((self.data, self.pattern.indices, self.pattern.indptr), shape=self.shape)

    @cached_property
    def diagonal(self) -> Array:
        """The diagonal (n,): the first entry in every row of the upper triangle."""
        return np.asarray(self.data[self.pattern.indptr[:-1]])

    def full(self) -> Any:
        """Both triangles, as a SciPy CSC array."""
        from scipy.sparse import triu

        return (self.upper + triu(self.upper, k=1).T).tocsc()

    def __matmul__(self, v: Array) -> Array:
        return np.asarray(self.upper @ v + self.upper.T @ v - self.diagonal * v)

    def plus(self, c: Any, B: SymmetricSparse) -> SymmetricSparse:
        """A + c B, of one pattern."""
        return SymmetricSparse(self.pattern, self.data + c * B.data)

    def plus_diagonal(self, d: Array) -> SymmetricSparse:
        """A + diag(d), d (n,)."""
        data = self.data.astype(np.result_type(self.data, d))
        data[self.pattern.indptr[:-1]] += d
        return SymmetricSparse(self.pattern, data)

    @property
    def norm(self) -> float:
        """|A|_inf."""
        size, columns = np.abs(self.data), self.pattern.indices
        rows = np.add.reduceat(size, self.pattern.indptr[:-1]) + np.bincount(columns, size, self.pattern.n)
        return float((rows - np.abs(self.diagonal)).max())

    @property
    def nbytes(self) -> int:
        return int(self.data.nbytes)


@dataclass(frozen=True, eq=False)
class GeneralPattern:
    """Sparsity pattern of an (n, n) matrix, in CSR form with sorted columns.

    slots (n_e, m, m) maps every entry of the element matrices to its entry; those of constrained degrees of freedom go
    to slot nnz, which is dropped.
    """

    n: int
    indptr: Array
    indices: Array
    slots: Array

    @classmethod
    def of_elements(cls, dofs: Array, n: int) -> GeneralPattern:
        """From dofs (n_e, m), the degrees of freedom 0..n-1 of every element, -1 where constrained."""
        a, b = (x.astype(np.int64) for x in np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :]))
        return cls(n, *_slots(a, b, (a >= 0) & (b >= 0), n))

    def assemble(self, entries: Array) -> GeneralSparse:
        """Sum element matrices (n_e, m, m), rows first, into a matrix."""
        return GeneralSparse(self, accumulate(self.slots, entries.ravel(), len(self.indices)))


@dataclass(frozen=True, eq=False)
class GeneralSparse:
    """A matrix without symmetry; data (nnz,) in the order of its pattern."""

    pattern: GeneralPattern
    data: Array

    @property
    def shape(self) -> tuple[int, int]:
        return self.pattern.n, self.pattern.n

    @cached_property
    def rows(self) -> Any:
        """The matrix as a SciPy CSR array that shares `data`."""
        from scipy.sparse import csr_array

        return csr_array((self.data, self.pattern.indices, self.pattern.indptr), shape=self.shape)

    @property
    def T(self) -> Any:
        """The transpose as a SciPy CSC array that shares `data`."""
        return self.rows.T

    def full(self) -> Any:
        """A SciPy CSC array."""
        return self.rows.tocsc()

    def __matmul__(self, v: Array) -> Array:
        return np.asarray(self.rows @ v)

    @property
    def norm(self) -> float:
        """|A|_inf."""
        return float(np.add.reduceat(np.abs(self.data), self.pattern.indptr[:-1]).max())

    @property
    def nbytes(self) -> int:
        return int(self.data.nbytes)


@dataclass(frozen=True, eq=False)
class BlockDiagonal:
    """diag(A_1, ..., A_c), the tangent of c load cases with the state u = (u_1, ..., u_c)."""

    blocks: tuple[Any, ...]

    @property
    def shape(self) -> tuple[int, int]:
        n = sum(A.shape[0] for A in self.blocks)
        return n, n

    @property
    def T(self) -> BlockDiagonal:
        return BlockDiagonal(tuple(A.T for A in self.blocks))

    def split(self, v: Array) -> list[Array]:
        """The parts of v (n,), one per block."""
        return np.split(v, np.cumsum([A.shape[0] for A in self.blocks])[:-1])

    def __matmul__(self, v: Array) -> Array:
        return np.concatenate([A @ part for A, part in zip(self.blocks, self.split(v), strict=True)])

    @property
    def norm(self) -> float:
        """|A|_inf."""
        return max(float(A.norm) for A in self.blocks)


def _slots(rows: Array, columns: Array, free: Array, n: int) -> tuple[Array, Array, Array]:
    """indptr, indices and flat slots of the CSR pattern of all free (row, column) pairs."""
    keys, slots_of_free = np.unique(rows[free] * n + columns[free], return_inverse=True)
    slots = np.full(free.shape, len(keys), dtype=np.int32)
    slots[free] = slots_of_free
    indptr = np.searchsorted(keys, n * np.arange(n + 1, dtype=np.int64)).astype(np.int32)
    return indptr, (keys % n).astype(np.int32), slots.ravel()


def accumulate(slots: Array, entries: Array, nnz: int) -> Array:
    """(nnz,) sums of the entries that share a slot."""
    if np.iscomplexobj(entries):
        return accumulate(slots, entries.real, nnz) + 1j * accumulate(slots, entries.imag, nnz)
    return np.bincount(slots, weights=entries, minlength=nnz + 1)[:-1]
