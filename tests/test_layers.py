"""One way down: bench -> routes -> problems; and the command line starts light."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from commands import ROOT

HEAVY = {"jax", "scipy", "pandas", "skfem", "meshio", "pyarrow", "matplotlib"}
FORBIDDEN = {"problems": {"routes", "bench"}, "routes": {"bench"}}
FLOORS = ("problems", "routes", "bench")
CONTRACT = {"problem", "errors", "chain", "sparse", "jax64"}  # what routes may know of floor 1: no single problem


def modules(floor: str) -> list[Path]:
    return sorted((ROOT / floor).rglob("*.py"))


def imports(path: Path, module_level_only: bool = False) -> Iterator[str]:
    """Dotted names a file imports; those under TYPE_CHECKING do not run and do not count."""
    nodes: list[ast.AST] = [ast.parse(path.read_text())]
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module or ""
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            nodes.extend(node.orelse)
        elif not (module_level_only and isinstance(node, ast.FunctionDef)):
            nodes.extend(ast.iter_child_nodes(node))


@pytest.mark.parametrize("floor", FORBIDDEN)
def test_no_floor_imports_one_above(floor: str) -> None:
    wrong = {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in modules(floor)
        for name in imports(path)
        if name.split(".")[0] in FORBIDDEN[floor]
    }
    assert not wrong
    assert modules(floor), "the walk found no files: it proves nothing"


def test_routes_know_the_contract_of_problems_only() -> None:
    known = {name.split(".")[1] for path in modules("routes") for name in imports(path) if name.startswith("problems.")}
    assert known <= CONTRACT


def test_heavy_libraries_are_imported_late() -> None:
    """Only the modules about JAX import it on top, and nothing imports those on top."""
    on_jax = "problems.jax64 problems.solid problems.materials problems.spectral"
    traced = {*on_jax.split(), "routes.differentiable", "routes.iterations", "routes.unrolled_newton"}
    light = [p for floor in FLOORS for p in modules(floor) if f"{floor}.{p.stem}" not in traced]
    assert len(light) == sum(len(modules(floor)) for floor in FLOORS) - len(traced)
    wrong = {f"{p.name}: {n}" for p in light for n in imports(p, True) if n in traced or n.split(".")[0] in HEAVY}
    assert not wrong


@pytest.mark.parametrize(
    "command",
    [["list"], ["--help"], "run --no-store --problem bar --route adjoint --route tangent --route fd-central".split()],
)
def test_light_commands_load_nothing_heavy(command: list[str], tmp_path: Path) -> None:
    code = (
        "import sys; from bench.cli import main\n"
        f"sys.argv = ['routes', *{command}]\n"
        "try: main()\n"
        "except SystemExit as end: assert not end.code\n"
        f"print(sorted({HEAVY} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip() == "[]"
