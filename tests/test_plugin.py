"""A third party's problem, route and linear solver, installed by pip, found by entry point; a broken one says why."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from commands import ROOT, shell

FD = {"fd-one-sided": 1e-5, "fd-central": 1e-8, "fd-extrapolated": 1e-10}


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


def routes(site: Path, arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return shell(f"routes {arguments}", cwd, PYTHONPATH=str(site))


def test_plugins_are_listed_with_their_origin_and_the_broken_with_the_reason(site: Path, tmp_path: Path) -> None:
    done = routes(site, "list", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "duffing  (from gradient-routes-duffing)" in done.stdout
    assert "fd-extrapolated  (from gradient-routes-duffing)" in done.stdout
    assert "'sunk' of broken cannot be imported: ModuleNotFoundError: No module named 'sunk'" in done.stdout
    assert "'none' of broken is no Route" in done.stdout
    assert "symmetry  (from gradient-routes-duffing)" in done.stdout
    assert "study 'gone' of broken cannot be imported: ModuleNotFoundError: No module named 'gone'" in done.stdout


def test_plugins_run_beside_the_built_ins(site: Path, tmp_path: Path) -> None:
    done = routes(site, "run --json --no-isolate --problem bar --problem duffing --route all --min-time 0", tmp_path)
    assert done.returncode == 0, done.stderr
    rows = {(r["problem"], r["route"]): r for r in map(json.loads, done.stdout.splitlines())}
    assert len(rows) == 2 * 8
    for (problem, route), row in rows.items():
        if problem == "duffing" and route in ("unrolled-ad", "implicit-ad"):
            assert row["status"] == "skipped"
            assert "jax.numpy" in row["reason"]
            continue
        assert row["status"] == "ok"
        assert row["work"] == row["predicted_work"]
        assert row["gradient_error"] < FD.get(route, 1e-12)
    # no closed form there: another exact route judges, never the one being judged
    assert rows["duffing", "adjoint"]["reference"] == "complex-step"
    assert rows["duffing", "complex-step"]["reference"] == "tangent"


def test_a_broken_plugin_is_one_line(site: Path, tmp_path: Path) -> None:
    done = routes(site, "run --problem sunk --route adjoint", tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("routes: problem 'sunk' of broken cannot be imported")
    assert done.stderr.count("\n") == 1


def test_a_linear_solver_is_one_file_and_one_entry_point(site: Path, tmp_path: Path) -> None:
    done = routes(
        site,
        "run --json --problem duffing --route adjoint --route complex-step --linear-solver dense-cholesky --min-time 0",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    adjoint, complex_step = map(json.loads, done.stdout.splitlines())
    assert adjoint["linear_solver"] == "LAPACK L L^T"
    assert adjoint["work"] == adjoint["predicted_work"]
    assert adjoint["gradient_error"] < 1e-12 > complex_step["gradient_error"]  # complex matrices: by LAPACK L U
    assert "auto|cg-amg|descent|krylov|pardiso|superlu|dense-cholesky|lost|number" in "".join(
        routes(site, "run --linear-solver no-such", tmp_path).stderr.split()
    ).replace("'", "").replace(",", "|")


@pytest.mark.parametrize(
    ("solver", "says"),
    [
        ("lost", "routes: linear solver 'lost' of broken cannot be imported: ModuleNotFoundError: No module named"),
        ("number", "routes: linear solver 'number' of broken is no LinearSolver of that name - correct broken"),
    ],
)
def test_a_broken_linear_solver_is_one_line(site: Path, tmp_path: Path, solver: str, says: str) -> None:
    done = routes(site, f"run --problem bar --route adjoint --linear-solver {solver}", tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(says)
    assert done.stderr.count("\n") == 1


def test_a_study_is_one_file_and_one_entry_point(site: Path, tmp_path: Path) -> None:
    """Its command, its help, its rows in the store, in --json and in exports: no other file knows it."""
    assert "symmetry" in routes(site, "--help", tmp_path).stdout
    assert "so that a transposed solve is a plain one?" in " ".join(
        routes(site, "symmetry --help", tmp_path).stdout.split()
    )
    done = routes(site, "symmetry --problem duffing --no-isolate", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("duffing: |R_u v - R_u^T v| / |R_u v| = 0\n")
    done = routes(site, "symmetry --problem 'advection[n=4]' --json", tmp_path)
    (row,) = map(json.loads, done.stdout.splitlines())
    assert done.returncode == 1
    assert row["table"] == "symmetry"
    assert row["asymmetry"] > 0.1
    exported = routes(site, "export --table symmetry", tmp_path).stdout.splitlines()
    assert exported[0] == "study_id,problem,at,n_state,asymmetry"
    assert len(exported) == 3
    assert routes(site, "symmetry", tmp_path).returncode == 2


def test_the_example_is_as_short_as_promised() -> None:
    lengths = {p.name: len(p.read_text().splitlines()) for p in (ROOT / "examples" / "plugin" / "duffing").glob("*.py")}
    assert lengths["problem.py"] <= 65
    assert lengths["route.py"] <= 42
