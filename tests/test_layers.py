"""One way down: bench -> routes -> problems, and within bench package by package; the command line starts light."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from commands import ROOT

PACKAGE = ROOT / "gradient_routes"
HEAVY = {"jax", "scipy", "pandas", "skfem", "meshio", "pyarrow", "vl_convert"}
FLOORS = ("problems", "routes", "bench")
STATEMENTS = (ast.stmt, ast.ExceptHandler, ast.match_case)  # in no other node is anything imported
# what routes may know of floor 1: the contract, no single problem
MATRICES = {f"matrices.{kind}" for kind in ("tridiagonal", "sparse", "recurrence", "step_matrix", "global_step")}
CONTRACT = {"problem", "transient", "rates", "errors", "text", "jax64", "programs"} | MATRICES
# packages of the bench from the lowest to the highest; files beside them are helpers, below, or the command line, above
ORDER = (
    *("sanitize", "units", "ranges", "command_options", "cases", "store", "execution", "environments", "render"),
    *(
        "advice",
        "verification",
        "protocols",
        "inversion",
        "regression",
        "studies",
        "lab",
        "commands",
        "api",
        "cli",
        "start",
    ),
)
# the only modules that import JAX when they are imported; nothing imports those before it needs them
TRACED = {
    "gradient_routes.problems.jax64",
    "gradient_routes.problems.programs",
    "gradient_routes.problems.fem.assembly_jax",
    "gradient_routes.problems.mechanics.by_ad",
    "gradient_routes.problems.mechanics.energies",
    "gradient_routes.problems.mechanics.isotropic_functions",
    "gradient_routes.problems.mechanics.plane_energies",
    "gradient_routes.problems.mechanics.polar",
    "gradient_routes.problems.mechanics.principal_stress",
    "gradient_routes.routes.compiled",
    "gradient_routes.routes.differentiable",
    "gradient_routes.routes.solvers.traced_iterations",
    "gradient_routes.routes.traced_steps",
    "gradient_routes.routes.unrolled_march",
    "gradient_routes.routes.unrolled_newton",
}


def modules(floor: str) -> dict[str, Path]:
    """Dotted name -> file, of all modules of a floor."""
    found = {}
    for path in sorted((PACKAGE / floor).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imports(path: Path, module_level_only: bool = False) -> tuple[str, ...]:
    """Dotted names a file imports, of `from a import b` both a and a.b; those under TYPE_CHECKING do not run and do
    not count.
    """
    names: list[str] = []
    nodes: list[ast.AST] = [ast.parse(path.read_text())]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names += [node.module or "", *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            nodes.extend(node.orelse)
        elif not (module_level_only and isinstance(node, ast.FunctionDef)):
            nodes.extend(child for child in ast.iter_child_nodes(node) if isinstance(child, STATEMENTS))
    return tuple(names)


def floor_of(name: str) -> str | None:
    package, _, rest = name.partition(".")
    return rest.partition(".")[0] if package == "gradient_routes" else None


@pytest.mark.parametrize("floor", FLOORS)
def test_no_floor_imports_one_above(floor: str) -> None:
    above = FLOORS[FLOORS.index(floor) + 1 :]
    wrong = {f"{m} imports {n}" for m, path in modules(floor).items() for n in imports(path) if floor_of(n) in above}
    assert not wrong
    assert len(modules(floor)) > 10, "the walk found no files: it proves nothing"


def test_routes_know_the_contract_of_problems_only() -> None:
    known = {n for path in modules("routes").values() for n in imports(path) if floor_of(n) == "problems"}
    files = {n.removeprefix("gradient_routes.problems.") for n in known if n in modules("problems")}
    packages = {name for name in files if (PACKAGE / "problems" / name).is_dir()}
    assert CONTRACT - {"jax64"} <= files - packages <= CONTRACT


def test_packages_of_the_bench_import_only_those_below() -> None:
    """Hence there is no circle among them."""
    arrows: dict[tuple[str, str], set[str]] = {}
    for name, path in modules("bench").items():
        source = name.removeprefix("gradient_routes.bench").lstrip(".").partition(".")[0]
        for target in imports(path):
            if source and floor_of(target) == "bench" and target.count(".") > 1:
                arrows.setdefault((source, target.split(".")[2]), set()).add(name)
    assert {package for arrow in arrows for package in arrow} == set(ORDER)
    assert not {(a, b): names for (a, b), names in arrows.items() if ORDER.index(a) < ORDER.index(b)}


def test_the_bench_has_few_loose_files() -> None:
    assert len([path for path in (PACKAGE / "bench").iterdir() if path.is_file()]) <= 8


def test_heavy_libraries_are_imported_late() -> None:
    """Only the modules about JAX import it on top, and nothing imports those on top."""
    every = {name: path for floor in FLOORS for name, path in modules(floor).items()}
    assert set(every) >= TRACED
    wrong = {
        f"{name}: {n}"
        for name, path in every.items()
        if name not in TRACED
        for n in imports(path, True)
        if n in TRACED or n.partition(".")[0] in HEAVY
    }
    assert not wrong


RUN = "run --no-store --min-time 0 --problem bar --route tangent"
LIGHT = ("list", "--help", RUN, f"{RUN} --route fd-central --no-isolate")


def test_light_commands_load_nothing_heavy(tmp_path: Path) -> None:
    code = (
        "import sys; from click.testing import CliRunner; from gradient_routes.bench.cli import main\n"
        f"for words in {LIGHT}: assert CliRunner().invoke(main, words.split()).exit_code == 0, words\n"
        f"print(sorted({HEAVY} & {{*sys.modules}}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert (done.stdout, done.stderr) == ("[]\n", "")
