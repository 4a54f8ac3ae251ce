"""Measured displacements as boundary values, and the force as a datum: closed forms, gradients, what is refused."""

from __future__ import annotations

import copy
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import relative_error
from test_plate import complex_gradient

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.fit import fit
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.inversion.objective import Evaluation
from gradient_routes.problems.block import Block
from gradient_routes.problems.data.boundary_values import BoundaryValues
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.solid import Solid
from gradient_routes.problems.plate import Plate
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.measured_start import with_measured_start
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity
from gradient_routes.routes.tangent import tangent

TIGHT = Solver(rtol=1e-14)
E, NU, STRESS, DEPTH = 200e9, 0.3, 100e6, 1e-3
STRIP: dict[str, Any] = {
    "nx": 3,
    "ny": 2,
    "size": "0.08,0.02",
    "thickness": DEPTH,
    "clamped": "left",
    "loaded": "right",
}
STRIP |= {"derivatives": "hand", "boundary": "measured", "direction": "normal", "unknown": "constants"}
GRIP = STRIP | {"load": "displacement"}
FORCE = STRESS * 0.02 * DEPTH


def points(seed: int = 0) -> np.ndarray:
    """A grid in the strip, 0.5 mm from its edges, a little out of order."""
    rng = np.random.default_rng(seed)
    x = np.stack(np.meshgrid(np.linspace(5e-4, 0.0795, 17), np.linspace(5e-4, 0.0195, 7)), axis=-1).reshape(-1, 2)
    return x + 1e-4 * rng.uniform(-1.0, 1.0, x.shape)


def strip_data(folder: Path, loads: tuple[float, ...] = (), noise: float = 0.0, moved: float = 1.0) -> str:
    """u of uniaxial stress, of a specimen that has moved and turned; a column of forces for several loads."""
    lines, rng = [], np.random.default_rng(1)
    for k, load in enumerate(loads or (FORCE,)):
        x = points(k)
        u = x * [STRESS / E, -NU * STRESS / E] * (load / FORCE) + noise * rng.standard_normal(x.shape)
        u += moved * (np.array([18e-6, -2e-6]) + 4e-5 * np.stack([x[:, 1], -x[:, 0]], axis=1))
        last = f",{load!r}" if loads else ""
        lines += [f"{a!r},{b!r},{ua!r},{ub!r}{last}" for a, b, ua, ub in np.c_[x, u].tolist()]
    header = "x [m],y [m],ux [m],uy [m]" + (",load [N]" if loads else "")
    (folder / "strip.csv").write_text("\n".join([header, *lines]))
    return str(folder / "strip.csv")


# --- values at the nodes of a face


def test_linear_fields_and_data_at_nodes_are_met_exactly() -> None:
    rng = np.random.default_rng(0)
    for dim in (2, 3):
        x, G = rng.uniform(size=(200, dim)), rng.standard_normal((dim, dim))
        X = rng.uniform(-0.02, 1.02, size=(20, dim))
        found = BoundaryValues.of(X, x, 0.3 + x @ G, 0.0, "test")
        np.testing.assert_allclose(found.values, 0.3 + X @ G, atol=1e-11)
        d = rng.standard_normal(x.shape)
        found = BoundaryValues.of(x[:5], x, d, 2.0, "test")
        np.testing.assert_allclose(found.values, d[:5], atol=1e-9)
        assert found.used.tolist() == [0, 1, 2, 3, 4]
        assert found.sigma == pytest.approx(2.0)
        assert found.gap == 0.0


def test_points_on_a_line_tell_values_on_it() -> None:
    x = np.stack([np.full(9, 0.5), np.linspace(0.0, 1.0, 9)], axis=1)
    found = BoundaryValues.of(np.array([[0.5, 0.3], [0.5, 1.05]]), x, x[:, 1:] * [2.0, 3.0], 0.0, "test")
    np.testing.assert_allclose(found.values, [[0.6, 0.9], [2.1, 3.15]], rtol=1e-12)


def test_the_noise_of_values_is_that_of_sampled_ones() -> None:
    rng = np.random.default_rng(0)
    x, X = rng.uniform(size=(50, 2)), np.array([[0.5, 0.5]])
    found = BoundaryValues.of(X, x, np.zeros(x.shape), 0.1, "test").sigma
    draws = [BoundaryValues.of(X, x, 0.1 * rng.standard_normal(x.shape), 0.1, "test").values for _ in range(400)]
    assert np.std(draws) == pytest.approx(found, rel=0.15)  # 5 standard deviations of 1 / sqrt(2 800)


# --- the force as a datum


