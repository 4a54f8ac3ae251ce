"""The noise of data that state none: what neighbouring residuals do not share.

Of repeated points, the standard deviation about their means, pooled. Else each residual is compared with the linear
function of position that fits its nearest neighbours: r_i - c^T r_near has the variance sigma^2 (1 + |c|^2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.problem import Array

NORMAL = 1.4826  # standard deviation of normal numbers, in medians of their sizes
REPEATED = 5  # degrees of freedom of repeated points, at least
LEAST = 10  # data with neighbours, at least
MOST = 5000  # of them, evenly taken from more
RANK = 1e-6  # of distances along and across neighbours, below which they lie on a line or in a plane


@dataclass(frozen=True)
class Noise:
    """Its standard deviation, and what it was taken from, in words."""

    sigma: float
    source: str


def repeated(r: Array, position: Array, quantity: Array) -> Noise | None:
    """From residuals r (m,) of one place, position (m, d), and quantity (m,); None where there are too few."""
    number = np.unique(quantity, return_inverse=True)[1]
    _, place, count = np.unique(np.c_[number, position], axis=0, return_inverse=True, return_counts=True)
    freedom = len(r) - len(count)
    if freedom < REPEATED:
        return None
    place = place.ravel()
    off = r - (np.bincount(place, r) / count)[place]
    return Noise(float(np.sqrt(off @ off / freedom)), "repeated points")


def of_neighbours(r: Array, position: Array, quantity: Array, share: float) -> Noise | None:
    """Of residuals r (m,) at position (m, d) of a quantity (m,), of which `share` is left by a fit; None if too few.

    Where residuals are not correlated, their own root mean square tells more.
    """
    compared = np.concatenate([_unshared(r[at], position[at]) for at in map(quantity.__eq__, np.unique(quantity))])
    if len(compared) < LEAST:
        return None
    return Noise(NORMAL * float(np.median(np.abs(compared))) / np.sqrt(share), "neighbouring points")


def _unshared(r: Array, x: Array) -> Array:
    """(r_i - c^T r_near) / sqrt(1 + |c|^2), of at most MOST data of one quantity; empty where there are too few."""
    from scipy.spatial import cKDTree

    m, d = x.shape
    k = 2 * (d + 1)
    if m < k + 2:
        return np.zeros(0)
    at = np.unique(np.linspace(0, m - 1, min(m, MOST)).astype(int))
    near = np.asarray(cKDTree(x).query(x[at], k + 1)[1])
    others = np.where(near[:, :1] == at[:, None], near[:, 1:], near[:, :-1])
    away = x[others] - x[at][:, None]
    size = np.abs(away).max(axis=(1, 2), keepdims=True)
    A = np.concatenate([np.ones((len(at), k, 1)), away / np.where(size > 0.0, size, 1.0)], axis=2)
    c = np.linalg.pinv(A, rcond=RANK)[:, 0]
    return np.asarray((r[at] - np.einsum("ik,ik->i", c, r[others])) / np.sqrt(1.0 + np.sum(c**2, axis=1)))
