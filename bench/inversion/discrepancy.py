"""The discrepancy principle (Morozov 1966): data met to their noise have told what they can."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.lcurve import CLOSE, Point, l_curve

TRIES = 4  # alphas between those that bracket the noise


def between(
    spec: ProblemSpec, route: RouteSpec, engine: Engine, swept: Sequence[Point], at: str = "start"
) -> Iterator[Inversion]:
    """J minimized at further alphas, until |S u - d| is that of the noise to CLOSE: by monotone interpolation of log
    alpha over the logarithm of the discrepancy. None where no two converged points bracket the noise.
    """
    from scipy.interpolate import PchipInterpolator

    known = [point for point in swept if point.converged and point.discrepancy]
    for _ in range(TRIES):
        known.sort(key=lambda point: point.inversion.alpha)
        x, first = np.unique([math.log(point.discrepancy or 1.0) for point in known], return_index=True)
        if not (x.min(initial=0.0) < 0.0 < x.max(initial=0.0)) or np.abs(x).min() <= math.log1p(CLOSE):
            return
        log_alpha = np.log([point.inversion.alpha for point in known])[first]
        alpha = float(f"{math.exp(PchipInterpolator(x, log_alpha)(0.0)):.6g}")
        start = min((point.inversion for point in known), key=lambda one: abs(math.log(one.alpha / alpha)))
        found = invert(spec, route, engine, at, start.p, made=start.made.weighted(alpha))
        yield found
        (point,) = l_curve([found])
        if found.interrupted or not point.converged:
            return
        known.append(point)
