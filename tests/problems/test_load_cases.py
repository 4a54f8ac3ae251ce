"""Load cases of a data file: loads in every unit, rows and motion of each case, closed forms, gradients."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import relative_error
from test_plate import complex_gradient, stretches

from gradient_routes.bench.cases.case import problems, routes
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.problems.block import Block
from gradient_routes.problems.data.load_cases import MAX_CASES
from gradient_routes.problems.errors import InputError, NotOffered
from gradient_routes.problems.mechanics.solid import Solid
from gradient_routes.problems.plate import Plate
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity
from gradient_routes.routes.tangent import tangent

TIGHT = Solver(rtol=1e-14)
ROLLERS: dict[str, Any] = {"n": 1, "derivatives": "hand", "clamped": "none", "fixed": "x@left,y@bottom"}
FORCES = (0.1, 0.3)  # [N] on a plate of 1 m and 1 m thickness: tractions [Pa]
SHIFTS = ((0.01, 0.02), (-0.03, 0.04))
POINTS = np.array([[0.2, 0.9], [0.7, 0.4], [1.0, 0.6], [0.5, 1.0], [0.1, 0.1]])


def rows(load: str = "{:g}", shifted: bool = False) -> list[str]:
    """Of the closed form of E = 1, nu = 0.3 under FORCES, of other points in each case, the cases mixed."""
    found = []
    for k, force in enumerate(FORCES):
        u = POINTS[k:] * (np.array(stretches("plane-stress", force)) - 1.0) + (SHIFTS[k] if shifted else 0.0)
        found += [f"{x},{y},{ux},{uy}," + load.format(force) for (x, y), (ux, uy) in zip(POINTS[k:], u, strict=True)]
    return sorted(found)


def written(folder: Path, header: str, lines: list[str]) -> str:
    (folder / "d.csv").write_text("\n".join([header, *lines]))
    return str(folder / "d.csv")


@pytest.fixture
def mixed(tmp_path: Path) -> Plate:
    data = written(tmp_path, "x,y,ux,uy,load [N]", rows(shifted=True))
    return Plate(**ROLLERS, unknown="constants", data=data, motion="translation")


def test_each_case_has_its_load_its_rows_and_its_motion(mixed: Plate) -> None:
    p = mixed.parameters.start  # E = 1, nu = 0.3
    u = Model(mixed, TIGHT).solve(p).u
    assert mixed.objective(u, p) < 1e-28
    first = rows(shifted=True)[0].endswith(",0.1")  # the order of the file
    order = (0, 1) if first else (1, 0)
    found = mixed.data.moved(u, p)
    names = [f"{name}, case {k + 1}" for k in (0, 1) for name in ("ux [m]", "uy [m]")]
    assert tuple(found) == tuple(names)
    assert [*found.values()] == pytest.approx(-np.ravel([SHIFTS[k] for k in order]) * -1.0, abs=1e-12)
    counts = [(f"{FORCES[k]:g} ({5 - k} rows)") for k in order]
    assert mixed.read_as[1] == f"load cases by column load, N: {', '.join(counts)}"
    assert mixed.read_as[-1] == f"load of case {2 if first else 1}: 0.3 Pa on top, 1 m^2, in all (0, 0.3) N"


def test_exact_routes_agree_with_complex_steps(mixed: Plate) -> None:
    p = 1.2 * mixed.parameters.start
    exact = complex_gradient(mixed, p)
    for route in (tangent, adjoint):
        assert relative_error(route.prepare(Model(mixed, TIGHT), p)(p).gradient, exact) < 1e-12, route.name
    state = Model(mixed, TIGHT).solve(p)
    seen = mixed.observation(state.u, p)
    r = seen.predicted - seen.data
    assert relative_error(Sensitivity(Model(mixed, TIGHT), state).T @ r, exact) < 1e-12
    assert seen.label(0) != seen.label(len(r) - 1)
    assert seen.label(len(r) - 1).endswith(", case 2")
    assert seen.modes.shape == (18, 4)
    singles = [Model(case, TIGHT).solve(p).J for case in mixed.load_cases()]
    assert sum(singles) == pytest.approx(state.J, rel=1e-10)


@pytest.mark.parametrize(
    ("unit", "load", "options"),
    [
        ("", "{:g}", {"traction": 1.0}),
        (" [-]", "{:g}", {"force": 1.0}),
        (" [kN]", "{:g}e-3", {}),
        (" [MPa]", "{:g}e-6", {}),
    ],
)
def test_loads_are_told_by_their_unit(unit: str, load: str, options: dict[str, float], tmp_path: Path) -> None:
    plate = Plate(**ROLLERS, data=written(tmp_path, f"x,y,ux,uy,load{unit}", rows(load)), modulus=1.0, **options)
    assert plate.objective(Model(plate, TIGHT).solve(np.zeros(1)).u, np.zeros(1)) < 1e-28


def test_loads_may_be_displacements_of_a_grip_and_cases_have_names(tmp_path: Path) -> None:
    lines = ["0.5,0,0.5,1,50,a", "0.5,0,1,2,100,a", "0.5,0,0.5,3,150,b", "0.5,0,1,4,150,c"]
    data = written(tmp_path, "x,y,z,uz [mm],load [mm],Case", [*lines[:1], *lines[2:]])
    units = "x:m,y:m,z:m,uz:mm,load:mm"
    block = Block(n=1, nz=2, derivatives="hand", load="displacement", data=data, units=units, modulus=1.0)
    u = Model(block).solve(block.parameters.start).u
    grip = block.mesh.boundary("top").node_set
    for case, amount in enumerate((0.05, 0.15, 0.15)):
        U = block.solid.displacements(u, block.solid.setup(block.parameters.start), case, grip)
        assert U[:, 2] == pytest.approx(amount), case
    written(tmp_path, "x,y,z,uz [mm],load [mm],Case", lines)
    with pytest.raises(InputError, match=r"line 3: case a has the loads 0\.05 and 0\.1 - give each case one"):
        Block(n=1, load="displacement", data=data, units=units)


DIRECTED: dict[str, Any] = {"n": 2, "derivatives": "hand", "unknown": "layers", "layers": 2}
TRUTH = np.array([0.2, -0.3])


def directed(folder: Path, kind: type[Solid], unit: str) -> str:
    """u of a body under two loads in two directions, read at its nodes; the loads, of an area of 1 m^2, in columns."""
    made = kind(**DIRECTED, cases=2)
    u, X = Model(made, TIGHT).solve(TRUTH).u, made.mesh.geometry.X
    axes, lines = "xyz"[: X.shape[1]], []
    for case, direction in enumerate(made.solid.directions):
        U = made.solid.displacements(u, made.solid.setup(TRUTH), case, np.arange(len(X)))
        load = np.broadcast_to(0.2 * direction, X.shape)
        lines += [",".join(map(repr, row)) for row in np.c_[X, U, load][X[:, -1] > 0.0].tolist()]
    header = [*axes, *(f"u{axis}" for axis in axes), *(f"load_{axis}{unit}" for axis in axes)]
    return written(folder, ",".join(header), lines)


@pytest.mark.parametrize(("kind", "unit"), [(Plate, " [N]"), (Block, " [Pa]")])
def test_loads_may_differ_in_direction(kind: type[Solid], unit: str, tmp_path: Path) -> None:
    solid = kind(**DIRECTED, data=directed(tmp_path, kind, unit), modulus=1.0)
    assert solid.objective(Model(solid, TIGHT).solve(TRUTH).u, TRUTH) < 1e-26
    assert f"load cases by columns load_x, load_y.., {unit[2:-1]}: (0, " in " ".join(solid.read_as)
    p = TRUTH + np.array([0.1, 0.2])
    exact = complex_gradient(solid, p)
    for route in (tangent, adjoint):
        assert relative_error(route.prepare(Model(solid, TIGHT), p)(p).gradient, exact) < 1e-12, route.name
    ended = invert(problems([kind.name])[0], routes(["adjoint"])[0], Engine("gauss-newton"), made=solid)
    assert ended.p == pytest.approx(TRUTH, abs=1e-8)


def test_a_grip_may_move_in_several_directions(tmp_path: Path) -> None:
    lines = ["0.5,0.5,0.1,0,0.2,0", "0.5,0.5,0,0.1,0,0.2", "0.2,0.5,0,0.1,0,0.2"]
    data = written(tmp_path, "x,y,ux,uy,load_x [mm],load_y [mm]", lines)
    units = "x:m,y:m,ux:m,uy:m,load_x:mm,load_y:mm"
    plate = Plate(n=2, derivatives="hand", load="displacement", data=data, units=units, modulus=1.0)
    assert (plate.solid.base.load * plate.solid.directions).tolist() == [[2e-4, 0.0], [0.0, 2e-4]]


REFUSED: dict[str, tuple[str, str, dict[str, Any], str]] = {
    "a component beside a load": ("load [N],load_x [N]", "1,1", {}, "columns load and load_x both state the load"),
    "components of two kinds": ("load_x [N],load_y", "1,1", {}, "load_x is a force, load_y a ratio - state the unit"),
    "a component across a plane": ("load_z [N]", "1", {}, "column load_z [N] tells cases apart"),
    "components and a direction": ("load_x [N]", "1", {"direction": "x"}, "direction=x and columns load_x.. of"),
    "components of a follower": ("load_y [Pa]", "1", {"load": "follower"}, "load=follower and columns load_x.. of"),
    "no load": ("case", "1", {}, "column case tells cases apart, but not the load of each - add a column load"),
    "a gap": ("load", "", {}, "line 2, column load: '' is not a number"),
    "two loads": ("load [N]", "1", {"force": 2.0}, "force= and column load of"),
    "a force of a follower": ("load [N]", "1", {"load": "follower"}, "does not go with load=follower - give load=tr"),
    "a displacement of a traction": (
        "load [mm]",
        "1",
        {"units": "x:m,y:m,ux:m,uy:m"},
        "column load is a length, which",
    ),
    "a temperature": ("load [K]", "1", {}, "'K' is a unit of temperature, not of ratio"),
    "frames": ("frame", "1", {}, "or name it the case beside a column load: columns=case:frame"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_one_line(name: str, tmp_path: Path) -> None:
    header, value, options, says = REFUSED[name]
    with pytest.raises(InputError, match=re.escape(says)) as refused:
        Plate(n=1, data=written(tmp_path, f"x,y,ux,uy,{header}", [f"1,1,0.1,0.1,{value}"]), **options)
    assert "\n" not in str(refused.value)


def test_too_many_cases_a_blind_one_and_several_unknown_tractions_are_refused(tmp_path: Path) -> None:
    header, lines = "x,y,ux,uy,load", [f"1,1,0.1,0.1,{k}" for k in range(MAX_CASES + 1)]
    for some, options, says in (
        (lines, {}, f"{MAX_CASES + 1} load cases, each a forward solve, at most {MAX_CASES}"),
        (["1,1,0.1,0.1,1", "1,3,0.1,0.1,2"], {"outside": "drop"}, "measures nothing under load 2, case 2"),
        (lines[:2], {"unknown": "traction"}, "unknown=traction takes one load case"),
        (lines[:1], {"cases": 2}, "cases does not go with data=FILE"),
    ):
        with pytest.raises(InputError, match=re.escape(says)):
            Plate(n=1, data=written(tmp_path, header, some), **options)


def test_cases_of_a_file_are_not_described_to_other_codes(tmp_path: Path) -> None:
    corners = [f"{x},{y},1,0.1,0.1,0.1" for x in (0, 1) for y in (0, 1)]
    one = Block(n=1, law="linear", data=written(tmp_path, "x,y,z,ux,uy,uz", corners))
    assert replace(one.data, noise=0.0).solid is one.solid
    two = written(tmp_path, "x,y,z,ux,uy,uz,load", [f"{line},{k}" for k in (1, 2) for line in corners])
    with pytest.raises(NotOffered, match="data="):
        Block(n=1, law="linear", data=two).case()


def test_a_modulus_is_found_from_two_loads(tmp_path: Path, cli: Any) -> None:
    data = written(tmp_path, "x,y,ux,uy,load [N]", rows())
    body = "n=1,derivatives=hand,clamped=none,fixed=x@left,y@bottom,unknown=layers,layers=1,modulus=2"
    ran = cli("invert", "--problem", f"plate[{body},data={data}]", "--no-plot", "--optimizer", "gauss-newton", "--json")
    assert ran.code == 0, ran.err
    table = [row for row in ran.rows if row["table"] == "inversion"]
    assert table[-1]["objective"] < 1e-12 * table[0]["objective"], ran.err
    assert "converged" in table[-1]["says"]
