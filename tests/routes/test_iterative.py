"""Solvers that end at a tolerance: |b - A x| <= rtol |b| on every kind of matrix, no further than asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import relative_error
from scipy.sparse import csr_array
from test_factorization import BLOCK, PATTERN, START, entries

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.matrices.sparse import BlockDiagonal
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.solvers.factorization import Factorizer
from gradient_routes.routes.solvers.iterative import DESCENT, ROUNDING, _conjugate_gradients, solver
from gradient_routes.routes.tally import Work
from gradient_routes.routes.tangent import tangent

RNG = np.random.default_rng(5)
ROUGH = np.exp(RNG.standard_normal(40))
K = BLOCK.tangent(np.zeros(BLOCK.n_state), START)
GENERAL = PATTERN.assemble(entries(float))
MATRICES = {
    "chain": Tridiagonal(ROUGH[:8]),
    "chain, spring": Tridiagonal(ROUGH[:8], 5.0),
    "chain, multiplier": BorderedTridiagonal(ROUGH[:8], 1.0, True),
    "chain, free": BorderedTridiagonal(ROUGH[:8], 2.0, False),
    "symmetric": K,
    "dense": np.diag(ROUGH) + 0.1,
    "dense, general": np.diag(ROUGH) + 0.01 * RNG.standard_normal((40, 40)),
    "indefinite": np.diag(np.where(np.arange(40) % 3, ROUGH, -ROUGH)),
    "general": GENERAL,
    "scipy": csr_array(np.diag(ROUGH) + 0.1 * np.eye(40, k=1)),
    "blocks": BlockDiagonal((K, K)),
    "complex": np.diag(ROUGH * (1 + 0.1j)) + 0.1,
}
SIZES = {"chain": 8, "chain, spring": 8, "chain, multiplier": 9, "chain, free": 9}
INDEFINITE = {"general", "indefinite", "chain, multiplier", "chain, free"}  # what minimal residuals cannot do
PAIRS = [("krylov", kind) for kind in MATRICES] + [("descent", kind) for kind in MATRICES if kind not in INDEFINITE]


@pytest.mark.parametrize("rtol", [1e-1, 1e-4, 1e-11])
@pytest.mark.parametrize(("linear_solver", "kind"), PAIRS)
def test_they_end_at_the_tolerance(linear_solver, kind: str, rtol: float) -> None:
    A = MATRICES[kind]
    factors = Factorizer(linear_solver, rtol)(A, "test")
    b = np.random.default_rng(7).standard_normal(SIZES.get(kind) or A.shape[0])
    for left in (b - A @ factors.solve(b), b - A.T @ factors.solve_transposed(b)):
        assert abs(left).max() <= rtol * abs(b).max()
        if kind not in SIZES and rtol > 1e-6:  # conjugate gradients jump there; GMRES near its last direction
            assert abs(left).max() > 1e-3 * rtol * abs(b).max(), "solved further than asked"
    tight = factors.to(1e-12)
    x = tight.solve(b)
    assert abs(b - A @ x).max() <= max(1e-12 * abs(b).max(), ROUNDING * factors.norm * abs(x).max())
    assert tight.to(rtol).solve(b).tobytes() == factors.solve(b).tobytes()
    assert not factors.solve(0.0 * b).any()
    assert factors.nbytes > 0 < factors.norm


def test_what_stalls_says_how_far_it_came() -> None:
    singular = np.diag([1.0, 1.0, 0.0])
    with pytest.raises(NotConverged, match=r"test: GMRES: \|b - A x\| = .* - loosen the tolerance or take"):
        Factorizer("krylov")(singular, "test").solve(np.ones(3))
    with pytest.raises(NotConverged, match=r"test: minimal residuals: "):
        Factorizer("descent")(np.array([[0.0, 1.0], [-1.0, 0.0]]), "test").solve(np.ones(2))


@pytest.mark.parametrize("kind", sorted(INDEFINITE))
def test_descent_on_an_indefinite_matrix_is_right_or_one_line(monkeypatch, kind: str) -> None:
    shorter = solver("descent", replace(DESCENT, at_most=10_000), gradual=True)
    monkeypatch.setattr("gradient_routes.routes.solvers.factorization.linear_solver", lambda name: shorter)
    A = MATRICES[kind]
    b = np.random.default_rng(7).standard_normal(SIZES.get(kind) or A.shape[0])
    try:
        left = b - A @ Factorizer("descent", 1e-1)(A, "test").solve(b)
    except NotConverged as failure:
        says = str(failure)
    else:
        says = "" if abs(left).max() <= 1e-1 * abs(b).max() else "not solved, and silent"
    assert says == "" or says.startswith("test: minimal residuals: |b - A x| = ")


def test_steepest_descent_that_grows_is_not_followed_into_infinity() -> None:
    """Each |r| is 1.86 times the one before, and every energy positive, though A has a negative eigenvalue."""
    A = np.diag([1.0, -0.3])
    x = Factorizer("descent", 1e-2)(A, "test").solve(np.ones(2))
    assert abs(np.ones(2) - A @ x).max() <= 1e-2


def test_growth_of_the_residual_tells_indefinite_matrices_from_badly_conditioned_ones() -> None:
    """|r|^2 grows to at most cond(A) |b|^2 where A is definite: cond / 4 is reached, 1 / eps times more is not."""
    cond = 1e14
    A, b = np.diag([cond, 1.0]), np.array([cond**-0.5, 1.0])
    dx, _ = _conjugate_gradients(A, b, 0.0, 1, memory=False)
    assert np.sum((b - A @ dx) ** 2) > 0.2 * cond
    dx, products = _conjugate_gradients(A, b, 1e-3, 10, memory=False)
    assert dx is not None
    assert products == 10
    dx, products = _conjugate_gradients(np.diag([1.0, -0.3]), np.ones(2), 1e-2, 1000, memory=False)
    assert dx is None
    assert 20 < products < 40  # |r|^2 grows by 3.46 a step, 1 / eps = 3.46^29


@pytest.mark.parametrize("stop", ["penalty", "softplus", "quadratic", "multiplier"])
def test_a_bar_behind_a_stop_is_solved_by_iterations(stop: str) -> None:
    bar = Bar(stop=stop)
    p = bar.parameters.start
    for route in (adjoint, tangent, complex_step):
        result = route.prepare(Model(bar, Solver(linear_solver="krylov")), p)(p)
        assert relative_error(result.gradient, bar.reference(p).gradient) < 1e-10


@pytest.mark.parametrize("linear_solver", ["krylov", "descent"])
@pytest.mark.parametrize("n", [5, 8])
def test_the_bar_is_solved_as_by_sums(linear_solver, n: int) -> None:
    bar = Bar(n=n, noise=0.01)
    truth, reference = bar.truth(), bar.reference(bar.truth())
    for route in (adjoint, tangent, complex_step):
        model = Model(bar, Solver(linear_solver=linear_solver))
        result = route.prepare(model, truth)(truth)
        assert relative_error(result.gradient, reference.gradient) < 1e-8  # cond(K) rtol = 3e3 * 1e-12 at most, twice


def test_linearized_solves_have_a_tolerance_of_their_own() -> None:
    """On the linear problem by the forward solve's own matrix, on a nonlinear one by that at u."""
    for problem in (Block(n=2, law="linear"), Block(n=2)):
        p = problem.parameters.start
        model = Model(problem, Solver(linear_solver="krylov", adjoint_rtol=1e-3))
        state = model.solve(p)
        R_u, b = problem.tangent(state.u, p), np.random.default_rng(1).standard_normal(problem.n_state)
        for factors in ("refined", "fresh"):
            linearized = LinearizedSolver(model, state, factors)
            for x in (linearized.solve(b), linearized.solve_transposed(b)):
                assert 1e-7 < abs(b - R_u @ x).max() / abs(b).max() <= 1e-3
        assert state.residual <= 1e-12


