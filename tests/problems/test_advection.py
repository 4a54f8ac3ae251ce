"""Advection and diffusion against exact solutions, and what its discrete and continuous adjoints disagree in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import relative_error, somewhere

from gradient_routes.problems.advection import Advection, inclusion, plume
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.supg import Supg, unit_vector
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.faulty_adjoint import faulty_adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import with_synthetic_data

MESHES = (4, 8, 16, 32)


def rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))


def solved(advection: Advection, p: Array) -> Array:
    return Model(advection).solve(p).u


def rates(errors: list[float]) -> Array:
    """Orders of convergence from mesh to mesh."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def test_along_the_flow_it_converges_to_the_exponential_solution() -> None:
    """u' - k u'' = 1, u(0) = 0, u'(1) = 0: u = x - k (exp((x - 1) / k) - exp(-1 / k)), whatever y is."""
    k, errors = 0.2, []
    for n in MESHES:
        line = Advection(n=n, angle=0.0, kappa=k, unknown="source")
        u, (x, y) = solved(line, np.ones(n * n)), line.supg.x.T
        errors.append(rms(u - (x - k * (np.exp((x - 1.0) / k) - np.exp(-1.0 / k)))))
        np.testing.assert_allclose(u[y == 0.0], u[y == 1.0], rtol=1e-12)
    assert errors[-1] < 1e-3
    assert (rates(errors)[1:] > 1.6).all()  # on its way from 1 (streamline diffusion) to 2


@pytest.mark.parametrize("angle", [20.0, 45.0, 90.0])
def test_it_converges_to_a_manufactured_solution(angle: float) -> None:
    """u = sin(pi x / 2) sin(pi y / 2), 0 at the inflow and of zero slope at the outflow; f follows from it."""
    k, errors, b = 0.05, [], unit_vector(angle)

    def u(x: Array) -> Array:
        s = np.sin(np.pi * x / 2)
        return s[:, 0] * s[:, 1] if angle < 90.0 else s[:, 1]

    def f(x: Array) -> Array:
        s, c, q = np.sin(np.pi * x / 2), np.pi / 2 * np.cos(np.pi * x / 2), (np.pi / 2) ** 2
        if angle == 90.0:
            return c[:, 1] + k * q * s[:, 1]
        return b[0] * c[:, 0] * s[:, 1] + b[1] * s[:, 0] * c[:, 1] + 2 * k * q * s[:, 0] * s[:, 1]

    for n in (8, 16, 32, 64):
        advection = Advection(n=n, angle=angle, kappa=k, unknown="source")
        errors.append(rms(solved(advection, f(advection.supg.centres)) - u(advection.supg.x)))
    assert errors[-1] < 1e-3
    assert (rates(errors)[1:] > 1.7).all()


def test_supg_does_not_oscillate_where_galerkin_does() -> None:
    """u = 0 at the outflow, too: a layer 1e-5 m wide in cells of 0.05 m, before which u = x along the flow."""
    n, k = 20, 1e-5
    supg = Supg.of(n, unit_vector(0.0))
    kappa, f = np.full(n * n, k), np.ones(n * n)
    x, inside = supg.x[:, 0], supg.x[:, 0] < 1.0
    stabilized = supg.tangent(kappa), -supg.residual(np.zeros(len(x)), kappa, f)
    galerkin = supg.pattern.assemble(np.broadcast_to(k * supg.D + supg.C, (n * n, 4, 4)))
    plain = galerkin, supg.cells.columns(np.broadcast_to(supg.m, (n * n, 4))) @ f
    missed = []
    for A, load in (stabilized, plain):
        u = np.linalg.solve(A.full().toarray()[np.ix_(inside, inside)], load[inside])
        missed.append(np.abs(u - x[inside]).max())
    assert missed[0] < 1e-3
    assert missed[1] > 0.5


