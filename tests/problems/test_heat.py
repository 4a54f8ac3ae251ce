"""Heat conduction in time: closed forms, an integrator that is not ours, gradients by every route, histories, files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROUTES, relative_error
from scipy.integrate import solve_ivp

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.verification.contract import of_problem
from gradient_routes.problems.conduction import Heat
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

SCHEMES = ("backward-euler", "crank-nicolson")
STATED = {
    "size": "100mm", "density": 7800.0, "heat_capacity": 470.0, "ambient": "20degC", "base": "100degC", "film": 100.0,
}  # fmt: skip
FILE = """t [min],x [mm],y [mm],T [degC]
0,30,30,20.4
0.3,30,30,22
0.9,30,30,30
2.5,30,30,36
0.5,70,50,21
1,70,50,23
2.2,70,50,33
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("heat") / "h.csv"
    path.write_text(FILE)
    return str(path)


def recorded(file: str, **options: Any) -> Heat:
    """Steps of 30 s, and data between them."""
    defaults = {"n": 2, "steps": 5, "unknown": "diffusivity+initial", "parts": 2}
    return Heat(data=file, **STATED | defaults | options)


def marched(heat: Heat, p: Array | None = None) -> Array:
    """(T, n_u) [K]."""
    p = heat.parameters.start if p is None else p
    return Model(heat).solve(p).u.reshape(heat.steps, -1)


# --- the equations


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_mode_decays_as_its_closed_form(scheme: Any) -> None:
    """cos(pi x) cos(pi y) of an insulated square is a mode of the bilinear elements with lumped mass, too.

    Its rate is 2 a lambda mu: lambda = 4 sin(pi h/2)^2 / h^2 along one axis, the mean mu = (2 + cos pi h)/3 along the
    other. Means of parts are the mode times cos(pi h/2)^2.
    """
    n, dt, a = 4, 60.0, 50.0 / (7800.0 * 470.0)
    heat = Heat(n=n, steps=6, dt=dt, base="free", exposed="none", unknown="initial", parts=n, scheme=scheme, size=1.0)
    x, y = heat.parameters.position.T
    u = marched(heat.twin(), heat.body.T_inf + 1e3 * np.cos(np.pi * x) * np.cos(np.pi * y))
    x, y = heat.solid.mesh.geometry.X.T
    rate = 2.0 * a * (2.0 * n * np.sin(np.pi / (2 * n))) ** 2 * (2.0 + np.cos(np.pi / n)) / 3.0
    assert rate == pytest.approx(2.0 * a * np.pi**2, rel=0.2)  # the continuous one, O(h^2)
    w = 1.0 if scheme == "backward-euler" else 0.5
    decay = (1.0 - (1.0 - w) * rate * dt) / (1.0 + w * rate * dt)
    mode = 1e3 * np.cos(np.pi * x) * np.cos(np.pi * y) * np.cos(np.pi / (2 * n)) ** 2
    np.testing.assert_allclose(u, mode * decay ** np.arange(1, 7)[:, None], atol=1e-10)


@pytest.mark.parametrize(("scheme", "order"), [*zip(SCHEMES, (1.0, 2.0), strict=True)])
def test_the_march_converges_to_that_of_a_fine_integrator(scheme: Any, order: float) -> None:
    """A slab of three elements, heated by its base and a source, that loses heat at its end: SciPy's DOP853 on
    rho c dx T_i' = .., written out here per m2.
    """
    k, rho_c, h, f, L, end, off = 50.0, 7800.0 * 470.0, 300.0, 2e5, 0.1, 240.0, []
    dx = L / 3
    K = k / dx * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]]) + np.diag([0.0, 0.0, h])
    m, q = rho_c * dx * np.array([1.0, 1.0, 0.5]), f * dx * np.array([1.0, 1.0, 0.5])
    q[0] += k / dx * 80.0
    exact = solve_ivp(lambda t, u: (q - K @ u) / m, (0.0, end), np.full(3, 30.0), "DOP853", rtol=1e-10, atol=1e-9).y[
        :, -1
    ]
    slab = {"n": 3, "ny": 1, "size": L, "film": h, "source": f, "exposed": "right", "initial": "50degC"}
    for steps in (60, 120):
        heat = Heat(**slab, steps=steps, dt=end / steps, scheme=scheme).twin()
        u = marched(heat)[-1].reshape(-1)
        x = heat.solid.mesh.geometry.X[heat.solid.free, 0]
        off.append(np.abs(u - exact[np.rint(x / dx).astype(int) - 1]).max())
    assert np.log2(off[0] / off[1]) == pytest.approx(order, abs=0.1)
    assert off[1] < (0.3 if order == 1.0 else 1e-2)