def test_refined_solves_end_at_the_tolerance_too() -> None:
    """With factors of the iterate before: a looser tolerance takes fewer products."""
    block, products = Block(n=2), []
    for adjoint_rtol in (1e-2, 1e-12):
        model = Model(block, Solver(rtol=1e-4, adjoint_rtol=adjoint_rtol))
        adjoint.prepare(model, block.parameters.start)(block.parameters.start)
        products.append(model.tally.work.matvecs)
    assert products[0] < products[1]


def test_refined_solves_meet_their_tolerance_and_do_little_more() -> None:
    """The last correction is not checked: it relies on a margin, which costs products."""
    follower = Block(nx=1, ny=1, nz=2, parametrization="raw", derivatives="hand", load="follower", cases=2)
    ratios, products, rng = [], 0, np.random.default_rng(0)
    for problem in (Block(n=2, derivatives="hand"), Bar(n=8, stop="softplus", width=0.3), follower):
        p = problem.parameters.start
        for rtol in (1e-1, 1e-2, 1e-3, 1e-4):
            state = Model(problem, Solver(rtol=rtol)).solve(p)
            R_u = problem.tangent(state.u, p)
            for adjoint_rtol in (1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10):
                model, b = Model(problem, Solver(adjoint_rtol=adjoint_rtol)), rng.standard_normal(problem.n_state)
                linearized = LinearizedSolver(model, state, "refined")
                x = linearized.solve(b)
                if linearized.R_u is not None:  # else new factors were made
                    ratios.append(abs(b - R_u @ x).max() / abs(b).max() / adjoint_rtol)
                    products += model.tally.work.matvecs
    assert len(ratios) > 60
    assert max(ratios) < 0.5
    assert products < 187


@pytest.mark.parametrize(
    "problem", ["bar", "block[n=2,derivatives=hand]", "block[nx=1,ny=1,nz=2,load=follower,cases=2,derivatives=hand]"]
)
def test_bills_are_as_declared(cli, problem: str) -> None:
    ways = ["all"] if "follower" not in problem else ["adjoint", "tangent", "complex-step"]
    named = [word for way in ways for word in ("--route", way)]
    ran = cli("run", "--json", "--no-store", "--min-time", "0", "--problem", problem, *named,
              "--linear-solver", "krylov")  # fmt: skip
    for row in ran.rows:
        assert row["status"] == "ok", row["reason"]
        assert Work(**row["work"]) == Work(**row["predicted_work"]), row["route"]
        assert row["gradient_error"] < 1e-6
        assert row["linear_solver"].startswith(("conjugate", "GMRES"))
