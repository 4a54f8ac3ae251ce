"""Whether residuals are correlated in space: Moran's I.

    I = (m / S_0) e^T W e / e^T e,    S_0 = sum of W,    W_ij = 1 where i, j are nearest neighbours, 1/2 one way only

Residuals e = M eps, M = I - Q Q^T, of independent normal noise eps, where Q is an orthonormal basis of what was fitted,
have (Cliff & Ord 1981, Spatial Processes, ch. 8), with f = m - rank Q:

    E[I] = (m / S_0) tr(M W) / f,    E[I^2] = (m / S_0)^2 (tr(M W)^2 + 2 tr(M W M W)) / (f (f + 2))
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

LEAST = 8  # degrees of freedom below which the normal law is no approximation
CERTAIN = 3.09  # standard deviations above E[I]: by chance in 1 of 1000 right models


@dataclass(frozen=True)
class Moran:
    """I of residuals, 1 where neighbours agree and 0 where they have nothing in common; z its standard score."""

    I: float
    z: float

    @property
    def correlated(self) -> bool:
        """Beyond chance, at a level of 1/1000."""
        return self.z > CERTAIN

    @classmethod
    def of(cls, e: Array, position: Array, quantity: Array, fitted: Array) -> Moran | None:
        """Of e (m,) at position (m, d); neighbours are of one quantity (m,); fitted (m, k) spans what was fitted.

        None where too few data are left.
        """
        W = neighbours(position, quantity)
        U, s, _ = np.linalg.svd(fitted, full_matrices=False)
        Q = U[:, s > max(fitted.shape) * np.finfo(float).eps * s.max(initial=0.0)]
        S_0, m, size = float(W.sum()), len(e), float(e @ e)
        f = m - Q.shape[1]
        if f < LEAST or not (S_0 and size):
            return None
        C = Q.T @ (W @ Q)
        tr_1 = -float(np.trace(C))
        tr_2 = float(W.multiply(W).sum()) - 2.0 * float(np.sum((W @ Q) ** 2)) + float(np.sum(C**2))
        mean = tr_1 / f
        variance = (tr_1**2 + 2.0 * tr_2) / (f * (f + 2.0)) - mean**2
        found = float(e @ (W @ e)) / size
        return cls(m / S_0 * found, (found - mean) / math.sqrt(variance)) if variance > 0.0 else None


def neighbours(position: Array, quantity: Array) -> Any:
    """W (m, m), sparse and symmetric, of the 2 d nearest ones among data of one quantity."""
    from scipy import sparse
    from scipy.spatial import cKDTree

    rows, columns = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)]
    for one in np.unique(quantity):
        at = np.flatnonzero(quantity == one)
        k = min(2 * position.shape[1], len(at) - 1)
        if k < 1:
            continue
        near = cKDTree(position[at]).query(position[at], k + 1)[1]
        i = np.repeat(np.arange(len(at)), k + 1)
        other = near.ravel() != i  # among several at one place a datum may not find itself
        rows.append(at[i[other]])
        columns.append(at[near.ravel()[other]])
    i, j, m = np.concatenate(rows), np.concatenate(columns), len(position)
    W = sparse.csr_array((np.full(len(i), 0.5), (i, j)), shape=(m, m))
    return W + W.T