def test_a_source_heats_an_insulated_body_evenly() -> None:
    heat = Heat(n=2, ny=4, size="0.2,0.1", steps=3, dt="0.5min", base="free", exposed="none", unknown="source")
    u = marched(heat.twin())
    np.testing.assert_allclose(u, np.outer(1e5 / (7800.0 * 470.0) * 30.0 * np.arange(1, 4), np.ones(15)), rtol=1e-12)


@pytest.mark.parametrize("name", ["diffusivity", "film", "source", "initial"])
def test_the_gradient_of_parts_adds_up_to_that_of_the_whole(name: Any) -> None:
    options = {"n": 2, "steps": 3, "base": "free", "initial": 350.0, "source": 1e5, "unknown": name}
    whole, parted = (with_synthetic_data(Heat(**options)), Heat(**options, parts=2))
    parted.histories = whole.histories
    one, many = (adjoint.prepare(Model(heat), p)(p) for heat in (whole, parted) for p in [heat.parameters.start])
    assert len(many.gradient) == (8 if name == "film" else 4)
    assert many.J == pytest.approx(one.J, rel=1e-12)
    assert many.gradient.sum() == pytest.approx(one.gradient[0], rel=1e-11)
    pairs = parted.unknowns.neighbours
    assert len(pairs) == len(many.gradient)  # both a square of parts and the way round it are closed


def test_matrices_are_those_that_scikit_fem_assembles() -> None:
    from skfem import Basis, BilinearForm, ElementQuad1, FacetBasis, LinearForm
    from skfem.helpers import dot, grad

    solid = Heat(n=3, ny=2, size="0.3,0.1", exposed="right,top").solid
    mesh, k, h = solid.mesh.skfem_mesh, 50.0, 20.0
    cells = Basis(mesh, ElementQuad1())
    sides = FacetBasis(mesh, ElementQuad1(), facets=mesh.facets_satisfying(lambda x: (x[0] == 0.3) | (x[1] == 0.1)))
    K = BilinearForm(lambda u, v, _: k * dot(grad(u), grad(v))).assemble(cells)
    K = (K + BilinearForm(lambda u, v, _: h * u * v).assemble(sides)).toarray()[np.ix_(solid.free, solid.free)]
    found = solid.matrix(np.full(6, k), np.full(5, h), 0.0).full().toarray()
    np.testing.assert_allclose(found, K, atol=1e-13 * k)
    volume = LinearForm(lambda v, _: 1.0 * v).assemble(cells)[solid.free]
    np.testing.assert_allclose(solid.volume, volume, rtol=1e-13)


def test_fields_show_the_last_temperatures_and_what_parts_are_made_of() -> None:
    heat = with_synthetic_data(Heat(n=2, steps=2, unknown="diffusivity+film", parts=2))
    p = heat.parameters.start + 0.1 * np.arange(10)
    found = adjoint.prepare(Model(heat), p)(p)
    shown = heat.fields(p, found.u, found.lam, found.gradient)
    assert shown.cell_data.keys() == {"diffusivity", "dJ_dlog_a"}
    np.testing.assert_array_equal(shown.cell_data["diffusivity"], np.exp(p[:4])[heat.solid.cell_part])
    T, x = shown.point_data["T"], shown.points[:, 0]
    assert (T[x == 0.0] == 373.15).all()
    np.testing.assert_allclose(T[x > 0.0], 293.15 + found.u.reshape(2, -1)[-1])


# --- gradients


def test_every_route_gives_the_gradient_of_complex_steps(file: str) -> None:
    """Data lie between steps and at t = 0: the initial state is read, too."""
    heat = recorded(file, alpha=10.0)
    model, p = Model(heat), heat.parameters.start + 0.01 * heat.parameters.scale
    exact = complex_step.prepare(model, p)(p).gradient
    for route in ROUTES:
        found = route.prepare(model, p)(p)
        assert relative_error(found.gradient, exact) < (route.accuracy or 1e-12), route.name


VARIANTS: dict[str, dict[str, Any]] = {
    "film": {"unknown": "film+initial", "parts": 2, "alpha": 10.0, "parametrization": "raw"},
    "source": {"unknown": "diffusivity+source", "scheme": "crank-nicolson", "base": "free"},
    "variation": {"unknown": "film+source", "parts": 2, "alpha": 10.0, "phi": "tv"},
}


@pytest.mark.parametrize("name", VARIANTS)
def test_exact_routes_give_the_gradient_of_complex_steps(name: str) -> None:
    """What is traced is held against NumPy: R and J of the contract."""
    heat = with_synthetic_data(Heat(n=2, steps=2, **VARIANTS[name]))
    model, p = Model(heat), heat.parameters.start + 0.01 * heat.parameters.scale
    exact = complex_step.prepare(model, p)(p).gradient
    for route in (tangent, adjoint):
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12, route.name
    assert not of_problem(heat, p, [], Solver()).broken


