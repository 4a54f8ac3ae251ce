"""Matrices of a chain of springs: K = B^T D B with B bidiagonal, known by D alone.

Row e of B takes the difference over element e, (B u)_e = u_e - u_{e-1} with u_0 = 0; D holds the spring constants.
B^{-1} is a cumulative sum, so K is solved in O(N) by two of them, and a right-hand side that vanishes beyond
some node leaves exact zeros there: nothing is ever subtracted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.problem import Array

BLOCKED_FROM = 4096  # below, one sequential sum is as accurate as needed and faster


def cumulative_sum(x: Array) -> Array:
    """Partial sums (n,) of x (n,), with rounding errors that grow like sqrt(n), not n.

    A sequential sum of 10^6 equal numbers is off by 1e-11. Here ~sqrt(n) blocks are summed one by one,
    then shifted by the sums of the blocks before (Higham 2002, section 4.2). Zeros add nothing, exactly.
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


@dataclass(frozen=True)
class Chain:
    """The symmetric tridiagonal matrix K = B^T diag(D) B, D (N,)."""

    D: Array

    @property
    def T(self) -> Chain:
        return self

    def __matmul__(self, v: Any) -> Any:
        return divergence(self.D * difference(v))

    @property
    def norm(self) -> float:
        """An upper bound of |K|_inf, at most twice too large."""
        return 4.0 * float(np.abs(self.D).max())


@dataclass(frozen=True)
class ElementForces:
    """The (N, N) matrix B^T diag(s): column e spreads the force s_e of element e onto its two nodes."""

    s: Array

    @property
    def T(self) -> ElementForcesTransposed:
        return ElementForcesTransposed(self.s)

    def __matmul__(self, v: Any) -> Any:
        return divergence(self.s * v)


@dataclass(frozen=True)
class ElementForcesTransposed:
    """diag(s) B."""

    s: Array

    @property
    def T(self) -> ElementForces:
        return ElementForces(self.s)

    def __matmul__(self, v: Any) -> Any:
        return self.s * difference(v)
