"""The block against six independent codes, and the laws of its materials, matrices and solves."""

from __future__ import annotations

import numpy as np
import pytest
from commands import ROOT
from conftest import EXACT, relative_error

from gradient_routes.problems.block import Block
from gradient_routes.problems.data.csv import read_columns
from gradient_routes.problems.errors import InputError, NotConverged
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route


def top(block: Block, u: np.ndarray) -> np.ndarray:
    """Displacements of the nodes on the top, (m, 3)."""
    return block.solid.bc.displacements(u, 0.0, 0, block.solid.loaded.node_set, np)


DATA = ROOT / "tests" / "data"
BLOCK = Block(n=4, parametrization="raw")
START = BLOCK.parameters.start


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    """dJ/dE of the default case, in the order of the mesh's cells; DOLFINx, JAX-FEM and others agree to 1.5e-12."""
    table = read_columns(DATA / "block_n4.csv", ("x", "y", "z", "E", "dJ_dE"))
    centres = BLOCK.parameters.position.T
    order = np.lexsort(centres)  # the file is sorted by z, y, x
    np.testing.assert_allclose(centres[:, order], [table["x"], table["y"], table["z"]], atol=1e-15)
    np.testing.assert_allclose(START[order], table["E"], rtol=1e-15)
    gradient = np.empty(len(order))
    gradient[order] = table["dJ_dE"]
    return gradient


def test_the_default_state_is_the_one_six_codes_found() -> None:
    state = Model(BLOCK, Solver(newton="full")).solve(START)
    assert state.J == pytest.approx(0.00965777844833613, rel=1e-12)
    assert top(BLOCK, state.u)[:, 2].mean() == pytest.approx(0.19139633269418335, rel=1e-13)
    assert state.work.newton_iterations == 4
    assert state.residual < 1e-12


@pytest.mark.parametrize("route", EXACT, ids=lambda route: route.name)
def test_every_exact_route_meets_the_reference(route: Route, reference: np.ndarray) -> None:
    assert relative_error(route.prepare(Model(BLOCK), START)(START).gradient, reference) < 1e-10


def test_log_parameters_obey_the_chain_rule(reference: np.ndarray) -> None:
    log = Block(n=4)
    theta = log.parameters.start
    assert relative_error(adjoint.prepare(Model(log), theta)(theta).gradient, reference * START) < 1e-10


@pytest.mark.parametrize("factors", ["refined", "fresh", "stale"])
def test_stale_factors_corrupt_the_gradient_and_refined_ones_do_not(factors: str, reference: np.ndarray) -> None:
    model = Model(BLOCK, Solver(rtol=1e-7))  # the last step is then 1e-3: what stale factors are wrong by
    error = relative_error(adjoint.prepare(model, START, factors=factors)(START).gradient, reference)
    assert (error < 1e-7) == (factors != "stale")


def test_superlu_finds_what_pardiso_finds(reference: np.ndarray) -> None:
    model = Model(BLOCK, Solver(linear_solver="superlu"))
    assert relative_error(adjoint.prepare(model, START)(START).gradient, reference) < 1e-10
    assert model.solve(START).factors.name == "SuperLU L U"


def test_factors_that_are_held_are_not_overwritten() -> None:
    """An analysis is passed on only when nobody holds its factors any more."""
    model, b = Model(BLOCK), np.ones(BLOCK.n_state)
    one, other = (BLOCK.tangent(np.zeros(BLOCK.n_state), s * START) for s in (1.0, 2.0))
    first = model.factorize(one)
    second = model.factorize(other)
    np.testing.assert_allclose(one @ first.solve(b), b, rtol=1e-10)
    np.testing.assert_allclose(other @ second.solve(b), b, rtol=1e-10)
    solver = second.solver
    del second
    assert model.factorize(one).solver is solver


def test_assembled_and_matrix_free_products_agree() -> None:
    rng = np.random.default_rng(0)
    u, v = 0.01 * rng.standard_normal(BLOCK.n_state), rng.standard_normal(BLOCK.n_state)
    R_u = BLOCK.tangent(u, START)
    np.testing.assert_allclose(BLOCK.tangent_operator(u, START) @ v, R_u @ v, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(R_u.full() @ v, R_u @ v, rtol=1e-12, atol=1e-14)
    assert R_u.norm == pytest.approx(abs(R_u.full()).sum(axis=1).max(), rel=1e-13)


def test_the_linear_law_takes_one_newton_step_and_is_the_limit_of_small_loads() -> None:
    linear, finite = (Block(n=2, law=law, traction=1e-6) for law in ("linear", "neo-hookean"))
    p = linear.parameters.start
    state = Model(linear).solve(p)
    assert state.work.newton_iterations == 1
    u = Model(finite).solve(p).u
    assert relative_error(u, state.u) < 1e-5  # strains of 1e-6, to first order


def test_a_homogeneous_bar_of_rubber_follows_the_closed_form() -> None:
    """nu = 0: a column under traction t stretches by s with E/2 (s - 1/s) = t, free of the clamp."""
    block = Block(n=2, nu=0.0, traction=0.3)
    tip = top(block, Model(block).solve(np.zeros(8)).u)
    s = 0.3 + np.sqrt(0.3**2 + 1.0)
    np.testing.assert_allclose(tip[:, 2], s - 1.0, rtol=1e-12)
    np.testing.assert_allclose(tip[:, :2], 0.0, atol=1e-13)


def test_large_loads_are_reached_in_steps_and_buckled_states_are_said() -> None:
    block = Block(n=4, traction=5.0)  # stretched to 11 times its length
    state = Model(block).solve(block.parameters.start)
    assert state.residual < 1e-12
    assert state.work.residuals > state.work.newton_iterations + 2
    pressed = Model(BLOCK_PRESSED).solve(BLOCK_PRESSED.parameters.start)
    assert pressed.factors.name == "PARDISO L D L^T"


BLOCK_PRESSED = Block(n=4, traction=-0.5)


def test_what_cannot_converge_says_how_far_it_came() -> None:
    block = Block(n=2, traction=-3.0)
    with pytest.raises(NotConverged, match=r"block: .* % of the load reached, then .*\|R\| = ") as caught:
        Model(block).solve(block.parameters.start)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"n": 0}, "n=0"),
        ({"nu": 0.5}, "compressible"),
        ({"nu": -1.0}, "compressible"),
        ({"traction": np.nan}, "finite"),
    ],
)
def test_bad_options_of_the_block_are_one_line(options: dict, says: str) -> None:
    with pytest.raises(InputError, match=says):
        Block(**options)


def test_a_converged_state_with_a_wrong_gradient_is_warned_of(cli) -> None:
    """The reverse sweep of conjugate gradients amplifies rounding: iterates converge, their gradient does not."""
    routes = ("--route", "unrolled-ad[inner=cg]", "--route", "adjoint")
    ran = cli(*"run --json --no-store --no-timing --problem block[law=linear,n=3]".split(), *routes)
    rows = {row["route"]: row for row in ran.rows}  # printed in the order they are done
    unrolled, sound = rows["unrolled-ad"], rows["adjoint"]
    assert unrolled["residual"] < 1e-11
    assert unrolled["gradient_error"] > 1e-2
    assert "do not use it" in unrolled["note"]
    assert sound["note"] is None
