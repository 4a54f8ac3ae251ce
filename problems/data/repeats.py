"""Points that are measured more than once."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

PAIRS = 5  # that tell a noise, at least
NORMAL = 1.4826  # standard deviation of normal numbers, in medians of their sizes
SMALL = 0.1  # of the data's own standard deviation: pairs further apart are of several loads, say
NOISE_LIMIT = 6.0  # standard deviations by which values of one point may differ: of 10^6 pairs, 0.002 by chance


def without_repeats(
    path: str | Path, x: Array, d: Array, lines: Array, sigma: Array | float = 0.0, what: str = "point"
) -> tuple[Array, str]:
    """Which rows to keep (m,), and a note on the others or on repeated ones.

    x (m, k) are the points, d (m, c) the values, NaN where not measured, sigma their noise, a number or (m, c). Rows
    that repeat another one exactly are left out; values of one point within their noise are kept. Where that is 0, not
    known, five pairs or more tell it.
    Raises InputError for values of one point that differ by more.
    """
    keep = np.ones(len(x), dtype=bool)
    key = sum(x_i * np.sqrt(2.0 + i) for i, x_i in enumerate(x.T))  # equal for equal points, and cheap to sort
    order = np.argsort(key, kind="stable")
    near = np.flatnonzero(np.diff(key[order]) == 0.0)
    a, b = order[near], order[near + 1]
    same = (x[a] == x[b]).all(axis=1)
    a, b = a[same], b[same]
    if not a.size:
        return keep, ""
    apart = np.nan_to_num(np.abs(d[a] - d[b]))
    told = _told(d, apart) if not np.any(sigma) else None
    noise = np.broadcast_to(sigma if told is None else told, d.shape)
    far = (apart > NOISE_LIMIT * np.hypot(noise[a], noise[b])).any(axis=1)
    if far.any():
        k = int(np.flatnonzero(far)[0])
        where = f"{what} {', '.join(f'{x_i:.6g}' for x_i in x[a[k]])}"
        raise InputError(
            f"{path}: lines {lines[a[k]]} and {lines[b[k]]}: {where} is given twice, with values that differ by"
            f" {apart[k].max():.3g}; {far.sum()} such pairs in all - average them, keep one load in a file, or"
            f" state noise="
        )
    exact = ((d[a] == d[b]) | (np.isnan(d[a]) & np.isnan(d[b]))).all(axis=1)
    keep[b[exact]] = False
    again = np.count_nonzero(~exact & (~np.isnan(d[a]) & ~np.isnan(d[b])).any(axis=1))
    said = [f"rows that repeat others are left out: {exact.sum()}"] if exact.any() else []
    how = "their noise" if told is None else f"a noise of {told.max():.3g} that they tell"
    said += [f"pairs of rows that measure one {what}, within {how}: {again}"] if again else []
    return keep, " and ".join(said)


def _told(d: Array, apart: Array) -> Array | None:
    """The noise (c,) of values d that differ by `apart` (pairs, c), None where these are too few or too large."""
    sigma = np.zeros(d.shape[1])
    for c, off in enumerate(apart.T):
        off = off[off > 0.0]
        if off.size:
            sigma[c] = NORMAL / np.sqrt(2.0) * np.median(off)
            if len(off) < PAIRS or sigma[c] > SMALL * np.nanstd(d[:, c]):
                return None
    return sigma