def test_a_strip_tells_E_and_nu_by_its_force(tmp_path: Path) -> None:
    """Its start, from the force alone, is E; at E and nu nothing is left of J."""
    plate = with_measured_start(Plate(**GRIP, force=FORCE, data=strip_data(tmp_path)))
    p = plate.parameters.start
    u = Model(plate, TIGHT).solve(p).u
    seen = plate.observation(u, p)
    assert plate.objective(u, p) < 1e-5 * np.sum(seen.data**2)  # strains of 5e-4 are not small to neo-Hookean rubber
    assert [plate.stated(p)[name] for name in ("E [Pa]", "nu")] == pytest.approx([E, NU], rel=1e-3)
    assert plate.data.force.reaction.value(u, p, 0) == pytest.approx(FORCE, rel=1e-6)
    assert (seen.label(len(seen.data) - 1), np.isnan(seen.position[-1]).all()) == ("force", True)
    said = " ".join(plate.read_as)
    assert re.search(
        r"boundary: 6 nodes take the displacements of \d+ points about them, the nearest up to 0\.000", said
    )
    assert "not stated, is in no error bar" in said
    assert "force: 2000 N along (1, 0) on the loaded face, +- 20 N (1 % of it; force_noise= states another)" in said
    found = fit(plate, Evaluation(p, p, 0.0, p, p), TIGHT)
    assert found.constants.thirds["E [Pa]"] == pytest.approx([E] * 3, rel=1e-2)  # the force belongs to each third


def test_a_traction_on_a_moved_specimen_tells_its_start(tmp_path: Path) -> None:
    plate = with_measured_start(Plate(**STRIP, traction=STRESS, data=strip_data(tmp_path)))
    assert plate.stated(plate.parameters.start)["E [Pa]"] == pytest.approx(E, rel=2e-3)


@pytest.mark.parametrize(
    "options",
    [
        GRIP | {"force_noise": "5 N", "noise": 1e-7, "motion": "rigid"},
        STRIP | {"unknown": "modulus", "force": None, "data": None},
        {"nx": 2, "ny": 1, "law": "linear", "unknown": "modulus", "derivatives": None},
        GRIP | {"constants": "E,nu"},
    ],
    ids=["by hand", "traction", "by JAX", "E,nu"],
)
def test_exact_routes_agree_with_complex_steps(options: dict[str, Any], tmp_path: Path) -> None:
    """Two loads, each with its boundary values and its force; by JAX, which compiles each, one."""
    by_jax = options["derivatives"] is None
    loads = (FORCE,) if by_jax else (1000.0, FORCE)
    plate = Plate(**GRIP | options | {"data": strip_data(tmp_path, loads), "modulus": E})
    parameters = plate.parameters
    p = parameters.start + 0.05 * parameters.scale * np.random.default_rng(0).uniform(-1.0, 1.0, len(parameters))
    model, exact = Model(plate, TIGHT), complex_gradient(plate, p)
    for route in (adjoint, implicit_ad) if by_jax else (adjoint, tangent):
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12, route.name
    state = model.solve(p)
    seen = plate.observation(state.u, p)
    r = seen.predicted - seen.data
    assert 0.5 * r @ r == pytest.approx(state.J, rel=1e-12)
    assert relative_error(Sensitivity(model, state).T @ r, exact) < 1e-12
    if not by_jax:
        assert sum(Model(case, TIGHT).solve(p).J for case in plate.load_cases()) == pytest.approx(state.J, rel=1e-9)


@pytest.mark.parametrize("motion", ["none", "rigid"])
def test_noise_of_boundary_values_goes_into_readings_as_differences_say(motion: Any, tmp_path: Path) -> None:
    """Along one random change of all of them; readings are nearly linear in them."""
    data, noise = strip_data(tmp_path, (1000.0, FORCE)), 1e-7
    plate = Plate(**GRIP, constants="E,nu", modulus=E, data=data, noise=noise, motion=motion, fixed="y@bottom")
    p, rng = plate.parameters.start, np.random.default_rng(0)
    by_p = Sensitivity(Model(plate, TIGHT), Model(plate, TIGHT).solve(p))
    u, w = by_p.R_u.state.u, rng.standard_normal(by_p.shape[0])
    exact = plate.taken_as_exact(u, p)
    pulled = exact.pulled(w, by_p.R_u.solve_transposed(np.asarray(by_p.seen.S_u.T @ w)))
    b, changes, at = rng.standard_normal(len(pulled)), np.zeros((2, len(plate.solid.bc.known), 2)), 0
    for case, of in enumerate(plate.boundary):
        for i, root in enumerate(of.root):
            changes[case, :, i] = root @ b[at : at + root.shape[1]]
            at += root.shape[1]
    read = [float(w @ moved(plate, sign * changes.reshape(2, -1), p)) for sign in (1.0, -1.0)]
    assert pulled @ b == pytest.approx((read[0] - read[1]) / 2.0, rel=1e-8)


