"""Singular values of a matrix given by products (Halko, Martinsson & Tropp 2011), or of a whole matrix by LAPACK."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.problem import Array, Operator

OVERSAMPLED = 10  # directions more than singular values wanted
SWEEPS = 2  # power iterations: (H H^T)^SWEEPS H separates singular values that decay slowly
PROBES = 6  # random vectors that bound what is left out; the bound fails with probability 1e-6


@dataclass(frozen=True)
class Svd:
    """The largest singular values s (k,), falling, and their right singular vectors V (n, k).

    beyond        an upper bound of the largest one left out, which fails with probability 1e-6; 0 where none is
    blind (n,)    columns that are exactly zero
    norms (n,)    of the columns, without what is left out: too small by at most `beyond`
    """

    s: Array
    V: Array
    beyond: float
    blind: Array
    norms: Array


def whole(H: Array) -> Svd:
    """All of H (m, n)."""
    _, s, V_T = np.linalg.svd(H, full_matrices=False)
    return Svd(s, V_T.T, 0.0, _zero_columns(H), np.linalg.norm(H, axis=0))


def randomized(H: Operator, shape: tuple[int, int], k: int, seed: int = 0) -> Svd:
    """The k largest of H (m, n), by (2 SWEEPS + 2) (k + OVERSAMPLED) + (2 SWEEPS + 1) PROBES products with H or H^T.

    Algorithms 4.4 and 5.1: Q spans the images of random directions, B = Q^T H is small. A column of B is exactly zero
    where that of H is, and for no other reason but coincidence.
    """
    m, n = shape
    rng = np.random.default_rng(seed)
    wanted = min(k + OVERSAMPLED, m, n)
    Q = _range(H.__matmul__, rng.standard_normal((n, wanted)))
    for _ in range(SWEEPS):
        Q = _range(H.__matmul__, _range(H.T.__matmul__, Q))
    B = _products(H.T.__matmul__, Q).T
    _, s, V_T = np.linalg.svd(B, full_matrices=False)
    k = min(k, len(s))
    left_out = _norm_beyond(H, Q, rng.standard_normal((n, PROBES))) if wanted < min(m, n) else 0.0
    beyond = max(left_out, float(s[k]) + left_out if k < len(s) else 0.0)
    return Svd(s[:k], V_T[:k].T, beyond, _zero_columns(B), np.linalg.norm(B, axis=0))


def _zero_columns(A: Array) -> Array:
    return np.asarray((A == 0.0).all(axis=0))


def _products(product: Callable[[Array], Array], X: Array) -> Array:
    return np.stack([product(x) for x in X.T], axis=1)


def _range(product: Callable[[Array], Array], X: Array) -> Array:
    """An orthonormal basis of the products with the columns of X."""
    return np.linalg.qr(_products(product, X))[0]


def _norm_beyond(H: Operator, Q: Array, W: Array) -> float:
    """An upper bound of the norm of E = (I - Q Q^T) H: (4.3) for (E E^T)^SWEEPS E, whose norm is |E|^(2 SWEEPS + 1).

    Applied to E itself it would bound sqrt(sum of s_j^2), far above the largest s_j where they decay slowly.
    """

    def outside(y: Array) -> Array:
        return np.asarray(y - Q @ (Q.T @ y))

    Y = [outside(H @ w) for w in W.T]
    for _ in range(SWEEPS):
        Y = [outside(H @ (H.T @ y)) for y in Y]
    largest = max(float(np.linalg.norm(y)) for y in Y)
    return float((10.0 * math.sqrt(2.0 / math.pi) * largest) ** (1.0 / (2 * SWEEPS + 1)))
