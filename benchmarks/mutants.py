"""Do the tests fail when the code is wrong? A fixed sample of small faults, each in a copy of the tree.

    python -m benchmarks.mutants [--only TEXT] [--list] [--jobs N]

20 mutants of each area, chosen by a hash of seed and id, so that they stay the same while other code changes. A mutant
survives where the tests of its area pass. Reasons are kept in mutants_survivors.toml: id = "why it is accepted".
Exit code: 1 where a survivor has no reason, or where more than 3 survive; 2 where the tests fail without a mutant.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from rich.table import Table
from rich.text import Text

from gradient_routes.bench.render.terminal.tables import console

ROOT = Path(__file__).parent.parent
REASONS = ROOT / "benchmarks" / "mutants_survivors.toml"
SEED, EACH, ACCEPTED = 20260, 20, 3
SLOWER, LEAST = 3.0, 60.0  # times what the tests take without a mutant, and [s] on top: longer counts as killed
AREAS = {  # folder -> its tests; those that import the mutated module run first
    "problems": ("tests/problems", "tests/routes"),
    "routes": ("tests/routes", "tests/problems"),
    "bench/verification": ("tests/bench/verification", "tests/bench/studies/test_check_cli.py"),
}
UNCOPIED = shutil.ignore_patterns(".*", "__pycache__", "results", "build", "dist", "*.egg-info", "_build")
LEFT_OUT = {"view.py", "page.py", "table.py", "messages.py", "test_mutants.py"}  # words, pictures and ourselves
SKIPPED = (ast.JoinedStr, ast.Assert, ast.Raise, ast.arg, ast.AnnAssign)  # messages and annotations
LEFT = (ast.Lt, ast.Gt, ast.Eq, ast.Is, ast.In, ast.Add, ast.Mult, ast.And)
RIGHT = (ast.LtE, ast.GtE, ast.NotEq, ast.IsNot, ast.NotIn, ast.Sub, ast.Div, ast.Or)
OTHER: dict[type[ast.AST], Any] = dict(zip(LEFT + RIGHT, RIGHT + LEFT, strict=True))


@dataclass(frozen=True)
class Mutant:
    """One changed expression of one file; the id does not depend on line numbers."""

    area: str
    file: str
    id: str
    span: tuple[int, int]  # bytes of the file
    new: str

    def apply(self, source: bytes) -> bytes:
        return source[: self.span[0]] + self.new.encode() + source[self.span[1] :]

    @property
    def change(self) -> Text:
        old = (ROOT / self.file).read_bytes()[slice(*self.span)].decode()
        return Text(f"{' '.join(old.split())} -> {self.new}")


def faults(node: ast.AST) -> Iterator[tuple[str, ast.expr, ast.expr]]:
    """Operator, the expression it replaces, and what by, of one node."""
    match node:
        case ast.Compare(ops=[op]):
            yield "comparison", node, changed(node, ops=[OTHER[type(op)]()])
        case ast.BinOp(op=ast.Pow(), right=exponent):
            yield "exponent", node, changed(node, right=ast.BinOp(exponent, ast.Add(), ast.Constant(1)))
        case ast.BinOp(op=op) if type(op) in OTHER:
            yield "arithmetic", node, changed(node, op=OTHER[type(op)]())
        case ast.BoolOp(op=op):
            yield "boolean", node, changed(node, op=OTHER[type(op)]())
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield "not", node, operand
        case ast.Constant(value=bool() as value):
            yield "boolean", node, ast.Constant(not value)
        case ast.Constant(value=int() | float() as value):
            yield "constant", node, ast.Constant(value + 1 if isinstance(value, int) else 10.0 * value or 1.0)
        case ast.Return(value=ast.expr() as returned) if ast.unparse(returned) != "None":
            yield "return", returned, ast.Constant(None)


def changed(node: ast.expr, **fields: Any) -> ast.expr:
    return type(node)(**{**vars(node), **fields})


def mutants(area: str, path: Path) -> Iterator[Mutant]:
    """All of one file."""
    source, file = path.read_bytes(), path.relative_to(ROOT).as_posix()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    ordinals: Counter[str] = Counter()

    def walk(node: ast.AST, where: str) -> Iterator[Mutant]:
        for operator, old, new in faults(node):
            name = f"{file}:{where}:{operator}"
            ordinals[name] += 1
            begin, end = starts[old.lineno - 1] + old.col_offset, starts[(old.end_lineno or 0) - 1]
            span = begin, end + (old.end_col_offset or 0)
            yield Mutant(area, file, f"{name}:{ordinals[name]}", span, f"({ast.unparse(new)})")
        ignored = [getattr(node, "returns", None), *getattr(node, "decorator_list", ())]
        for child in ast.iter_child_nodes(node):
            if child not in ignored and not isinstance(child, SKIPPED):
                inner = [where, child.name] if isinstance(child, ast.FunctionDef | ast.ClassDef) else [where]
                yield from walk(child, ".".join(inner).lstrip("."))

    yield from walk(ast.parse(source), "")


@cache
def every(area: str) -> tuple[Mutant, ...]:
    """All of the files of one area."""
    files = [path for path in sorted((ROOT / area).rglob("*.py")) if path.name not in LEFT_OUT]
    return tuple(m for path in files for m in mutants(area, path))


def sample(seed: int = SEED) -> list[Mutant]:
    """The same number of every area, in the order of their ids."""
    chosen: list[Mutant] = []
    for area in AREAS:
        chosen += sorted(every(area), key=lambda m: hashlib.sha256(f"{seed} {m.id}".encode()).digest())[:EACH]
    return sorted(chosen, key=lambda m: m.id)


def passes(tree: Path, area: str, file: str, limit: float | None = None) -> bool:
    """Whether the tests of an area pass within `limit` seconds; all processes that they started are ended."""
    module = f"gradient_routes.{file.removesuffix('.py').replace('/', '.')}"
    tests = [path for place in AREAS[area] for path in (sorted((tree / place).rglob("test_*.py")) or [tree / place])]
    tests = [path for path in tests if path.name not in LEFT_OUT]
    tests.sort(key=lambda path: module not in path.read_text())
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *map(str, tests)]
    environment = {**os.environ, "PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": "1"}
    quiet: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    child = subprocess.Popen(command, cwd=tree, env=environment, start_new_session=True, **quiet)
    try:
        return child.wait(limit) == 0
    except subprocess.TimeoutExpired:
        return False
    finally:
        if child.poll() is None:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()


def survivors(chosen: list[Mutant], trees: SimpleQueue[Path], jobs: int) -> list[Mutant]:
    """Those that no test fails for; each is printed as soon as it is known."""
    limits = {}
    for area in dict.fromkeys(m.area for m in chosen):
        tree, begun = trees.get(), time.perf_counter()
        if not passes(tree, area, area):
            console(stderr=True).print(Text(f"{area}: its tests fail without a mutant - correct them first"))
            sys.exit(2)
        limits[area] = LEAST + SLOWER * (time.perf_counter() - begun)
        trees.put(tree)

    def survives(mutant: Mutant) -> bool:
        tree = trees.get()
        path, source = tree / mutant.file, (ROOT / mutant.file).read_bytes()
        path.write_bytes(mutant.apply(source))
        alive = passes(tree, mutant.area, mutant.file, limits[mutant.area])
        path.write_bytes(source)
        trees.put(tree)
        console().print(Text(f"{'survived' if alive else 'killed  '} {mutant.id}", style="red" if alive else "dim"))
        return alive

    with ThreadPoolExecutor(jobs) as pool:
        return [m for m, alive in zip(chosen, pool.map(survives, chosen), strict=True) if alive]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", metavar="TEXT", help="mutants whose id contains this")
    parser.add_argument("--list", action="store_true", help="print the sample")
    parser.add_argument("--jobs", type=int, default=1, help="mutants at a time")
    given = parser.parse_args()
    chosen, reasons = [m for m in sample() if given.only in m.id], tomllib.loads(REASONS.read_text())
    shown = chosen
    if not given.list:
        with tempfile.TemporaryDirectory() as folder:
            trees: SimpleQueue[Path] = SimpleQueue()
            for k in range(given.jobs):
                trees.put(Path(shutil.copytree(ROOT, Path(folder) / str(k), symlinks=True, ignore=UNCOPIED)))
            shown = survivors(chosen, trees, given.jobs)
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("mutant" if given.list else "survivor", "change", "reason"):
        table.add_column(name, overflow="fold")
    for m in shown:
        table.add_row(Text(m.id), m.change, Text(reasons.get(m.id, "")))
    console().print(table)
    if not given.list:
        console().print(f"{len(chosen)} mutants, {len(shown)} survived, {ACCEPTED} may, each with a reason")
        sys.exit(len(shown) > ACCEPTED or any(m.id not in reasons for m in shown))


if __name__ == "__main__":
    main()
