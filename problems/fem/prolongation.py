"""Fields that are constant in every cell, carried over to a finer mesh."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array


def inherited(p: Array, x: Array, x_fine: Array) -> Array:
    """p (n,) of cells centred at x (n, d) for cells centred at x_fine (m, d): each takes that of the nearest, (m,)."""
    from scipy.spatial import cKDTree

    return np.asarray(p[cKDTree(x).query(x_fine)[1]])
