"""Tridiagonal stiffness matrices of springs in series: K = B^T D B with B bidiagonal, stored as D.

Row e of B takes the difference over element e, (B u)_e = u_e - u_{e-1} with u_0 = 0; D holds the spring constants.
B^{-1} is a cumulative sum, so K is solved in O(N) by two of them; as nothing is subtracted, a right-hand side that
vanishes beyond some node gives strains that are exactly 0 there. Contact at the last node N, with unit vector e, adds
a spring to the ground, K + k e e^T, or a multiplier that borders K with e.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

BLOCKED_FROM = 4096  # below, one sequential sum is accurate enough and faster


def cumulative_sum(x: Array) -> Array:
    """Partial sums (n,) of x (n,), with rounding errors that grow like sqrt(n) instead of n.

    About sqrt(n) blocks are summed separately, then shifted by the sums of the blocks before (Higham 2002,
    section 4.2). A sequential sum of 10^6 equal numbers has a relative error of 1e-11. Zeros are added exactly.
    """
    n = x.shape[0]
    if n < BLOCKED_FROM:
        return np.cumsum(x)
    m = math.isqrt(n)
    sums = np.empty(n, dtype=x.dtype)
    blocks = sums[: m * m].reshape(m, m)
    np.cumsum(x[: m * m].reshape(m, m), axis=1, out=blocks)
    blocks[1:] += np.cumsum(blocks[:-1, -1])[:, None]
    np.cumsum(x[m * m :], out=sums[m * m :])
    sums[m * m :] += sums[m * m - 1]
    return sums


def difference(u: Any, xp: Any = np) -> Any:
    """B u, (N,): the elongation of every element. xp: numpy or jax.numpy."""
    return xp.concatenate([u[:1], u[1:] - u[:-1]])


def divergence(q: Any, xp: Any = np) -> Any:
    """B^T q, (N,): the net force of element forces q on every node. xp: numpy or jax.numpy."""
    return xp.concatenate([q[:-1] - q[1:], q[-1:]])


def add_to_last(v: Any, q: Any, xp: Any = np) -> Any:
    """v + q e, (N,): v with the force q added at the last node. xp: numpy or jax.numpy."""
    return xp.concatenate([v[:-1], v[-1:] + q])


@dataclass(frozen=True)
class Tridiagonal:
    """The symmetric matrix B^T diag(D) B + end_spring e e^T, D (N,), with a spring from the last node to the ground."""

    D: Array
    end_spring: Any = 0.0

    @property
    def T(self) -> Tridiagonal:
        return self

    def __matmul__(self, v: Any) -> Any:
        forces = divergence(self.D * difference(v))
        return add_to_last(forces, self.end_spring * v[-1]) if self.end_spring else forces

    @property
    def norm(self) -> float:
        """An upper bound of |K|_inf, at most twice too large."""
        return 4.0 * float(np.abs(self.D).max()) + float(abs(self.end_spring))

    @property
    def nbytes(self) -> int:
        return int(self.D.nbytes)


@dataclass(frozen=True)
class BorderedTridiagonal:
    """A tridiagonal K (N, N) with a multiplier on the last node; symmetric, indefinite, (N + 1, N + 1).

    [[K + c e e^T, e], [e^T, 0]] if the constraint u_N = const is active, else [[K, 0], [0, -1/c]].
    """

    D: Array
    c: float
    active: bool

    @property
    def block(self) -> Tridiagonal:
        return Tridiagonal(self.D, self.c if self.active else 0.0)

    @property
    def T(self) -> BorderedTridiagonal:
        return self

    def __matmul__(self, v: Any) -> Any:
        forces, lam = self.block @ v[:-1], v[-1:]
        if self.active:
            return np.concatenate([add_to_last(forces, lam), v[-2:-1]])
        return np.concatenate([forces, -lam / self.c])

    @property
    def norm(self) -> float:
        """An upper bound of |A|_inf."""
        return self.block.norm + 1.0 if self.active else max(self.block.norm, 1.0 / self.c)

    @property
    def nbytes(self) -> int:
        return int(self.D.nbytes)


@dataclass(frozen=True)
class ElementForces:
    """B^T diag(s): column e applies the force s_e of element e to its two nodes. Optional rows of zeros follow."""

    s: Array
    zero_rows: int = 0

    @property
    def T(self) -> ElementForcesTransposed:
        return ElementForcesTransposed(self.s, self.zero_rows)

    def __matmul__(self, v: Any) -> Any:
        forces = divergence(self.s * v)
        return np.concatenate([forces, np.zeros(self.zero_rows)]) if self.zero_rows else forces


@dataclass(frozen=True)
class ElementForcesTransposed:
    """diag(s) B, followed by columns of zeros."""

    s: Array
    zero_columns: int = 0

    @property
    def T(self) -> ElementForces:
        return ElementForces(self.s, self.zero_columns)

    def __matmul__(self, v: Any) -> Any:
        return self.s * difference(v[: len(self.s)])