def test_element_matrices_are_those_of_the_weak_form() -> None:
    """b . grad 1 = 0, b . grad (b . x) = 1; rows sum to zero where test functions do, not where they need not."""
    b, n = unit_vector(30.0), 5
    supg = Supg.of(n, b)
    corners = supg.mesh.p.T[supg.mesh.t.T[0]] @ b
    for term, of_flow in ((supg.D, None), (supg.C, supg.m), (supg.S, supg.s)):
        np.testing.assert_allclose(term @ np.ones(4), 0.0, atol=1e-15)
        if of_flow is not None:
            np.testing.assert_allclose(term @ corners, of_flow, atol=1e-15)
    np.testing.assert_allclose(supg.S, supg.S.T, atol=1e-15)
    assert np.abs(supg.C - supg.C.T).max() > 0.05


@pytest.mark.parametrize("kappa", [1e-6, 0.01, 10.0])
def test_tau_has_its_limits_and_its_derivative(kappa: float) -> None:
    supg = Supg.of(10, unit_vector(0.0))
    h = supg.h
    assert h == pytest.approx(0.1)
    assert supg.tau_kappa(kappa) == pytest.approx(np.imag(supg.tau(kappa + 1e-30j)) / 1e-30, rel=1e-13)
    assert 0.5 < supg.tau(kappa) / min(h / 2.0, h**2 / (12.0 * kappa)) <= 1.0


@pytest.mark.parametrize("options", [{}, {"unknown": "source", "angle": 110.0}])
def test_solving_with_the_untransposed_matrix_gives_another_gradient(options: dict) -> None:
    advection = Advection(n=6, **options)
    model, p = Model(advection), somewhere(advection)
    state = model.solve(p)
    lin = model.linearize(state)
    right, wrong = (lin.R_p.T @ s(state.factors, -lin.J_u) for s in (model.solve_transposed, model.solve_linear))
    np.testing.assert_allclose(right, adjoint.prepare(model, p)(p).gradient, rtol=1e-12)
    assert relative_error(wrong, right) > 0.5


def continuous(advection: Advection, p: Array) -> Array:
    """The gradient of optimize-then-discretize."""
    model = Model(advection)
    state = model.solve(p)
    lin = model.linearize(state)
    A, Q = advection.continuous_adjoint(state.u, p)
    return lin.J_p + Q.T @ model.solve_linear(model.factorize(A), -lin.J_u)


@pytest.mark.parametrize(
    "options", [{}, {"unknown": "source"}, {"sensors": "everywhere", "alpha": 1e-3, "angle": 75.0}]
)
def test_the_continuous_adjoint_misses_the_gradient_by_less_on_finer_meshes(options: dict) -> None:
    advection, errors = Advection(n=MESHES[0], **options), []
    for n in MESHES:
        assert advection.n == n
        p = advection.parameters.start
        errors.append(relative_error(continuous(advection, p), adjoint.prepare(Model(advection), p)(p).gradient))
        advection, _ = advection.refined(advection.parameters.start)
    assert 1e-3 < errors[1] < 0.5
    assert (rates(errors) > 1.0).all()
    assert rates(errors)[-1] > 1.7  # tau = O(h^2) once cells are narrow: 1.9


@pytest.mark.parametrize("options", [{}, {"unknown": "source"}, {"sensors": "everywhere", "alpha": 1e-3}])
@pytest.mark.parametrize("fault", ["quadrature", "stabilization", "mesh"])
def test_an_adjoint_of_another_discretization_is_wrong_and_less_so_on_finer_meshes(fault: str, options: dict) -> None:
    errors = []
    for n in MESHES:
        model = Model(Advection(n=n, **options))
        p = model.parameters.start
        wrong = faulty_adjoint.prepare(model, p, fault=fault)(p)
        errors.append(relative_error(wrong.gradient, adjoint.prepare(model, p)(p).gradient))
    assert 0.01 < errors[1] < 0.7
    assert (np.diff(errors) < 0.0).all()
    assert (rates(errors)[1:] > 0.8).all()  # a coarse mesh of 2 by 2 cells is not in the asymptotic range


