"""Prolongation of cellwise constant fields to a finer mesh."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array


def prolongate(p: Array, x: Array, x_fine: Array) -> Array:
    """p (n,) of cells with centres x (n, d) on cells with centres x_fine (m, d), from the nearest, (m,)."""
    from scipy.spatial import cKDTree

    return np.asarray(p[cKDTree(x).query(x_fine)[1]])