def test_checkpoints_change_memory_and_steps_not_the_gradient(file: str) -> None:
    heat = recorded(file)
    model, p = Model(heat), heat.parameters.start
    kept = adjoint.prepare(model, p, checkpoint="all")(p).gradient
    for checkpoint in ("none", "sqrt", "every=2", "revolve=2"):
        assert np.array_equal(adjoint.prepare(model, p, checkpoint=checkpoint)(p).gradient, kept), checkpoint
    assert relative_error(kept, adjoint.prepare(model, p)(p).gradient) < 1e-13


def test_a_step_keeps_the_contract(file: str) -> None:
    """What was read before it among its parameters and unknowns."""
    heat = recorded(file, alpha=1.0)
    q = np.concatenate([marched(heat)[1], heat.parameters.start])
    assert not of_problem(heat.at(3), q, [adjoint], Solver()).broken


# --- histories


@pytest.fixture(scope="module")
def linear(file: str) -> tuple[Heat, Array]:
    """A state that is bilinear in space and linear in time, with what is read before every step."""
    heat = recorded(file)
    x, y = heat.solid.mesh.geometry.X[heat.solid.free].T
    field = lambda t, x, y: 80.0 * (1.0 - x / 0.1) + (t + 5.0) * x * (1.0 + 8.0 * y)  # noqa: E731
    before = [field(30.0 * t, *heat.probe.x.T) for t in range(5)]
    U = [np.concatenate([field(30.0 * (t + 1), x, y), before[t]]) for t in range(5)]
    return heat, np.concatenate(U)


def test_data_are_read_between_nodes_and_between_steps(linear: tuple[Heat, Array]) -> None:
    heat, U = linear
    t = 60.0 * np.array([0.0, 0.3, 0.9, 2.5, 0.5, 1.0, 2.2])
    x, y = np.array([[0.03, 0.03]] * 4 + [[0.07, 0.05]] * 3).T
    seen = heat.observation(U, heat.parameters.start)
    np.testing.assert_allclose(seen.predicted, 80.0 * (1.0 - x / 0.1) + (t + 5.0) * x * (1.0 + 8.0 * y), rtol=1e-13)
    np.testing.assert_allclose(seen.data, [0.4, 2.0, 10.0, 16.0, 1.0, 3.0, 13.0])
    assert (seen.label(1), seen.label(6)) == ("T at (0.03, 0.03) at 18 s", "T at (0.07, 0.05) at 132 s")
    assert seen.position.shape == (7, 3)


def test_the_observation_makes_up_the_objective(linear: tuple[Heat, Array]) -> None:
    heat, U = linear
    p = heat.parameters.start
    seen = heat.observation(U, p)
    r = seen.predicted - seen.data
    assert 0.5 * r @ r == pytest.approx(heat.objective(U, p), rel=1e-13)
    np.testing.assert_allclose(seen.S_u.T @ r, heat.linearize(U, p).J_u, rtol=1e-12, atol=1e-12)
    assert len({heat.candidates().label(k) for k in range(len(heat.candidates().at))}) == 5 * 6


def test_units_of_a_file_and_a_file_in_si_are_one_problem(file: str, tmp_path: Path) -> None:
    rows = [line.split(",") for line in FILE.splitlines()[1:]]
    si = [f"{60.0 * float(t)!r},{float(x) / 1e3!r},{float(y) / 1e3!r},{float(T) + 273.15!r}" for t, x, y, T in rows]
    (tmp_path / "si.csv").write_text("\n".join(["Time,X,Y,Temperature", *si]))
    one, other = (recorded(path) for path in (file, str(tmp_path / "si.csv")))
    p = one.parameters.start
    assert Model(other).value(p) == pytest.approx(Model(one).value(p), rel=1e-12)
    assert one.notes == (
        "read t in min, factor 60 / x, y in mm, factor 0.001 / T in degC, plus 273.15",
        "start: diffusivity=6.667e-05, initial=293.5",  # L^2 over 150 s, and the first datum
    )
    assert one.h == pytest.approx(30.0)  # to the last datum