def moved(plate: Plate, change: np.ndarray, p: np.ndarray) -> np.ndarray:
    """The readings with other boundary values."""
    other, data, bc = copy.copy(plate), plate.data, plate.solid.bc
    other.solid = replace(plate.solid, bc=replace(bc, values=bc.values + change))
    force = replace(data.force, reaction=replace(data.force.reaction, solid=other.solid))
    other.data = replace(data, solid=other.solid, force=force)
    return other.observation(Model(other, TIGHT).solve(p).u, p).predicted


def test_noise_of_boundary_values_widens_error_bars(tmp_path: Path) -> None:
    """60 draws of noise scatter E by 2.9e9 and nu by 0.017, with an error of a tenth."""
    given = {"noise": 4e-7, "force": FORCE, "force_noise": "20 N", "constants": "E,nu", "modulus": E}
    plate = Plate(**GRIP, data=strip_data(tmp_path), **given)
    p = plate.parameters.start
    bars, known = [], plate.boundary
    for plate.boundary in ((), known):
        found = fit(plate, Evaluation(p, p, 0.0, p, p), TIGHT)
        bars.append([*found.constants.sd, *found.sd])
    assert bars[0][:2] == pytest.approx([2.0e9, 0.0132], rel=0.02)
    assert bars[1][:2] == pytest.approx([2.75e9, 0.0152], rel=0.02)
    assert np.array(bars[1]) / bars[0] == pytest.approx(np.tile(np.divide(bars[1], bars[0])[:2], 2))
    assert any("is in the error bars" in note for note in plate.notes)


def test_boundary_values_at_nodes_give_back_the_body_that_made_them(tmp_path: Path) -> None:
    """A block of layers under traction, read at all its nodes: the same with known faces and the force of the grip."""
    options: dict[str, Any] = {"n": 3, "unknown": "layers", "layers": 3, "derivatives": "hand", "force": 0.2}
    made, p = Block(**options), np.array([0.1, -0.2, 0.3])
    nodes = np.arange(len(made.mesh.geometry.X))
    U = made.solid.displacements(Model(made, TIGHT).solve(p).u, made.solid.setup(p), 0, nodes)
    rows = [",".join(map(repr, row)) for row in np.c_[made.mesh.geometry.X, U].tolist()]
    (tmp_path / "d.csv").write_text("\n".join(["x,y,z,ux,uy,uz", *rows]))
    block = Block(**options, boundary="measured", load="displacement", data=str(tmp_path / "d.csv"), modulus=1.0)
    u = Model(block, TIGHT).solve(p).u
    assert len(block.data.probes[0].x) == 32
    assert block.objective(u, p) < 1e-22
    assert block.fields(p, u, u, p).point_data["u"][nodes] == pytest.approx(U, abs=1e-9)
    assert not block.fields(p, u, u, p).point_data["lambda"][block.mesh.boundary("top").node_set].any()


def test_a_window_may_be_measured_all_round(tmp_path: Path) -> None:
    """Its faces are not free: only the nodes inside are left."""
    inside = GRIP | {"size": "0.06,0.016", "columns": "x:x - 10mm,y:y - 2mm", "clamped": "left,top,bottom"}
    plate = Plate(**inside, outside="drop", data=strip_data(tmp_path), modulus=E)
    assert plate.n_state == 2 * 2  # of 4 x 3 nodes
    p = plate.parameters.start
    r = plate.observation(Model(plate, TIGHT).solve(p).u, p)
    assert np.abs(r.predicted - r.data).max() < 1e-7  # what is not small at strains of 5e-4


def test_without_a_force_what_is_not_told_is_said(tmp_path: Path) -> None:
    plate = Plate(**GRIP, data=strip_data(tmp_path))
    assert "displacements alone tell ratios of moduli; their size stays that of the start: give force=" in plate.notes
    assert (plate.start_from_data, plate.scaled(plate.parameters.start, 2.0)) == (False, None)


