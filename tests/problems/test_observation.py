"""J = 1/2 |S u - d|^2 + alpha Phi, term by term: what problems observe, and what regularizes them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import relative_error, somewhere, zoo

from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Offers, Problem
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.tangent import tangent

MORE = {
    "bar[tv]": lambda: Bar(n=4, sensors=3, alpha=0.1, phi="tv", phi_width=0.05),
    "bar[tv,raw]": lambda: Bar(n=4, sensors=3, alpha=0.1, phi="tv", parametrization="raw"),
    "advection[tv]": lambda: Advection(n=3, alpha=0.1, phi="tv"),
    "block[alpha]": lambda: Block(n=2, alpha=0.1),
    "block[tv]": lambda: Block(n=2, alpha=0.1, phi="tv"),
    "block[amplitude]": lambda: Block(n=2, alpha=0.1, phi="amplitude"),
    "block[grip]": lambda: Block(n=2, unknown="load", load="displacement", alpha=0.1),
}
SUMS = {name: p for name, p in zoo().items() if Offers.OBSERVATION in p.offers}  # of squares
PROBLEMS = {name: (lambda problem=problem: problem) for name, problem in SUMS.items()} | MORE


@pytest.fixture(params=PROBLEMS)
def problem(request: pytest.FixtureRequest) -> Problem:
    return PROBLEMS[request.param]()


def test_the_terms_make_up_the_objective_and_its_derivatives(problem: Problem) -> None:
    p = somewhere(problem)
    u = Model(problem).solve(p).u
    seen, prior, lin = problem.observation(u, p), problem.prior(p), problem.linearize(u, p)
    assert seen is not None
    r = seen.predicted - seen.data
    by_prior, value = np.zeros_like(p), 0.0
    if prior is not None:
        Phi, theta, by_p = prior
        value, by_prior = Phi.value(np, theta), Phi.gradient(theta) * by_p
    assert 0.5 * r @ r + value == pytest.approx(problem.objective(u, p), rel=1e-14)
    np.testing.assert_allclose(seen.S_u.T @ r, lin.J_u, atol=1e-15 * np.abs(lin.J_u).max())
    direct = 0.0 if seen.S_p is None else seen.S_p.T @ r
    np.testing.assert_allclose(direct + by_prior, lin.J_p, atol=1e-14 * max(1.0, np.abs(lin.J_p).max()))
    assert len({seen.label(k) for k in range(len(r))}) == len(r), "every datum has a name of its own"


@pytest.mark.parametrize("name", MORE)
def test_regularized_gradients_agree_with_the_complex_step(name: str) -> None:
    problem = MORE[name]()
    p = somewhere(problem)
    g, exact = (route.prepare(Model(problem), p)(p).gradient for route in (tangent, complex_step))
    assert relative_error(g, exact) < 1e-11  # 1e3 eps times the condition of a block of 8 cells


@pytest.mark.parametrize("kind", ["tikhonov", "tv", "amplitude"])
@pytest.mark.parametrize("pairs", [None, np.array([[0, 2], [1, 3], [3, 0]])])
def test_a_prior_is_its_weighted_differences(kind: str, pairs) -> None:
    """Its gradient is that of its value, and alpha D^T diag(weights) D theta."""
    prior = Prior(0.7, kind, 0.3, pairs, origin=0.0, scale=2.0)
    theta = np.array([0.3, -0.2, 0.9, 0.1])
    h = 1e-30
    by_step = [prior.value(np, theta + 1j * h * e).imag / h for e in np.eye(4)]
    np.testing.assert_allclose(prior.gradient(theta), by_step, rtol=1e-14, atol=1e-16)
    D = prior.differences(4)
    rho, slope = prior.residuals(theta)
    assert 0.5 * rho @ rho == pytest.approx(prior.value(np, theta), rel=1e-14)
    np.testing.assert_allclose(D.T @ (slope * rho), by_step, rtol=1e-13, atol=1e-15)
    np.testing.assert_allclose(prior.alpha * D.T @ (prior.weights(theta) * (D @ theta)), by_step, atol=1e-15)


def test_total_variation_charges_a_jump_by_its_height_alone() -> None:
    steep, spread = np.array([0.0, 0.0, 1.0, 1.0]), np.array([0.0, 1 / 3, 2 / 3, 1.0])
    tv, tikhonov = Prior(1.0, "tv", 1e-9), Prior(1.0, "tikhonov")
    assert tv.value(np, steep) == pytest.approx(tv.value(np, spread), rel=1e-8)
    assert tikhonov.value(np, steep) > 2.9 * tikhonov.value(np, spread)


@pytest.mark.parametrize(
    "make", [Bar, lambda **options: Block(n=2, **options), lambda **options: Advection(n=2, **options)]
)
def test_total_variation_is_rounded_below_jumps_of_one_percent(make) -> None:
    """Phi of one jump j by default: sqrt(j^2 + 0.01^2) - 0.01."""
    prior = replace(make(alpha=1.0, phi="tv").regularization, pairs=None)
    assert prior.value(np, np.array([0.0, 0.03])) == pytest.approx(np.hypot(0.03, 0.01) - 0.01, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Bar(phi="tv", phi_width=0.0), "phi_width=0"),
        (lambda: Bar(phi_width=0.1), "phi_width needs phi=tv"),
        (lambda: Block(n=2, alpha=-1.0), "alpha=-1"),
        (lambda: Block(n=2, unknown="traction", phi="tv"), "phi needs unknown=modulus or layers"),
    ],
)
def test_priors_that_cannot_be_are_refused(make, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()
