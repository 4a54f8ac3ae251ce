"""Laws every problem obeys: partial derivatives, shapes, both worlds equal; and the bar against textbook matrices."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import relative_error, somewhere, zoo

from gradient_routes.problems.bar import Bar, true_modulus
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import DomainError, InputError, NotOffered
from gradient_routes.problems.jax64 import jax
from gradient_routes.problems.problem import Offers, Problem, offer_names
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Route
from gradient_routes.routes.tangent import tangent

ZOO = zoo()
everywhere = pytest.mark.parametrize("name", ZOO)
REAL = {"length": "400mm", "area": 0.5, "force": "7e-4kN", "distributed": 0.9}
LOADED = {
    "bar[real]": Bar(n=6, sensors=[2, 5, 6], **REAL),
    "bar[real,penalty]": Bar(n=3, sensors=2, stop="penalty", gap=0.1, alpha=0.1, parametrization="raw", **REAL),
    "bar[real,softplus]": Bar(n=3, sensors=3, stop="softplus", width=0.1, gap=0.3, **REAL),
    "bar[real,multiplier]": Bar(n=4, sensors=4, stop="multiplier", gap=-0.2, **REAL | {"force": "-0.3N"}),
}
BARS = {name: problem for name, problem in ZOO.items() if name.startswith("bar")} | LOADED


def point(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Displacements small enough to leave every element of a solid the right side out."""
    return 0.02 * np.random.default_rng(1).standard_normal(problem.n_state), somewhere(problem)


def complex_derivative(f, x: np.ndarray, v: np.ndarray, h: float = 1e-30) -> np.ndarray:
    return np.imag(f(x + 1j * h * v)) / h


@everywhere
def test_partial_derivatives_equal_complex_steps(name: str) -> None:
    problem = ZOO[name]
    u, p = point(problem)
    rng = np.random.default_rng(2)
    du, dp = rng.standard_normal(len(u)), rng.standard_normal(len(p))
    lin = problem.linearize(u, p)
    tight = {"rtol": 1e-12, "atol": 1e-13}  # both sides are exact up to a few roundings
    R_u_du = complex_derivative(lambda u: problem.residual(u, p.astype(complex)), u, du)
    R_p_dp = complex_derivative(lambda p: problem.residual(u.astype(complex), p), p, dp)
    np.testing.assert_allclose(problem.tangent(u, p) @ du, R_u_du, **tight)
    np.testing.assert_allclose(lin.R_p @ dp, R_p_dp, **tight)
    np.testing.assert_allclose(lin.J_u @ du, complex_derivative(lambda u: problem.objective(u, p), u, du), **tight)
    np.testing.assert_allclose(lin.J_p @ dp, complex_derivative(lambda p: problem.objective(u, p), p, dp), **tight)


@everywhere
def test_transposes_are_transposes(name: str) -> None:
    """<lam, R_p v> = <R_p^T lam, v>, and the same for R_u."""
    problem = ZOO[name]
    u, p = point(problem)
    rng = np.random.default_rng(3)
    lam, v, w = rng.standard_normal(len(u)), rng.standard_normal(len(p)), rng.standard_normal(len(u))
    R_p, R_u = problem.linearize(u, p).R_p, problem.tangent(u, p)
    assert lam @ (R_p @ v) == pytest.approx((R_p.T @ lam) @ v, rel=1e-12, abs=1e-12)
    assert lam @ (R_u @ w) == pytest.approx((R_u.T @ lam) @ w, rel=1e-12, abs=1e-12)


@everywhere
def test_numpy_and_jax_evaluate_the_same_physics(name: str) -> None:
    problem = ZOO[name]
    if Offers.TRACE not in problem.offers:
        with pytest.raises(Exception, match="offers no jax"):
            problem.traced()
        return
    u, p = point(problem)
    traced = problem.traced()
    R, J = jax.jit(lambda u, p: (traced.residual(u, p), traced.objective(u, p)))(u, p)  # op by op it would compile long
    np.testing.assert_allclose(R, problem.residual(u, p), rtol=1e-13, atol=1e-13)
    assert float(J) == pytest.approx(problem.objective(u, p), rel=1e-13)


