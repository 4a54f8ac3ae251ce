"""Measured displacements at the nodes of a face: moving least squares through the data points around each of them.

The value at a node is that of the affine function that fits the nearest points best, weighted by 1/distance^2: linear
fields are found exactly, and so are data at the nodes (Lancaster & Salkauskas 1981, with a basis of degree 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

REACH = 2.0  # distances between neighbouring points, from a node to the nearest one
AT_POINT = 1e-6  # of these distances, below which a node is at a point
NOTHING = 1e-9  # of a point's weight in a value: it is used elsewhere
SHOWN = 4


@dataclass(frozen=True, eq=False)
class BoundaryValues:
    """values (n, d) [m] at the nodes; the numbers of the points that were used; the greatest distance from a node to
    its nearest point [m]; and root (d, n, k) [m], root root^T the covariance of each component of the values, 0 if the
    noise of the data is unknown.
    """

    values: Array
    used: Array
    gap: float
    root: Array

    @property
    def sigma(self) -> float:
        """The greatest standard deviation of a value [m]."""
        return float(np.linalg.norm(self.root, axis=2).max())

    @classmethod
    def of(cls, X: Array, x: Array, d: Array, sigma: Array | float, who: str) -> BoundaryValues:
        """At nodes X (n, d), from data d (m, d) at points x (m, d) with the noise sigma, a number or (m, d).

        Raises InputError for nodes that are no nearer to a point than REACH times the distances of points there.
        """
        from scipy.spatial import KDTree

        count = min(2 * (x.shape[1] + 1), len(x))
        if count < 2:
            raise InputError(f"{who}: {len(x)} points measure all components of u - give more, or hold the face")
        tree = KDTree(x)
        distance, near = (np.asarray(found) for found in tree.query(X, k=[*range(1, count + 1)]))
        about, where = np.unique(near, return_inverse=True)
        apart = np.asarray(tree.query(x[about], k=[2])[0])[:, 0]
        spacing = apart[where.reshape(near.shape)].max(axis=1)
        bare = np.flatnonzero(distance[:, 0] > REACH * spacing)
        if bare.size:
            shown = ", ".join("(" + ", ".join(f"{X_i:.4g}" for X_i in X[i]) + ")" for i in bare[:SHOWN])
            i = bare[distance[bare, 0].argmax()]
            raise InputError(
                f"{who}: {bare.size} of {len(X)} nodes have no point near, at {shown}{', ...' * (bare.size > SHOWN)}:"
                f" up to {distance[i, 0]:.3g} m away, where points are up to {spacing[i]:.3g} m apart - measure there,"
                " or choose a body or faces that the points cover"
            )
        weight = 1.0 / np.maximum(distance, AT_POINT * spacing[:, None])
        weight /= weight[:, :1]
        A = np.concatenate([np.ones((*near.shape, 1)), (x[near] - X[:, None]) / spacing[:, None, None]], axis=2)
        c = np.linalg.pinv(weight[..., None] * A, rcond=1e-4 * AT_POINT)[:, 0] * weight  # (n, k): value = c . d
        used = np.unique(near[np.abs(c) > NOTHING])
        of_points = np.zeros((len(X), len(about)))
        np.put_along_axis(of_points, where.reshape(near.shape), c, axis=1)
        noisy = (of_points * s for s in np.broadcast_to(sigma, d.shape)[about].T)
        root = np.stack([np.asarray(np.linalg.qr(by_point.T, mode="r")).T for by_point in noisy])
        return cls(np.einsum("nk,nkd->nd", c, d[near]), used, float(distance[:, 0].max()), root)