def test_the_adjoint_of_another_discretization_is_that_of_its_equation() -> None:
    """A and Q belong to one residual; its gradient of J at its own state would be right."""
    advection = Advection(n=4)
    p = somewhere(advection)
    u = Model(advection).solve(p).u
    for other, supg in (("quadrature", Supg.of(4, advection.supg.b, nodal=True)), ("stabilization", None)):
        A, Q, b = advection.inconsistent_adjoint(u, p, other)
        supg = supg or replace(advection.supg, S=0.0 * advection.supg.S, s=0.0 * advection.supg.s)
        kappa, f = advection.coefficients(p)
        v, h = np.random.default_rng(0).standard_normal(len(p)), 1e-6
        by_p = (supg.residual(u, kappa * np.exp(h * v), f) - supg.residual(u, kappa * np.exp(-h * v), f)) / (2.0 * h)
        np.testing.assert_allclose(Q @ v, by_p, rtol=1e-7, atol=1e-9)
        w = np.random.default_rng(1).standard_normal(len(u))
        np.testing.assert_allclose(A.T @ w, supg.residual(u + w, kappa, f) - supg.residual(u, kappa, f), atol=1e-12)
        np.testing.assert_array_equal(b, advection.linearize(u, p).J_u)
    assert Advection(n=3).inconsistent_adjoint(u, p, "mesh") is None


def test_the_coarse_adjoint_is_interpolated_and_its_kappa_the_mean() -> None:
    fine, coarse = (Supg.of(n, unit_vector(30.0)) for n in (6, 3))
    I = coarse.interpolation(fine.x)
    x, y = coarse.x.T
    np.testing.assert_allclose(I @ (x * y), np.prod(fine.x, axis=1), atol=1e-14)
    advection = Advection(n=6, parametrization="raw")
    p = advection.parameters.start.copy()
    A, *_ = advection.inconsistent_adjoint(Model(advection).solve(p).u, p, "mesh")
    centres = advection.supg.centres
    means = [p[(np.abs(centres - c) < 0.17).all(axis=1)].mean() for c in coarse.centres]
    w = np.random.default_rng(1).standard_normal(len(coarse.free))
    expected = coarse.tangent(np.array(means)).T @ w
    np.testing.assert_allclose(A @ w, expected, atol=1e-12)


def test_the_adjoint_advection_is_that_of_its_own_equation() -> None:
    """(w, -b . grad lam) + the outflow's (w, b . n lam) = C^T by parts: what the boundary condition stands for."""
    n, b = 6, unit_vector(30.0)
    supg = Supg.of(n, b)
    backwards = Supg.of(n, -b)
    C_T = supg.pattern.assemble(np.broadcast_to(supg.C.T, (n * n, 4, 4))).full()
    np.testing.assert_allclose(backwards.C, -supg.C, atol=1e-15)
    inside = supg.pattern.assemble(np.broadcast_to(-supg.C, (n * n, 4, 4))).full()
    lam = np.prod(supg.x, axis=1)  # bilinear, 0 at the inflow: no discretization error
    outflow = (C_T - inside) @ lam
    b_n = b[0] * np.isclose(supg.x[:, 0], 1.0) + b[1] * np.isclose(supg.x[:, 1], 1.0)
    assert np.abs(outflow[b_n == 0.0]).max() <= 1e-15
    at_inflow = 1.0 / (6.0 * n**2)  # of the node of each side that the flow enters by, too
    assert outflow.sum() == pytest.approx(b.sum() * (1.0 / 2.0 - at_inflow))  # int over x = 1 and y = 1 of b . n x y


def test_refined_is_the_same_on_half_the_mesh_size() -> None:
    coarse = Advection(n=3, angle=50.0, unknown="source", alpha=0.1, sensors="everywhere")
    fine, _ = coarse.refined(coarse.parameters.start)
    assert (fine.n, fine.alpha, fine.on_outflow) == (6, 0.1, False)
    assert fine.supg.h == pytest.approx(coarse.supg.h / 2)
    np.testing.assert_allclose(fine.supg.b, coarse.supg.b)
    np.testing.assert_allclose(fine.parameters.start, plume(fine.parameters.position, fine.supg.b))
    assert fine.parameters.position.shape == (36, 2)