def test_without_y_sensors_lie_half_way_up(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("t,x,T\n30,0.02,300\n60,0.02,310\n")
    heat = Heat(
        **STATED | {"base": 373.15, "ambient": 293.15}, n=2, ny=1, initial=293.15, steps=2, data=str(tmp_path / "x.csv")
    )
    assert "no column y: sensors at y = 0.05 m" in heat.notes
    assert not heat.held  # all data are of steps: no unknowns are added


@pytest.mark.parametrize("unknown", ["diffusivity+film", "initial"])
def test_gauss_newton_finds_what_made_the_data(unknown: str) -> None:
    (spec,) = problems([f"heat[n=4,steps=6,unknown={unknown}]"])
    ended = invert(spec, routes(["adjoint"])[0], Engine(optimizer="gauss-newton"))
    np.testing.assert_allclose(ended.p, spec().truth(), rtol=1e-8)


def test_doubtful_input_is_told(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("t,x,T\n30,0.02,21\n60,0.02,310\n")
    slab = {"n": 2, "ny": 1, "initial": "20degC", "steps": 2, "data": str(tmp_path / "x.csv")}
    assert (
        Heat(**STATED | slab).notes[0] == "1 of 2 data lie beyond 293.15 to 373.15 K, which no body does - check units"
    )
    for scheme, told in (("crank-nicolson", True), ("backward-euler", False)):
        assert any("alternate and keep 83% in a step" in note for note in Heat(scheme=scheme).notes) is told


BAD: dict[str, tuple[dict[str, Any], str]] = {
    "no steps": ({"steps": 0}, "steps=0 - choose 1 <= steps"),
    "fewer": ({"steps": -3}, "steps=-3"),
    "dt": ({"dt": 0.0}, "dt=0.0 - choose dt > 0"),
    "dt backwards": ({"dt": "-1min"}, "dt=-1min - choose dt > 0"),
    "dt in metres": ({"dt": "1mm"}, "'mm' is a unit of length, not of time"),
    "too long": ({"n": 100, "steps": 10**5}, "100000 steps of 10000 cells - choose at most"),
    "no cells": ({"n": 0}, "n=0"),
    "parts": ({"parts": 3}, "parts=3 with 8 x 8 cells"),
    "size": ({"size": "1,2,3"}, "size=1,2,3 - give one length or two"),
    "cold": ({"initial": -1.0}, "initial=-1.0 is -1 K"),
    "no heat": ({"base": "20degC"}, "no heat flows"),
    "side": ({"exposed": "front"}, "no side 'front'"),
    "base exposed": ({"exposed": "left"}, "T is given at x=0"),
    "no film": ({"exposed": "none", "unknown": "film"}, "no side loses heat"),
    "no source": ({"source": 0.0, "unknown": "source"}, "source=0 - choose"),
    "sensors": ({"sensors": 0}, "sensors=0"),
    "noise": ({"noise": "1mm"}, "not of temperature change"),
    "alpha": ({"alpha": 1.0}, "alpha needs parts"),
    "units": ({"units": "min"}, "units needs data=FILE"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_options_are_one_line(case: str) -> None:
    options, says = BAD[case]
    with pytest.raises(InputError) as caught:
        Heat(**options)
    assert says in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"


BAD_FILES: dict[str, tuple[str, dict[str, Any], str]] = {
    "not stated": (FILE, {"density": None}, "do not tell density - state what was measured"),
    "initial": (FILE, {"unknown": "diffusivity"}, "do not tell initial - state"),
    "no unit": (FILE, {"ambient": 20.0}, "ambient=20.0 has no unit, T of"),
    "outside": (FILE, {"dt": 20.0}, "line 5: t = 150 s is outside the march, from 0 to 100 s, as are 1 others"),
    "before": (FILE + "-1,80,80,20\n", {}, "line 9: t = -60 s is outside the march"),
    "backwards": (FILE + "1,30,30,33\n", {}, "line 9: t = 60 s at (0.03, 0.03) follows 150 s in line 5 - sort"),
    "again": (FILE + "2.2,70,50,33\n", {}, "line 9: t = 132 s at (0.07, 0.05) follows 132 s in line 8"),
    "off the body": (FILE + "1,120,30,33\n", {}, "data row 8 at (0.12, 0.03) lies outside heat"),
    "metres": (FILE.replace("mm", "m"), {}, "in mm beside a mesh in m"),
    "no time": (FILE.replace("t [min]", "when"), {}, "no column t; it has when"),
    "no sensor": ("t,x,y,T\n", {}, "no rows"),
    "at once": ("t,x,y,T\n0,0.03,0.03,300\n", {"base": 373.15, "ambient": 293.15}, "no datum is later than t = 0"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_files_are_one_line(case: str, tmp_path: Path) -> None:
    text, options, says = BAD_FILES[case]
    (tmp_path / "h.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        recorded(str(tmp_path / "h.csv"), **options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_commands_end_with_one_line(cli: Any, tmp_path: Path) -> None:
    (tmp_path / "h.csv").write_text(FILE)
    for options in ("steps=0", "dt=-1", f"data={tmp_path}/h.csv"):
        ran = cli("run", "--problem", f"heat[{options}]", "--route", "adjoint", "--no-store")
        assert (ran.code, ran.err.count("\n")) == (2, 1), options
