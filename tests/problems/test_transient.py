"""A transient problem of a user: every route on a march that is written by its step alone."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROUTES, relative_error

from gradient_routes.problems.errors import NotConverged, Overflow
from gradient_routes.problems.problem import Linearization, Offers, Parameters
from gradient_routes.problems.transient import Transient
from gradient_routes.problems.vibrating_bar import VibratingBar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.unrolled_ad import unrolled_ad

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


@pytest.mark.parametrize("route", [adjoint, implicit_ad])
def test_both_shares_come_back_from_few_states(front: Any, route: Any) -> None:
    """Nonlinear steps: marched again by the same Newton steps, factorized again on the way back."""
    p = front.parameters.start
    exact = complex_step.prepare(Model(front), p)(p).gradient
    kept = route.prepare(Model(front), p, checkpoint="all")(p)
    assert relative_error(kept.gradient, exact) < 1e-13
    for checkpoint in ("sqrt", "none", "revolve=2"):
        found = route.prepare(Model(front), p, checkpoint=checkpoint)(p)
        np.testing.assert_array_equal(found.gradient, kept.gradient)


@pytest.mark.parametrize("iterations", [1, 3])
def test_unrolled_steps_give_the_gradient_of_their_iterates(front: Any, iterations: int) -> None:
    """Central differences of J after k Newton steps in every step, whose prediction is the state before."""
    p = front.parameters.start

    def J_k(p: Any) -> float:
        u, J = front.initial_state(p), 0.0
        for t in range(1, front.steps + 1):
            v = u
            for _ in range(iterations):
                R_u = front.step_tangent(t, u, v, p).toarray()
                u = u - np.linalg.solve(R_u, front.step_residual(t, u, v, p))
            J += front.step_objective(t, u, p)
        return float(J)

    h = 1e-6 * p
    fd = np.array([(J_k(p + d) - J_k(p - d)) / (2.0 * d.sum()) for d in np.diag(h)])
    kept = unrolled_ad.prepare(Model(front), p, iterations=iterations)(p)
    assert kept.J == pytest.approx(J_k(p), rel=1e-13)
    assert relative_error(kept.gradient, fd) < 1e-8  # h^2, and eps J / h
    few = unrolled_ad.prepare(Model(front), p, iterations=iterations, checkpoint=2)(p)
    np.testing.assert_array_equal(few.gradient, kept.gradient)
    assert few.tape < kept.tape


def test_a_march_whose_matrix_is_not_the_same_is_not_called_solved(front: Any) -> None:
    class Wrong(type(front)):  # type: ignore[misc]
        linear = constant = True

    wrong = Wrong(n=9, steps=6)
    for checkpoint in ("all", "sqrt", "revolve=2"):
        with pytest.raises(NotConverged, match=r"front: .*R\| / \|R_0\| ="):
            adjoint.prepare(Model(wrong), wrong.parameters.start, checkpoint=checkpoint)(wrong.parameters.start)


class Turned(Transient):
    """i u_t = p u_{t-1} + 1: a matrix that is complex where loads are real."""

    name = "turned"
    offers = Offers.LINEARIZE
    linear = constant = True
    parameters = Parameters(start=np.array([0.5]), scale=np.array([1.0]))
    steps = n_state = 3

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        return 1j * u - p[0] * v - 1.0

    def step_tangent(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return 1j * np.eye(1)

    def step_coupling(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return -p[0] * np.eye(1)


def test_imaginary_parts_of_matrices_and_loads_are_kept() -> None:
    p = Turned.parameters.start
    factors = Model(Turned()).factorize(Turned().tangent(np.zeros(3), p))
    z = factors.solve(np.ones(3))
    np.testing.assert_allclose(1j * z - 0.5 * np.append(0.0, z[:-1]), np.ones(3), atol=1e-15)
    bar = VibratingBar(n=5, steps=4)
    factors = Model(bar).factorize(bar.tangent(bar.initial(bar.parameters.start), bar.parameters.start))
    b = np.linspace(-1.0, 1.0, bar.n_state) + 1j * np.linspace(2.0, 1.0, bar.n_state)
    for solve in (factors.solve, factors.solve_transposed):
        np.testing.assert_allclose(solve(b), solve(b.real) + 1j * solve(b.imag), rtol=1e-12)


class Growth(Transient):
    """u_t = g u_{t-1}, which exceeds every number."""

    name = "growth"
    offers = Offers.LINEARIZE
    linear = constant = True
    parameters = Parameters(start=np.array([1e100]), scale=np.array([1.0]))
    steps = n_state = 8

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        return np.ones(1, p.dtype)

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        return u - p[0] * v

    def step_tangent(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return np.eye(1)

    def step_coupling(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return -p[0] * np.eye(1)

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return u[0]

    def step_linearize(self, t: int, u: Any, v: Any, p: Any) -> Linearization:
        return Linearization(-v[:, None], np.ones(1), np.zeros(1))


@pytest.mark.parametrize("checkpoint", ["whole", "all", "revolve=2"])
def test_a_state_that_overflows_is_told_with_its_step(checkpoint: str) -> None:
    model = Model(Growth())
    with pytest.raises(Overflow, match="growth: the state overflows at step 4 - take"):
        adjoint.prepare(model, Growth.parameters.start, checkpoint=checkpoint)(Growth.parameters.start)


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
