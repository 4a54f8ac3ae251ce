"""A third party's problem, route and linear solver, installed by pip, found by entry point; a broken one says why."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from commands import ROOT, Ran
from forks import Forks

FD = {"fd-one-sided": 1e-5, "fd-central": 1e-8, "fd-extrapolated": 1e-10}
CHOSEN = ("--problem duffing --route all", "--problem bar --route fd-extrapolated --route adjoint")


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the example plug-in installed, and beside it one that cannot be imported."""
    site = tmp_path_factory.mktemp("site")
    source = tmp_path_factory.mktemp("source") / "plugin"
    subprocess.run(["cp", "-r", str(ROOT / "examples" / "plugin"), str(source)], check=True)
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"]
    subprocess.run([*pip, "--no-build-isolation", "--target", str(site), str(source)], check=True)
    info = site / "broken-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[gradient_routes.problems]\nsunk = sunk.problem:Sunk\n[gradient_routes.routes]\nnone = math:pi\n"
        "[gradient_routes.studies]\ngone = gone:STUDY\n"
        "[gradient_routes.solvers]\nlost = lost.solver:lost\nnumber = math:pi\n"
    )
    return site


@pytest.fixture(scope="module")
def installed(site: Path) -> Iterator[Forks]:
    forks = Forks(PYTHONPATH=str(site))
    yield forks
    forks.end()


@pytest.fixture
def routes(installed: Forks, site: Path, tmp_path: Path) -> Callable[[str], Ran]:
    """The command line where both are installed."""
    return lambda words: installed.run(tmp_path, *shlex.split(words), PYTHONPATH=str(site))


def test_plugins_are_listed_with_their_origin_and_the_broken_with_the_reason(routes: Callable[[str], Ran]) -> None:
    done = routes("list")
    assert done.code == 0, done.err
    assert "duffing  (from gradient-routes-duffing)" in done.out
    assert "fd-extrapolated  (from gradient-routes-duffing)" in done.out
    assert "'sunk' of broken cannot be imported: ModuleNotFoundError: No module named 'sunk'" in done.out
    assert "'none' of broken is no Route" in done.out
    assert "symmetry  (from gradient-routes-duffing)" in done.out
    assert "study 'gone' of broken cannot be imported: ModuleNotFoundError: No module named 'gone'" in done.out


def test_plugins_run_beside_the_built_ins(routes: Callable[[str], Ran]) -> None:
    done = [routes(f"run --json --no-isolate --min-time 0 {chosen}") for chosen in CHOSEN]
    assert [ran.code for ran in done] == [0, 0], [ran.err for ran in done]
    rows = {(r["problem"], r["route"]): r for ran in done for r in ran.rows}
    assert len(rows) == 8 + 2
    for (_, route), row in rows.items():
        if route in ("unrolled-ad", "implicit-ad"):
            assert row["status"] == "skipped"
            assert "jax.numpy" in row["reason"]
            continue
        assert row["status"] == "ok"
        assert row["work"] == row["predicted_work"]
        assert row["gradient_error"] < FD.get(route, 1e-12)
    # no closed form there: another exact route judges, never the one being judged
    assert rows["duffing", "adjoint"]["reference"] == "complex-step"
    assert rows["duffing", "complex-step"]["reference"] == "tangent"


def test_a_broken_plugin_is_one_line(routes: Callable[[str], Ran]) -> None:
    done = routes("run --problem sunk --route adjoint")
    assert done.code == 2
    assert done.err.startswith("routes: problem 'sunk' of broken cannot be imported")
    assert done.err.count("\n") == 1


def test_a_linear_solver_is_one_file_and_one_entry_point(routes: Callable[[str], Ran]) -> None:
    chosen = "--problem duffing --route adjoint --route complex-step --linear-solver dense-cholesky"
    done = routes(f"run --json {chosen} --min-time 0 --no-isolate")
    assert done.code == 0, done.err
    adjoint, complex_step = done.rows
    assert adjoint["linear_solver"] == "LAPACK L L^T"
    assert adjoint["work"] == adjoint["predicted_work"]
    assert adjoint["gradient_error"] < 1e-12 > complex_step["gradient_error"]  # complex matrices: by LAPACK L U
    assert "auto|cg-amg|descent|krylov|pardiso|superlu|dense-cholesky|lost|number" in "".join(
        routes("run --linear-solver no-such").err.split()
    ).replace("'", "").replace(",", "|")


@pytest.mark.parametrize(
    ("solver", "says"),
    [
        ("lost", "routes: linear solver 'lost' of broken cannot be imported: ModuleNotFoundError: No module named"),
        ("number", "routes: linear solver 'number' of broken is no LinearSolver of that name - correct broken"),
    ],
)
def test_a_broken_linear_solver_is_one_line(routes: Callable[[str], Ran], solver: str, says: str) -> None:
    done = routes(f"run --problem bar --route adjoint --linear-solver {solver}")
    assert done.code == 2
    assert done.err.startswith(says)
    assert done.err.count("\n") == 1


def test_a_study_is_one_file_and_one_entry_point(routes: Callable[[str], Ran]) -> None:
    """Its command, its help, its rows in the store, in --json and in exports: no other file knows it."""
    assert "symmetry" in routes("--help").out
    assert "so that a transposed solve is a plain one?" in " ".join(routes("symmetry --help").out.split())
    done = routes("symmetry --problem duffing --no-isolate")
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("duffing: |R_u v - R_u^T v| / |R_u v| = 0\n")
    done = routes("symmetry --problem 'advection[n=4]' --json")
    (row,) = done.rows
    assert done.code == 1
    assert row["table"] == "symmetry"
    assert row["asymmetry"] > 0.1
    exported = routes("export --table symmetry").out.splitlines()
    assert exported[0] == "study_id,problem,at,n_state,asymmetry"
    assert len(exported) == 3
    assert routes("symmetry").code == 2


def test_the_example_is_as_short_as_promised() -> None:
    lengths = {p.name: len(p.read_text().splitlines()) for p in (ROOT / "examples" / "plugin" / "duffing").glob("*.py")}
    assert lengths["problem.py"] <= 65
    assert lengths["route.py"] <= 42
