"""Residuals where data were measured, as fields on a cloud of points."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.inversion.fit import Fit
from gradient_routes.problems.problem import Array


def residual_cloud(fit: Fit | None) -> tuple[Array, dict[str, Array]] | None:
    """Points (k, 3) [m], and by name (k,): residuals of each quantity as measured, in units of the noise where that is
    known; nan where a quantity was not measured. None without places in space.
    """
    seen = None if fit is None else fit.seen
    if fit is None or seen is None or seen.position is None:
        return None
    placed = np.flatnonzero(~np.isnan(seen.position).any(axis=1))
    if not placed.size:
        return None
    points, at = np.unique(seen.position[placed], axis=0, return_inverse=True)
    at = np.ravel(at)
    r = seen.predicted - seen.data
    noise = fit.residuals.noise * seen.weight
    what = np.full(len(r), "") if seen.quantity is None else seen.quantity
    fields: dict[str, Array] = {}
    for quantity in dict.fromkeys(what[placed].tolist()):
        of = what[placed] == quantity
        values = {"residual": r / np.broadcast_to(seen.relative * seen.weight, r.shape)}
        values |= {"residual_over_noise": r / noise} if noise else {}
        for name, value in values.items():
            field = fields[f"{name}_{quantity}" if quantity else name] = np.full(len(points), np.nan)
            field[at[of]] = value[placed][of]
    return np.pad(points, ((0, 0), (0, 3 - points.shape[1]))), fields
