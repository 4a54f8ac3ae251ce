"""A transient problem of a user: every route on a march that is written by its step alone."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROUTES, relative_error

from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model

FRONT = Path(__file__).parents[2] / "examples" / "transient" / "front.py"


@pytest.fixture(scope="module")
def front() -> Any:
    return runpy.run_path(str(FRONT))["Front"](n=9, steps=6)


def test_every_route_takes_the_example_of_the_guide(front: Any) -> None:
    """Two shares: the rates, and the initial state."""
    model, p = Model(front), front.parameters.start
    exact = complex_step.prepare(model, p)(p).gradient
    assert abs(exact).min() > 0.0
    for route in ROUTES:
        found = route.prepare(model, p)(p)
        assert relative_error(found.gradient, exact) < (route.accuracy or 1e-13), route.name


def test_the_rows_of_the_march_are_those_of_its_steps(front: Any) -> None:
    rng, p = np.random.default_rng(0), front.parameters.start
    U = rng.standard_normal(front.n_state)
    states = [front.initial_state(p), *U.reshape(6, 9)]
    rows = [front.at(t).residual(states[t], np.concatenate([states[t - 1], p])) for t in range(1, 7)]
    np.testing.assert_array_equal(front.residual(U, p), np.concatenate(rows))
    traced = front.traced()
    np.testing.assert_allclose(np.asarray(traced.residual(U, p)), np.concatenate(rows), atol=1e-13)
    J = sum(front.at(t).objective(states[t], np.concatenate([states[t - 1], p])) for t in range(1, 7))
    assert front.objective(U, p) == pytest.approx(J, rel=1e-15)
    dp, lam = rng.standard_normal(3), rng.standard_normal(front.n_state)
    R_p = front.linearize(U, p).R_p
    by_p = front.residual(U.astype(complex), p + 1e-30j * dp).imag / 1e-30
    np.testing.assert_allclose(R_p @ dp, by_p, atol=1e-13)
    assert lam @ by_p == pytest.approx((R_p.T @ lam) @ dp, rel=1e-12)


def test_the_example_is_short() -> None:
    """The guide promises it."""
    assert len(FRONT.read_text().splitlines()) <= 60
