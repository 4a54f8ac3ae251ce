"""Sweeps over alpha: every minimum starts from the one before, and that is no excuse for not finding it."""

from __future__ import annotations

import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine
from gradient_routes.bench.inversion.lcurve import minima


def test_minima_from_minima_converge_where_only_the_start_tells_a_slope() -> None:
    """Data there do not say how steep J is; at the minimum before, hardly any slope is left to compare with."""
    (spec,), (route,) = case.problems(["advection[n=3,unknown=source,data=twin,noise=1e-3]"]), case.routes(["adjoint"])
    ends = [found.end for found in minima(spec, route, Engine(), np.geomspace(1e-10, 1.0, 4))]
    assert all(end.startswith("converged") for end in ends), ends