@pytest.mark.parametrize("optimizer", ["gauss-newton", "levenberg-marquardt"])
def test_what_displacements_do_not_tell_stays_at_its_start_and_is_marked(optimizer: Any, tmp_path: Path) -> None:
    """Rounding, 1e-16 of the slope by nu, had moved E by decades."""
    data = strip_data(tmp_path, noise=1e-6)
    plate = Plate(**GRIP | {"derivatives": "hand"}, constants="E,nu", modulus=2.0, data=data)
    spec, route = problems(["plate[derivatives=hand]"])[0], routes(["adjoint"])[0]
    ended = invert(spec, route, Engine(optimizer), made=plate)
    assert ended.end.startswith("converged")
    assert ended.p[0] == pytest.approx(np.log(2.0), abs=1e-12)
    assert plate.stated(ended.p)["nu"] == pytest.approx(NU, abs=0.1)
    assert ended.view.blind.tolist() == [True, False]


REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "uncovered nodes": (
        {"size": "0.08,0.05"},
        "2 of 6 nodes have no point near, at (0, 0.05), (0.08, 0.05): up to",
    ),
    "no face": (
        STRIP | {"clamped": "none", "fixed": "x@left,y@bottom"},
        "clamped=none and load=traction is of no face",
    ),
    "no file": ({"data": "twin"}, "boundary needs data=FILE"),
    "a grip's displacement": ({"displacement": 1e-3}, "displacement does not go with boundary=measured"),
    "an unknown grip": ({"unknown": "load", "derivatives": None}, "the displacements of the grip are known"),
    "no force": ({"force": 0.0}, "force=0 tells no modulus"),
    "no noise": ({"force": 1.0, "force_noise": 0.0}, "force_noise=0.0 - give a standard deviation > 0"),
    "a noise in m": ({"force": 1.0, "force_noise": "1mm"}, "'mm' is a unit of length, not of force"),
    "noise of nothing": ({"force_noise": 1.0}, "force_noise= is that of force=, which is not given"),
    "noise of a load": (
        STRIP | {"force": 1.0, "force_noise": 1.0},
        "force_noise needs load=displacement and data=FILE",
    ),
    "a face that touches": ({"force": 1.0, "clamped": "bottom"}, "one that does not touch"),
    "a face of no area": (
        {"boundary": "zero", "kind": "axisymmetric", "loaded": "left", "load": "displacement", "force": 1.0},
        "one that does not touch",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_one_line(name: str, tmp_path: Path) -> None:
    options, says = REFUSED[name]
    with pytest.raises(InputError, match=re.escape(says)) as refused:
        Plate(**({"data": strip_data(tmp_path)} | (options if "boundary" in options else GRIP | options)))
    assert "\n" not in str(refused.value)


def test_files_without_data_inside_or_on_the_boundary_or_with_other_loads_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    at_ends = [f"{x},{y},0,0" for x in (0.0, 0.08) for y in (0.0, 0.01, 0.02)]
    for header, rows, says in (
        ("x,y,ux,uy", at_ends, "all points tell boundary=measured, none is left as a datum"),
        ("x,y,ux,uy", [at_ends[0], "0.04,0.01,0,"], "1 points measure all components of u"),
        (
            "x,y,ux,uy,load",
            [f"{row},1" for row in at_ends] + ["0.04,0.01,0,0,1"],
            "a column load is the force on right",
        ),
    ):
        path.write_text("\n".join([header, *rows]))
        with pytest.raises(InputError, match=re.escape(says)):
            Plate(**GRIP, data=str(path))
    path.write_text("\n".join(["x,y,ux,uy,load", *(f"{row},{k}" for row in at_ends for k in (1, 2))]))
    with pytest.raises(InputError, match="force= is that of one load case"):
        Plate(n=1, load="displacement", force=1.0, data=str(path))


def test_a_grip_of_known_displacement_has_a_force_as_well(tmp_path: Path) -> None:
    """A bar of 1 m under 1 % strain, free across: F = E A u / L."""
    (tmp_path / "d.csv").write_text("x,y,ux,uy\n0.5,0.5,-0.00015,0.0005\n1,0.5,-0.0003,0.0005\n")
    body = {"n": 1, "clamped": "none", "fixed": "y@bottom,x@left", "load": "displacement", "displacement": 0.001}
    plate: Solid = with_measured_start(Plate(**body, derivatives="hand", force=2.5, data=str(tmp_path / "d.csv")))
    held = with_measured_start(Plate(**body, derivatives="hand", data=str(tmp_path / "d.csv"), modulus=2500.0))
    F = plate.data.force.reaction
    u = Model(held).solve(held.parameters.start).u
    assert np.exp(plate.parameters.start[0]) * F.value(u, held.parameters.start, 0) == pytest.approx(
        2500.0 * 2.5, rel=1e-6
    )
