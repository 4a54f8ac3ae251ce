"""Sweeps over alpha: every minimum starts from the one before, and that is no excuse for not finding it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.discrepancy import between
from gradient_routes.bench.inversion.invert import Engine
from gradient_routes.bench.inversion.lcurve import CLOSE, Point, chosen, l_curve, minima
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.bench.studies.invert.lcurve_view import remarks


def test_minima_from_minima_converge_where_only_the_start_tells_a_slope() -> None:
    """Data there do not say how steep J is; at the minimum before, hardly any slope is left to compare with."""
    (spec,), (route,) = case.problems(["advection[n=3,unknown=source,data=twin,noise=1e-3]"]), case.routes(["adjoint"])
    ends = [found.end for found in minima(spec, route, Engine(), np.geomspace(1e-10, 1.0, 4))]
    assert all(end.startswith("converged") for end in ends), ends


def test_the_noise_is_met_between_the_alphas_of_the_sweep() -> None:
    (spec,), (route,) = case.problems(["bar[n=6,sensors=6,noise=0.003,seed=3]"]), case.routes(["adjoint"])
    engine = Engine(limits=Limits(200, 1e-8))
    swept = list(minima(spec, route, engine, [1.0, 5e-3, 2e-5]))
    further = list(between(spec, route, engine, l_curve(swept)))
    points = l_curve(swept, further)
    (met,) = [k for k, point in enumerate(points) if point.chosen == "discrepancy"]
    assert points[met].discrepancy == pytest.approx(1.0, abs=CLOSE)
    assert points[met - 1].discrepancy > 1.0
    assert 1 <= len(further) <= 3
    assert not any(point.curvature for point in points if point.inversion in further), "too close for one"
    assert not list(between(spec, route, engine, points)), "nothing is left to do"


@dataclass(frozen=True)
class At:
    """As much of an inversion as a point of an L-curve takes."""

    alpha: float
    end: str = "converged"
    misled: bool = False


def points(discrepancies: Sequence[float], end: str = "converged") -> list[Point]:
    return [Point(At(10.0**-k, end), d**2, 1.0 / d, None, d) for k, d in enumerate(discrepancies)]


@pytest.mark.parametrize(
    ("found", "says"),
    [
        (points([9.0, 6.0, 4.0]), "misfit / noise is 4 at 0.01; begin the sweep lower"),
        (points([9.0, 4.0, 3.999]), "the model does not explain the data"),
        (points([0.5, 0.4, 0.3]), "the largest to 0.5 of it: end the sweep higher"),
        (points([9.0, 6.0], "not converged"), "no inversion of the sweep has converged"),
    ],
    ids="lower plateau higher unconverged".split(),
)
def test_why_no_alpha_is_that_of_the_noise_is_said(found: list[Point], says: str) -> None:
    assert says in "\n".join(map(str, remarks(chosen(found))))


def test_a_curve_that_stands_still_has_no_corner_there() -> None:
    """Below some alpha the data alone determine p: what differences are left is the tolerance of the optimizer."""
    rng, left = np.random.default_rng(0), [3.0, 2.0, 1.5]
    still = points([*left, *(1.0 + 1e-9 * rng.standard_normal(8))])
    assert [point.chosen for point in chosen(still)[5:]] == [None] * 6