def test_every_bit_of_an_offer_has_a_name() -> None:
    """Python 3.11.2 takes the mask of an enum.Flag from members of one bit and drops, or refuses, all other bits."""
    members = Offers.__members__.values()
    single = {member.value for member in members if member.value.bit_count() == 1}
    for member in members:
        assert {1 << i for i in range(member.value.bit_length()) if member.value >> i & 1} <= single, member.name
    assert [offer_names(member) for member in (Offers.VALUE, Offers.SOLVE, Offers.LINEARIZE | Offers.TRACE)] == [
        ["value"],
        ["solve"],
        ["linearize", "trace"],
    ]


@everywhere
def test_parameters_are_consistent(name: str) -> None:
    parameters = ZOO[name].parameters
    assert (parameters.scale > 0).all()
    assert parameters.check(parameters.start, name) is not None
    assert len({parameters.label(i) for i in range(len(parameters))}) == len(parameters)


@pytest.mark.parametrize("n", [1, 2, 8])
def test_bar_matrix_is_the_sum_of_its_element_matrices(n: int) -> None:
    bar = Bar(n=n)
    p = somewhere(bar)
    K = np.zeros((n + 1, n + 1))
    for e in range(n):
        K[e : e + 2, e : e + 2] += np.exp(p[e]) / (1 / n) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    f = np.zeros(n)
    f[-1] = 1.0
    u = np.random.default_rng(0).standard_normal(n)
    np.testing.assert_allclose(bar.tangent(u, p) @ u, K[1:, 1:] @ u, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(bar.residual(u, p), K[1:, 1:] @ u - f, rtol=1e-12, atol=1e-12)


def test_traced_diagonal_and_bound_hold_for_the_matrix() -> None:
    bar = Bar(n=12)
    p = somewhere(bar)
    traced = bar.traced()
    K = np.column_stack([bar.tangent(p, p) @ e for e in np.eye(12)])
    np.testing.assert_allclose(traced.diagonal(p), np.diag(K), rtol=1e-14)
    largest = np.linalg.eigvalsh(K).max()
    assert largest <= float(traced.spectral_bound(p)) <= 2 * largest
    assert bar.condition(bar.parameters.start) == pytest.approx(
        np.linalg.cond(np.column_stack([bar.tangent(p, 0 * p) @ e for e in np.eye(12)])), rel=0.05
    )


@pytest.mark.parametrize("name", BARS)
def test_closed_form_equals_dense_algebra(name: str) -> None:
    """dJ/dp_i = J_p_i - J_u R_u^{-1} dK/dp_i u with dense matrices: neither a route nor a cumulative sum."""
    bar = BARS[name]
    p = somewhere(bar)
    n, u = bar.n, np.zeros(bar.n_state)
    for _ in range(1 if bar.linear else 30):  # a smoothed kink is met from one side, and slowly at first
        R_u = np.column_stack([bar.tangent(u, p) @ e for e in np.eye(bar.n_state)])
        u = u - np.linalg.solve(R_u, bar.residual(u, p))
    E, dE = (np.exp(p), np.exp(p)) if bar.log else (p, np.ones(n))
    B = np.eye(n) - np.eye(n, k=-1)
    J_u = np.zeros(bar.n_state)
    for node, d in zip(bar.sensors.nodes, bar.sensors.d, strict=True):
        J_u[node - 1] = u[node - 1] - d
    lam = np.linalg.solve(R_u.T, -J_u)[:n]  # R_u is that of the last iterate but one: they agree by now
    g = np.array([lam @ (bar.A / bar.L_e * dE[e] * np.outer(B[e], B[e]) @ u[:n]) for e in range(n)])
    D = np.diff(np.eye(n), axis=0)
    g += bar.alpha * (D.T @ D @ np.log(E)) * dE / E
    reference = bar.reference(p)
    assert relative_error(reference.gradient, g) < 1e-11  # cond(R_u) eps of the dense solves
    assert reference.size >= np.linalg.norm(reference.gradient) * (1 - 1e-12)


@pytest.mark.parametrize("name", LOADED)
def test_synthetic_data_of_a_loaded_bar_are_those_of_its_equations(name: str) -> None:
    """J = 0 at the truth; the data of the zoo's bars are as in test_synthetic_data_are_those_of_the_truth."""
    bar = LOADED[name].weighted(0.0)
    truth = bar.truth()
    assert truth is not None
    assert Model(bar).value(truth) < 1e-24 * (bar.sensors.d @ bar.sensors.d)


@pytest.mark.parametrize("name", LOADED)
@pytest.mark.parametrize("route", [tangent, adjoint, complex_step], ids=lambda route: route.name)
def test_routes_give_the_closed_form_of_a_loaded_bar(route: Route, name: str) -> None:
    p = somewhere(LOADED[name])
    assert relative_error(route.prepare(Model(LOADED[name]), p)(p).gradient, LOADED[name].reference(p).gradient) < 1e-12


def test_a_steel_bar_in_real_units_stretches_as_the_closed_form() -> None:
    """E A u = F x + q (L x - x^2/2)."""
    bar = Bar(n=5, length="250mm", area=1e-4, force="5kN", distributed=2e3, modulus=2.1e11, sensors=0)
    x = np.arange(1, 6) * 0.05
    u = (5e3 * x + 2e3 * (0.25 * x - x**2 / 2.0)) / (2.1e11 * 1e-4)
    np.testing.assert_allclose(Model(bar).solve(bar.parameters.start).u, u, rtol=1e-14)
    case = Bar(length=0.25, area=1e-4, force="5kN").case()
    assert [case[key] for key in ("length", "area", "load")] == [0.25, 1e-4, 5e3]
    with pytest.raises(NotOffered, match=r"distributed=2000 is not described"):
        bar.case()


def test_the_size_of_a_closed_form_is_that_of_its_terms() -> None:
    """One spring of compliance s: dJ/dtheta = -s (s - d), whose terms are s^2 and s d."""
    bar = Bar(n=1)
    s, d = np.exp(-0.5), bar.sensors.d[0]
    reference = bar.reference(np.array([0.5]))
    np.testing.assert_allclose(reference.gradient, [-s * (s - d)], rtol=1e-13)
    assert reference.size == pytest.approx(s * (s + d), rel=1e-14)


@pytest.mark.parametrize("name", BARS)
def test_a_bar_of_twice_as_many_elements_is_the_same_bar(name: str) -> None:
    """Constant in every element, its moduli give the same displacements at the same places."""
    bar = BARS[name]
    p = somewhere(bar)
    finer, q = bar.refined(p)
    assert (finer.n, len(q)) == (2 * bar.n, 2 * len(p))
    J, J_finer = (Model(problem).value(at) for problem, at in ((bar, p), (finer, q)))
    assert J_finer == pytest.approx(J, rel=1e-10)
    g, g_finer = bar.reference(p).gradient, finer.reference(q).gradient
    if not bar.alpha:  # a jump of theta between two halves costs Phi something, and none is there
        np.testing.assert_allclose(g_finer.reshape(-1, 2).sum(axis=1), g, rtol=1e-10, atol=1e-14)


@pytest.mark.parametrize(
    ("options", "n_p"),
    [
        ({}, 64),
        ({"unknown": "layers", "layers": 3, "n": 3}, 3),
        ({"unknown": "constants"}, 2),
        ({"unknown": "load"}, 1),
    ],
)
def test_a_block_of_eight_times_as_many_cells_inherits_p(options: dict, n_p: int) -> None:
    block = Block(**{"n": 2} | options)
    p = somewhere(block)
    finer, q = block.refined(p)
    assert finer.n_state > 4 * block.n_state
    assert len(q) == len(finer.parameters) == n_p
    if "unknown" not in options:
        x, x_finer = block.parameters.position, finer.parameters.position
        parents = [int(np.flatnonzero((np.abs(x - at) < 0.25).all(axis=1))[0]) for at in x_finer]
        np.testing.assert_array_equal(q, p[parents])


@pytest.mark.parametrize("options", [{"unknown": "shape"}, {"unknown": "traction"}])
def test_unknowns_of_one_mesh_have_no_finer_one(options: dict) -> None:
    block = Block(n=2, **options)
    assert block.refined(block.parameters.start) is None


def test_synthetic_data_are_those_of_the_truth() -> None:
    bar = Bar(n=40, sensors=40)
    u = np.cumsum(1 / 40 / true_modulus(bar.x))
    np.testing.assert_allclose(bar.sensors.d, u, rtol=1e-14)
    noisy = [
        Bar(n=2000, sensors=2000, noise=0.1, seed=s).sensors.d - Bar(n=2000, sensors=2000).sensors.d for s in (1, 2)
    ]
    assert np.std(noisy[0]) == pytest.approx(0.1, rel=0.1)  # 6 standard errors of 2000 draws
    assert not np.allclose(*noisy)


def test_parameters_outside_their_domain_are_named() -> None:
    bar = Bar(parametrization="raw")
    with pytest.raises(DomainError, match=r"E_3 = -1 is outside 0 < E_3 .*choose"):
        bar.parameters.check(np.where(np.arange(8) == 2, -1.0, 1.0), "bar")
    with pytest.raises(InputError, match="7 values, the problem has 8"):
        Bar().parameters.check(np.zeros(7), "bar")
    with pytest.raises(DomainError, match=r"log E_1 = nan .*and 7 more"):
        Bar().parameters.check(np.full(8, np.nan), "bar")


@pytest.mark.parametrize(
    ("text", "nodes"),
    [(5, [1, 2, 3, 4, 5]), ("3", [1, 2, 3]), ("0", []), ("2,4", [2, 4]), ("2+4", [2, 4]), ("6..8", [6, 7, 8]),
     ("1,3..4", [1, 3, 4]), ([8, 1], [8, 1]), ("7..7", [7]), (np.int64(2), [1, 2])],
)  # fmt: skip
def test_sensor_sets(text, nodes: list[int]) -> None:
    assert Bar(sensors=text).sensors.nodes.tolist() == nodes


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"n": 0}, "n=0"),
        ({"n": -3}, "n=-3"),
        ({"sensors": 9}, "there are 8"),
        ({"sensors": -1}, "choose 0 to 8"),
        ({"sensors": "9..9"}, "leaves the nodes 1..8"),
        ({"sensors": "4..2"}, "write 2..4"),
        ({"sensors": [0]}, "node 0"),
        ({"sensors": [3, 3]}, "given 2 times"),
        ({"sensors": "1,x"}, "'x' is no node"),
        ({"sensors": ""}, "is no node"),
        ({"sensors": [1.5]}, "whole"),
        ({"alpha": -1.0}, "alpha=-1"),
        ({"alpha": np.nan}, "alpha=nan"),
        ({"noise": -1.0}, "noise=-1"),
        ({"seed": -1}, "seed=-1"),
        ({"data": "nowhere.csv"}, "No such file"),
        ({"data": "nowhere.csv", "noise": 0.0}, "> 0, or leave it out"),
        ({"units": "mm"}, "units needs data=FILE"),
        ({"length": "0mm"}, "length=0mm - choose one from 1e-30"),
        ({"length": "3kN"}, "'kN' is a unit of force, not of length"),
        ({"area": -1.0}, "area=-1"),
        ({"force": "inf"}, "not a finite number"),
        ({"force": 0.0}, "force=0 and distributed=0 move nothing"),
        ({"distributed": 1e40}, "distributed=1e+40"),
    ],
)
def test_bad_options_of_the_bar_are_one_line(options: dict, says: str) -> None:
    with pytest.raises(InputError) as caught:
        Bar(**options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "empty"),
        ("node,displacement\n1,x\n", "line 2, column displacement: 'x' is not a number"),
        ("node,displacement\n1,nan\n", "line 2, column displacement: nan is not finite"),
        ("node,displacement\n1,\n", "'' is not a number"),
        ("node,value\n1,2\n", "no column displacement; it has node, value"),
        ("1,0.5\n2,0.6\n", "line 1 holds numbers"),
        ("node,displacement\n9,0.5\n", "node 9, bar has nodes 1..8"),
        ("node,displacement\n0,0.5\n", "node 0"),
        ("node,displacement\n1.5,0.5\n", "node 1.5"),
        ("node,displacement\n1,0.5\n1,0.6\n", "node 1 is given twice"),
        ("node,displacement\n1\n", "line 2 has 1 cells"),
        ("node,displacement\n", "no rows"),
    ],
)
def test_bad_data_files_name_the_line(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Bar(data=str(path))
    assert says in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_data_files_may_be_picked_from_and_have_other_columns(tmp_path: Path) -> None:
    path = tmp_path / "data.csv"
    path.write_text("\ufeffnode, displacement ,by\n3,0.3,Ann\n1,0.1,Bob\n\n8,0.8,Eve\n")
    bar = Bar(data=str(path))
    assert (bar.sensors.nodes.tolist(), bar.sensors.d.tolist()) == ([3, 1, 8], [0.3, 0.1, 0.8])
    assert bar.truth() is None
    picked = Bar(data=str(path), sensors="8,1")
    assert (picked.sensors.nodes.tolist(), picked.sensors.d.tolist()) == ([8, 1], [0.8, 0.1])
    with pytest.raises(InputError, match="no row for node 2"):
        Bar(data=str(path), sensors="1,2")