@pytest.mark.parametrize("sensors", ["outflow", "everywhere"])
def test_the_sum_over_nodes_approaches_the_integral(sensors: str) -> None:
    differences = []
    for n in (8, 16, 32, 64):
        advection = Advection(n=n, sensors=sensors, alpha=0.01)
        p = advection.parameters.start
        u = solved(advection, p)
        J, (integral, by_u) = float(advection.objective(u, p)), advection.integral(u, p)
        differences.append(abs(J - integral) / J)
        v = np.random.default_rng(0).standard_normal(len(u))
        slope = (advection.integral(u + v, p)[0] - advection.integral(u - v, p)[0]) / 2.0  # exact: it is quadratic
        assert by_u @ v == pytest.approx(slope, rel=1e-11)
    assert 0.01 < differences[0] < 0.5
    assert (rates(differences) > 0.8).all()


def test_the_mass_of_the_outflow_is_its_length() -> None:
    assert Advection(n=5, angle=0.0).supg.mass(True).sum() == pytest.approx(1.0)
    assert Advection(n=5, angle=180.0, sensors="everywhere").supg.mass(False).sum() == pytest.approx(1.0 - 2 / 15)


@pytest.mark.parametrize("unknown", ["diffusivity", "source"])
def test_a_twin_starts_where_nothing_is_known_and_ends_at_its_truth(unknown: str) -> None:
    blank = Advection(n=6, unknown=unknown, data="twin")
    with pytest.raises(InputError, match="solve for them"):
        blank.objective(np.zeros(blank.n_state), blank.parameters.start)
    advection = with_synthetic_data(blank)
    assert np.ptp(advection.parameters.start) == 0.0
    assert Model(advection).value(advection.truth()) < 1e-24 < Model(advection).value(advection.parameters.start)
    noisy = with_synthetic_data(Advection(n=6, unknown=unknown, data="twin", noise=0.1, seed=3))
    assert 0.03 < rms(noisy.d - advection.d) < 0.2  # 11 draws
    assert Advection().truth() is None


def test_the_inclusion_diffuses_four_times_as_much() -> None:
    at = np.array([[0.5, 0.5], [0.5, 0.74], [0.26, 0.5], [0.5, 0.76], [0.0, 1.0]])
    np.testing.assert_array_equal(inclusion(at), [4.0, 4.0, 4.0, 1.0, 1.0])
    np.testing.assert_array_equal(inclusion(at[3:]), [4.0, 1.0])  # the nearest point, outside the disc


@pytest.mark.parametrize("unknown", ["diffusivity", "source"])
def test_fields_are_for_a_viewer(unknown: str) -> None:
    advection = Advection(n=3, unknown=unknown)
    p, u = advection.parameters.start, np.arange(advection.n_state) + 1.0
    fields = advection.fields(p, u, -u, np.ones(9))
    name = "f" if unknown == "source" else "kappa"
    assert set(fields.cell_data) == {name, f"dJ_d{name}"}
    np.testing.assert_allclose(fields.cell_data[f"dJ_d{name}"], 1.0 if unknown == "source" else np.exp(-p))
    assert (fields.point_data["u"] == 0.0).sum() == 7  # at the inflow
    np.testing.assert_allclose(fields.point_data["lambda"], -fields.point_data["u"])
    a, b, c = (fields.points[fields.cells[:, k]] for k in range(3))
    assert (np.cross(b - a, c - b)[:, 2] > 0).all()
    assert set(advection.view(p, u, None).columns) == {"x", "y", name}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"n": 0}, "n=0"),
        ({"n": 3001}, "n=3001"),
        ({"kappa": 0.0}, "kappa=0"),
        ({"kappa": -1.0}, "kappa=-1"),
        ({"kappa": np.nan}, "kappa=nan"),
        ({"kappa": 1e300}, "to 1e+12"),
        ({"angle": np.inf}, "angle=inf"),
        ({"alpha": -1.0}, "alpha=-1"),
        ({"alpha": np.nan}, "alpha=nan"),
        ({"noise": 0.1}, "data=twin"),
        ({"noise": -0.1, "data": "twin"}, "noise=-0.1"),
        ({"seed": -1}, "seed=-1"),
        ({"unknown": "source", "parametrization": "log"}, "not of a source"),
    ],
)
def test_bad_options_of_advection_are_one_line(options: dict, says: str) -> None:
    with pytest.raises(InputError, match=r"^advection: .* - ") as caught:
        Advection(**options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
