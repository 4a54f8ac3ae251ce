"""Files a run leaves: gradients as CSV with positions, fields on the mesh for ParaView, an older store."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest

from gradient_routes.bench.cases.case import problems
from gradient_routes.bench.execution import references
from gradient_routes.bench.store.store import SCHEMA, Store
from gradient_routes.bench.studies.bill.files import Files
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State

RUN = "run --no-timing --problem".split()


def test_gradients_are_written_parameter_by_parameter(cli) -> None:
    ran = cli(*RUN, "bar[n=70]", "--problem", "block[n=2]", "--route", "adjoint", "--route", "fd-central",
              "--gradient", "g.csv")  # fmt: skip
    assert ran.code == 0
    assert "gradients of 4 of 4 cases in g.csv" in ran.out
    assert "log E_1 [log Pa]" not in ran.out, "the file takes the place of the table"
    table = pd.read_csv("g.csv")
    assert list(table) == "problem route parameter unit x y z p dJ_dp reference".split()
    assert len(table) == 2 * (70 + 8)
    bar = table[(table.problem == "bar[n=70]") & (table.route == "adjoint")]
    np.testing.assert_allclose(bar.x, (np.arange(70) + 0.5) / 70, rtol=1e-15)
    assert bar.y.isna().all()
    np.testing.assert_allclose(bar.dJ_dp, Bar(n=70).reference(np.zeros(70)).gradient, rtol=1e-12)
    np.testing.assert_allclose(bar.reference, bar.dJ_dp, rtol=1e-12)
    block = table[(table.problem == "block[n=2]") & (table.route == "fd-central")]
    problem = Block(n=2)
    np.testing.assert_array_equal(block[["x", "y", "z"]], problem.parameters.position)
    np.testing.assert_array_equal(block.p, problem.parameters.start)
    assert list(block.parameter) == [f"log E_{e}" for e in range(1, 9)]
    assert set(block.unit) == {"log Pa"}


def test_columns_are_empty_where_nothing_is_known(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(references, "WHOLE", 0)
    assert cli(*RUN, "block[n=2]", "--route", "adjoint", "--gradient", "g.csv").code == 0
    assert pd.read_csv("g.csv").reference.isna().all(), "a judge in random directions knows no component"
    assert cli(*RUN, "bar", "--route", "adjoint", "--directions", "2", "--gradient", "g.csv").code == 0
    table = pd.read_csv("g.csv")
    assert list(table) == "problem route parameter unit p dJ_dp reference".split()
    assert list(table.parameter) == ["direction 1", "direction 2"]


def test_components_keep_their_names_and_places(cli) -> None:
    ran = cli(*RUN, "block[n=2]", "--route", "adjoint", "--components", "3", "--seed", "1", "--gradient", "g.csv")
    assert ran.code == 0
    table, problem = pd.read_csv("g.csv"), Block(n=2)
    e = table.parameter.str.removeprefix("log E_").astype(int) - 1
    np.testing.assert_array_equal(table[["x", "y", "z"]], problem.parameters.position[e])
    np.testing.assert_allclose(table.dJ_dp, table.reference, rtol=1e-9)


def test_json_and_a_file_at_once(cli) -> None:
    ran = cli(*RUN, "bar[n=70]", "--route", "adjoint", "--gradient", "g.csv", "--json")
    assert len(ran.rows[0]["gradient"]) == 70
    assert ran.err == "gradients of 1 of 1 cases in g.csv\n"
    np.testing.assert_array_equal(pd.read_csv("g.csv").dJ_dp, ran.rows[0]["gradient"])


@pytest.mark.parametrize("parametrization", ["log", "raw"])
def test_fields_on_the_mesh_are_read_back(cli, parametrization: str) -> None:
    name = f"block[n=2,parametrization={parametrization}]"
    assert cli(*RUN, name, "--route", "adjoint", "--vtu", "f.vtu").code == 0
    mesh = meshio.read("f.vtu")
    block = Block(n=2, parametrization=parametrization)
    p = block.parameters.start
    result = adjoint.prepare(Model(block), p)(p)
    E = np.exp(p) if parametrization == "log" else p
    assert set(mesh.point_data) == {"u", "lambda"}
    np.testing.assert_array_equal(mesh.cell_data["E"][0], E)
    slope = result.gradient / E if parametrization == "log" else result.gradient
    np.testing.assert_allclose(mesh.cell_data["dJ_dE"][0], slope, rtol=1e-9)
    at_base = mesh.points[:, 2] == 0.0
    for field, values in (("u", result.u), ("lambda", result.lam)):
        read = mesh.point_data[field]
        assert not read[at_base].any()
        np.testing.assert_allclose(read[~at_base], values.reshape(-1, 3), rtol=1e-9, atol=1e-15)
    (cells,) = mesh.cells
    assert cells.type == "hexahedron"
    x = mesh.points[cells.data]  # (8, 8, 3)
    np.testing.assert_allclose(x.mean(axis=1), block.parameters.position, atol=1e-15)
    for corner, right, behind, above in ((0, 1, 3, 4), (6, 7, 5, 2)):  # VTK's hexahedron: right-handed, edge by edge
        edges = np.stack([x[:, b] - x[:, corner] for b in (right, behind, above)], axis=1)
        np.testing.assert_allclose(np.abs(np.linalg.det(edges)), 1 / 8, rtol=1e-12)
        assert (np.count_nonzero(np.abs(edges) > 1e-12, axis=2) == 1).all()
    upward = np.stack([x[:, b] - x[:, 0] for b in (1, 3, 4)], axis=1)
    assert (np.linalg.det(upward) > 0).all()


def test_a_route_without_an_adjoint_state_leaves_it_out(cli) -> None:
    assert cli(*RUN, "block[n=2]", "--route", "fd-one-sided", "--vtu", "f.vtu").code == 0
    assert set(meshio.read("f.vtu").point_data) == {"u"}


def central_differences(problem: Problem, of: Callable[[State], np.ndarray]) -> np.ndarray:
    """d of / dp (m, n_p) by forward solves at p +- h e_i."""
    model, p = Model(problem, Solver(rtol=1e-13)), problem.parameters.start
    columns = []
    for i, size in enumerate(problem.parameters.natural(p)):
        step = np.zeros_like(p)
        step[i] = 1e-5 * size
        columns.append((of(model.solve(p + step)) - of(model.solve(p - step))) / (2 * step[i]))
    return np.stack(columns, axis=1)


SELECTED = "bar[n=6,sensors=2,5,alpha=0.1]"


def test_sensitivities_of_the_state_equal_central_differences(cli) -> None:
    assert cli(*RUN, SELECTED, "--route", "tangent", "--sensitivities", "s.csv").code == 0
    table, bar = pd.read_csv("s.csv", index_col="du_dp"), Bar(n=6, sensors=[2, 5], alpha=0.1)
    assert list(table) == [bar.parameters.label(i) for i in range(6)]
    assert list(table.index) == [f"u_{i}" for i in range(1, 7)]
    np.testing.assert_allclose(table, central_differences(bar, lambda state: state.u), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("selector", [SELECTED, "block[n=2,unknown=shape,markers=3,law=linear]"])
def test_sensitivities_of_the_data_equal_central_differences(cli, selector: str) -> None:
    ran = cli(*RUN, selector, "--route", "tangent", "--sensitivities", "s.npz", "--sensitivities-of", "data",
              "--columns", "5,1-2")  # fmt: skip
    assert ran.code == 0, ran.err
    (spec,) = problems([selector])
    problem = spec()

    def readings(state: State) -> np.ndarray:
        seen = problem.observation(state.u, state.p)
        assert seen is not None
        return np.asarray(seen.predicted / seen.weight)

    with np.load("s.npz") as kept:
        assert list(kept["parameters"]) == [problem.parameters.label(i) for i in (4, 0, 1)]
        assert len(kept["rows"]) == len(kept["dSu_dp"])
        expected = central_differences(problem, readings)[:, [4, 0, 1]]
        np.testing.assert_allclose(kept["dSu_dp"], expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize(
    "selector",
    ["block[n=2,cases=2,derivatives=hand]", "block[n=2,unknown=load,load=displacement,law=linear]", "advection[n=4]"],
)
def test_columns_on_the_mesh_equal_differences_of_its_fields(cli, selector: str) -> None:
    ran = cli(*RUN, selector, "--route", "tangent", "--vtu", "f.vtu", "--columns", "1")
    assert ran.code == 0, ran.err
    mesh = meshio.read("f.vtu")
    (spec,) = problems([selector])
    problem = spec()
    p, h = problem.parameters.start, 1e-5
    step = h * np.eye(len(p))[0] * problem.parameters.natural(p)
    model = Model(problem, Solver(rtol=1e-13))
    above, below = (problem.fields(q, model.solve(q).u, None, 0 * p).point_data for q in (p + step, p - step))
    names = [name for name in above if name.startswith("u")]
    assert {name for name in mesh.point_data if name.startswith("du_dp")} == {f"du_dp_1{n[1:]}" for n in names}
    for name in names:
        expected = (above[name] - below[name]) / (2 * step[0])
        found = mesh.point_data[f"du_dp_1{name[1:]}"]
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7 * np.abs(expected).max())
        assert np.abs(found).max() > 0


def test_a_mesh_of_sensitivities_has_every_column(cli) -> None:
    ran = cli(*RUN, "block[n=1]", "--route", "tangent", "--sensitivities", "s.vtu")
    assert (ran.code, "fields in s.vtu" in ran.out) == (0, True)
    assert set(meshio.read("s.vtu").point_data) == {"u", "du_dp_1"}
    assert cli(*RUN, "block[n=1]", "--route", "tangent", "--vtu", "f.vtu").code == 0
    assert set(meshio.read("f.vtu").point_data) == {"u"}


WRONG = {
    "another route": ("bar --route adjoint --sensitivities s.csv", "adjoint has no du/dp - give --route tangent"),
    "a suffix": ("bar --route tangent --sensitivities s.txt", "suffix '.txt' - name a file .csv, .npz, .vtu"),
    "columns of two": ("bar --route all --sensitivities s.csv", "these are 7 cases - name one"),
    "data on a mesh": ("block --route tangent --sensitivities s.vtu --sensitivities-of data", "name a .csv or .npz"),
    "no mesh for columns": ("bar --route tangent --sensitivities s.vtu", "has no mesh to write fields on"),
    "a column too many": ("bar --route tangent --sensitivities s.csv --columns 9", "bar has 8 parameters - choose 1"),
    "columns that are none": ("bar --route tangent --sensitivities s.csv --columns 3-x", "'3-x' is not a number or a"),
    "no columns": ("bar --route tangent --sensitivities s.csv --columns 5-3", "no parameter - write 1,5-8"),
    "columns of nothing": ("bar --route tangent --columns 1", "--columns: is of --sensitivities"),
    "data of nothing": ("bar --route tangent --sensitivities-of data", "is of --sensitivities - leave it out"),
    "sensitivities of a part": ("bar --route tangent --sensitivities s.csv --components 2", "drop --components"),
    "two in one": ("bar --route tangent --gradient s.csv --sensitivities s.csv", "is another file of this run"),
    "a folder": ("bar --route adjoint --gradient .", "--gradient .: Is a directory"),
    "a missing folder": ("bar --route adjoint --gradient no/g.csv", "No such file or directory"),
    "unwritable": ("bar --route adjoint --gradient /proc/g.csv", "--gradient /proc/g.csv: "),
    "the store": ("bar --route adjoint --gradient s.sqlite --store s.sqlite", "is another file of this run"),
    "the point": ("bar --route adjoint --at p.csv --gradient p.csv", "is another file of this run"),
    "the data": ("bar[data=d.csv] --route adjoint --gradient d.csv", "is another file of this run"),
    "both in one": ("block --route adjoint --gradient f --vtu f", "--vtu f: is another file of this run"),
    "the store as vtu": ("block --route adjoint --vtu s.sqlite --store s.sqlite", "is another file of this run"),
    "vtu in a missing folder": ("block --route adjoint --vtu no/f.vtu", "No such file or directory"),
    "two problems": ("block --problem bar --route adjoint --vtu f.vtu", "one problem and one route, these are 2 cases"),
    "all routes": ("block --route all --vtu f.vtu", "these are 7 cases - name one"),
    "a grid": ("block[n=1|2] --route adjoint --vtu f.vtu", "these are 2 cases"),
    "no mesh": ("bar --route adjoint --vtu f.vtu", "bar: has no mesh to write fields on - drop --vtu"),
    "a part": ("block --route adjoint --vtu f.vtu --components 3", "needs the whole gradient - drop --components"),
    "a part that is all": ("block --route adjoint --vtu f.vtu --directions 3", "drop --directions"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_are_one_line_before_anything_runs(cli, tmp_path: Path, case: str) -> None:
    (tmp_path / "p.csv").write_text("E\n" + "0.5\n" * 8)
    (tmp_path / "d.csv").write_text("node,displacement\n1,0.1\n")
    arguments, says = WRONG[case]
    before = sorted(tmp_path.iterdir())
    ran = cli(*RUN, *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err
    assert sorted(tmp_path.iterdir()) == before, "nothing ran, nothing is kept"


@pytest.mark.parametrize("file", ["--gradient /dev/full", "--vtu /dev/full"])
def test_a_full_disk_loses_no_row(cli, file: str) -> None:
    ran = cli(*RUN, "block[n=2]", "--route", "adjoint", *file.split())
    assert (ran.code, ran.err.count("\n")) == (1, 1)
    assert "No space left on device" in ran.err
    assert "1 fwd + 2 adj" in ran.out
    assert len(Store(Path("results/routes.sqlite")).rows()) == 1


def test_a_failed_case_writes_no_fields_and_says_so(cli) -> None:
    ran = cli(*RUN, "block[n=2,traction=-3]", "--route", "adjoint", "--vtu", "f.vtu", "--gradient", "g.csv")
    assert ran.code == 1
    assert "nothing written to f.vtu: adjoint on block not-converged" in ran.out
    assert "gradients of 0 of 1 cases in g.csv" in ran.out
    assert not Path("f.vtu").exists()
    assert len(Path("g.csv").read_text().splitlines()) == 1
    ran = cli(*RUN, "block[n=2]", "--route", "adjoint", "--vtu", "f.vtu", "--budget", "1e-9")
    assert (ran.code, "nothing written to f.vtu: adjoint on block skipped" in ran.out) == (0, True)


def test_nothing_measured_nothing_written(tmp_path: Path) -> None:
    assert Files(tmp_path / "g.csv", tmp_path / "f.vtu").write([]) == ([], [])
    assert not list(tmp_path.iterdir())


def test_the_tape_of_an_iteration_is_told(cli) -> None:
    command = [*RUN, "bar", "--route", "unrolled-ad[iterations=50]", "--route", "implicit-ad", "--route", "adjoint"]
    rows = cli(*command, "--json").rows
    assert rows[0]["tape_bytes_per_iteration"] == rows[0]["tape_bytes"] / 50
    assert [row["tape_bytes_per_iteration"] for row in rows[1:]] == [None, None]
    assert [row["route_options"].get("factors") for row in rows] == [None, "refined", "refined"]
    assert " B/it)" in cli(*command).out


def test_a_store_of_the_first_version_is_read_and_added_to(cli) -> None:
    """Its rows lack what came later; a newer version is refused (tests/test_store.py)."""
    assert cli(*RUN, "bar", "--route", "adjoint").code == 0
    path = Path("results/routes.sqlite")
    with closing(sqlite3.connect(path)) as db:
        for column in ("partial", "tape_bytes_per_iteration"):
            db.execute(f"ALTER TABLE cases DROP COLUMN {column}")
        db.execute("PRAGMA user_version = 1")
        db.commit()
    assert cli("report").out.count("adjoint") == 1
    assert cli("export", "-o", "old.parquet").code == 0
    assert cli(*RUN, "bar", "--route", "adjoint", "--components", "2").code == 0
    assert [row["partial"] for row in Store(path).rows()] == [None, "2 of 8 components"]
    with closing(sqlite3.connect(path)) as db:
        assert db.execute("PRAGMA user_version").fetchone() == (SCHEMA,)
    assert "bar, 2 of 8 components" in cli("report").out
    assert cli("export", "-o", "new.parquet").code == 0
