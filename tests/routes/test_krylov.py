"""Krylov iterations and inexact Newton steps: the same solution, in few products, and said where they fail."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import relative_error, somewhere, zoo

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Newton, Solver
from gradient_routes.routes.route import Route
from gradient_routes.routes.solvers.krylov import Iterated, conjugate_gradients, conjugate_residuals, products_to
from gradient_routes.routes.tangent import tangent

N = 40
METHODS = (conjugate_gradients, conjugate_residuals)


def spd(spread: float) -> Array:
    """Symmetric, eigenvalues in 1 .. 1 + spread."""
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((N, N)))[0]
    return Q @ np.diag(np.linspace(1.0, 1.0 + spread, N)) @ Q.T


def general(spread: float) -> Array:
    return np.eye(N) + spread * np.random.default_rng(1).standard_normal((N, N)) / np.sqrt(N)


MATRICES = {conjugate_gradients: spd, conjugate_residuals: general}


def iterate(method, A: Array, b: Array, wanted: float, M: Array | None = None, **options) -> tuple[Iterated, int, int]:
    """The outcome, the products and the substitutions it took."""
    products, substitutions = [], []

    def product(v: Array) -> Array:
        products.append(1)
        return A @ v

    def substitute(r: Array) -> Array:
        substitutions.append(1)
        return r.copy() if M is None else np.linalg.solve(M, r)

    return method(product, substitute, b, wanted, **options), len(products), len(substitutions)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("spread", [1e-6, 0.1, 0.5])
@pytest.mark.parametrize("size", [1.0, 1e-120])
def test_solutions_are_as_exact_as_wanted_and_every_product_is_told(method, spread: float, size: float) -> None:
    A, b = MATRICES[method](spread), size * np.random.default_rng(2).standard_normal(N)
    done, products, substitutions = iterate(method, A, b, 1e-12 * np.abs(b).max())
    assert done.converged
    assert done.breakdown is None
    assert (done.products, done.products + 1) == (products, substitutions)
    assert np.abs(b - A @ done.x).max() < 1e-11 * np.abs(b).max()
    assert products <= products_to(spread, 1.0, 1e-12) + 3


@pytest.mark.parametrize(
    ("rate", "wanted", "products"),
    [(0.1, 1e-3, 3.0), (0.5, 0.25, 2.0), (0.5, 1.0, 0.0), (0.0, 1e-9, 0.0), (1.0, 0.5, np.inf), (2.0, 0.5, np.inf),
     (0.5, 0.0, np.inf)],
)  # fmt: skip
def test_products_to_a_residual_are_counted_by_the_rate(rate: float, wanted: float, products: float) -> None:
    assert products_to(rate, 1.0, wanted) == pytest.approx(products)


@pytest.mark.parametrize("method", METHODS)
def test_factors_of_the_matrix_itself_take_one_product_to_be_believed(method) -> None:
    A, b = MATRICES[method](0.5), np.ones(N)
    done, products, _ = iterate(method, A, b, 1e-10, M=A)
    assert products == 1
    np.testing.assert_allclose(done.x, np.linalg.solve(A, b), rtol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_nothing_to_solve_takes_no_product(method) -> None:
    done, products, substitutions = iterate(method, MATRICES[method](0.5), np.zeros(N), 0.0)
    assert not done.x.any()
    assert (products, substitutions) == (0, 1)


def test_complex_systems_are_solved_by_conjugate_residuals() -> None:
    A, b = general(0.3) + 0.2j * spd(0.5), np.ones(N) + 1j * np.arange(N)
    done, _, _ = iterate(conjugate_residuals, A, b, 1e-10)
    np.testing.assert_allclose(A @ done.x, b, atol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_too_many_products_are_given_up_early(method) -> None:
    A = MATRICES[method](0.0) + np.diag(np.geomspace(1.0, 1e8, N))
    done, products, substitutions = iterate(method, A, np.ones(N), 1e-12, at_most=10)
    assert not done.converged
    assert products == substitutions <= 10


def test_an_indefinite_matrix_breaks_conjugate_gradients_down() -> None:
    A = np.diag(np.where(np.arange(N) == 3, -5.0, 1.0))
    done, _, _ = iterate(conjugate_gradients, A, np.where(np.arange(N) == 3, 10.0, 1.0), 1e-12)
    assert "not positive definite" in str(done.breakdown)
    rotation = np.array([[0.0, -1.0], [1.0, 0.0]])
    done, _, _ = iterate(conjugate_residuals, rotation, np.array([1.0, 0.0]), 1e-12)
    assert "stagnates" in str(done.breakdown)


NONLINEAR = {name: problem for name, problem in zoo().items() if not problem.linear and problem.line_search}
INEXACT = Solver(rtol=1e-13, newton="inexact")


class Ungrateful(Block):
    """The block, its products assembled and its symmetry not told."""

    structure, matrix_free = "general", False


CASES: dict[str, Problem] = NONLINEAR | {"block[n=3]": Block(n=3), "general": Ungrateful(n=3)}


@pytest.mark.parametrize("name", CASES)
def test_inexact_steps_reach_the_state_of_full_ones_on_fewer_factors(name: str) -> None:
    problem = CASES[name]
    p = somewhere(problem)
    full, inexact = (Model(problem, Solver(rtol=1e-13, newton=newton)).solve(p) for newton in ("full", "inexact"))
    assert relative_error(inexact.u, full.u) < 1e-12
    assert inexact.work.factorizations < full.work.factorizations
    work = inexact.work
    assert work.solves == work.newton_iterations + work.matvecs


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("route", [adjoint, tangent, complex_step], ids=lambda route: route.name)
def test_gradients_after_inexact_steps_are_those_after_full_ones(name: str, route: Route) -> None:
    problem = CASES[name]
    p = somewhere(problem)
    full, inexact = (route.prepare(Model(problem, Solver(rtol=1e-13, newton=n)), p)(p) for n in ("full", "inexact"))
    assert relative_error(inexact.gradient, full.gradient) < 1e-11


@pytest.mark.parametrize("name", NONLINEAR)
@pytest.mark.parametrize("newton", ["auto", "inexact"])
@pytest.mark.parametrize(
    ("route", "options"),
    [
        (adjoint, {"factors": "refined"}),
        (adjoint, {"factors": "fresh"}),
        (tangent, {"factors": "refined"}),
        (complex_step, {}),
        (fd_central, {"step": None, "start": "cold"}),
        (fd_central, {"step": None, "start": "warm"}),
        (fd_central, {"step": None, "start": "chord"}),
    ],
)
def test_counted_work_is_the_declared_work(name: str, route: Route, options: dict, newton: Newton) -> None:
    problem = CASES[name]
    p, model = problem.parameters.start, Model(problem, Solver(newton=newton))
    cold = Model(problem, Solver(newton=newton)).solve(p).work
    route.prepare(model, p, **options)(p)
    counted = model.tally.work
    forward = ForwardWork(cold, False, 1e-12, counted, problem.matrix_free, newton=newton)
    assert route.cost(len(p), forward, **options) == counted


def test_auto_ends_a_solve_as_full_steps_do_on_fewer_factors() -> None:
    """Its last factors are so near the solution that an adjoint solve takes two products at most."""
    block = Block(n=8)
    p = block.parameters.start
    full, auto = (Model(block, Solver(newton=newton)) for newton in ("full", "auto"))
    state = auto.solve(p)
    assert 2 == state.work.factorizations < full.solve(p).work.factorizations
    assert state.rate is None
    assert state.residual < 1e-12
    before = auto.tally.work
    LinearizedSolver(auto, state, "refined").solve_transposed(-auto.linearize(state).J_u)
    work = auto.tally.work - before
    assert (work.factorizations, work.matvecs <= 2) == (0, True)


@pytest.mark.parametrize("name", ["krylov", "cg-amg"])
@pytest.mark.parametrize("newton", ["auto", "inexact"])
def test_solvers_that_iterate_solve_once_a_step(name: str, newton: Newton) -> None:
    """As a preconditioner such a solver would be asked for all its digits before every product."""
    block = Block(n=3)
    p = block.parameters.start
    state = Model(block, Solver(linear_solver=name, newton=newton)).solve(p)
    assert state.work.solves == state.work.newton_iterations
    assert state.work.matvecs == 0
    assert relative_error(state.u, Model(block).solve(p).u) < 1e-10


def test_large_loads_and_buckled_states_are_reached_by_inexact_steps_too() -> None:
    for traction in (5.0, -0.5):
        block = Block(n=4, traction=traction)
        p = block.parameters.start
        states = [Model(block, Solver(newton=newton)).solve(p) for newton in ("full", "inexact")]
        assert relative_error(states[1].u, states[0].u) < 1e-10


@pytest.mark.parametrize("problem", [Block(n=2, law="linear"), Bar(stop="softplus")], ids=["linear", "no line search"])
def test_problems_whose_full_steps_are_known_to_converge_take_them(problem: Problem) -> None:
    full, inexact = (Model(problem, Solver(newton=n)).solve(problem.parameters.start).work for n in ("full", "inexact"))
    assert full == inexact
