"""How well measured data are met, as rows: of all of them, of constants, and of each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.inversion.fit import Fit
from gradient_routes.bench.inversion.residuals import inliers

MOST = 3000  # data with a row each


def of_all(fit: Fit) -> Row:
    r = fit.residuals
    I, z = (None, None) if r.moran is None else (r.moran.I, r.moran.z)
    noise = {"noise": r.noise or None, "noise_source": r.source or None, "chi2": r.chi2 if r.noise else None}
    own = {"data": r.count, "outliers": r.outliers, "freedom": r.freedom, "rms": r.inner_rms}
    return own | noise | {"moran": I, "moran_z": z, "verdict": fit.verdict or "explained"}


def of_constants(fit: Fit) -> Iterator[Row]:
    c = fit.constants
    for i, name in enumerate(() if c is None else c.names):
        assert c is not None
        correlated = {other: float(r) for other, r in zip(c.names, c.correlation[i], strict=True) if not np.isnan(r)}
        thirds = [*c.thirds.get(name, ()), None, None, None][:3]
        yield {
            "constant": name,
            "value": float(c.value[i]),
            "sd": None if np.isnan(c.sd[i]) else float(c.sd[i]),
            **{f"third_{k + 1}": third for k, third in enumerate(thirds)},
            "bound": c.bounds.get(name.partition(" [")[0]),
            "correlations": correlated,
        }


def of_each(fit: Fit) -> Iterator[Row]:
    """As measured, without the weights of J; none where there are more than MOST."""
    seen, whole = fit.seen, fit.seen.whole or fit.seen
    if len(seen.data) > MOST:
        return
    w = np.broadcast_to(seen.relative * seen.weight, seen.data.shape)
    r, x = seen.predicted - seen.data, seen.position
    noise = fit.residuals.noise * seen.weight
    kept = inliers(np.abs(r), seen.sigma)
    for k in range(len(r)):
        at = [None] * 3 if x is None or np.isnan(x[k]).any() else [*x[k].tolist(), None, None][:3]
        yield {
            "datum": seen.label(k),
            "quantity": None if seen.quantity is None else str(seen.quantity[k]),
            **dict(zip("xyz", at, strict=True)),
            "measured": whole.data[k] / w[k],
            "residual": r[k] / w[k],
            "standardized": r[k] / noise if noise else None,
            "outlier": int(not kept[k]),
        }
