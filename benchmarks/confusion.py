"""What `routes check` misjudges: every route on every problem, and black boxes of many kinds.

    python -m benchmarks.confusion [--matrix | --boxes] [--seeds N] [--only TEXT] [--jobs N] [--json FILE]

The matrix: each cell is one check of a route on a problem at a random point. The boxes: `benchmarks/boxes/`, of
seeds 0 to N - 1; --only selects those whose id FAMILY/BOX@SEED contains TEXT. Exit code: 1 where a cell is misjudged
or a wrong gradient is told `agrees`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from benchmarks.boxes import report
from benchmarks.boxes.judging import judge_all
from gradient_routes.bench.cases import case
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.verification.check import check
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.registered import subject
from gradient_routes.bench.verification.result import Check, Verdict
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.newton import Solver

SOUND = ("fd-one-sided", "fd-central", "complex-step", "tangent", "adjoint", "unrolled-ad", "implicit-ad")
PROBLEMS = (
    "bar[n=12,alpha=0.3]",
    "bar[parametrization=raw,alpha=0.3,sensors=8]",
    "bar[n=30,sensors=30,noise=0.01]",
    "bar[stop=penalty]",
    "bar[stop=multiplier]",
    "bar[stop=softplus,gap=1.0]",
    "block[n=2,derivatives=hand]",
    "block[nx=1,ny=1,nz=2,load=follower,derivatives=hand]",
    "advection",
    "advection[unknown=source,alpha=0.1]",
)
SPREAD = 0.3  # distance from the start, in natural changes, at which a problem is tested

WRONG: Verdict = "wrong-gradient"
LOOSE: Verdict = "solver-limited"
# a fault, its expected verdict, and the problems on which it shows; `sign` shows on all
FAULTS: tuple[tuple[str, Verdict, tuple[str, ...]], ...] = (
    ("sign", WRONG, PROBLEMS),
    ("factor", WRONG, PROBLEMS),
    ("transpose", WRONG, (PROBLEMS[7], PROBLEMS[8], PROBLEMS[9])),
    ("missing-term", WRONG, (PROBLEMS[0], PROBLEMS[1], PROBLEMS[9])),
    ("functional", WRONG, (*PROBLEMS[:6], PROBLEMS[8], PROBLEMS[9])),
    ("scale", WRONG, (PROBLEMS[0], *PROBLEMS[2:9])),
    ("otd", "inconsistent-discretization", (PROBLEMS[8], PROBLEMS[9])),
    ("loose", LOOSE, (PROBLEMS[5], PROBLEMS[6], PROBLEMS[7])),
    ("stale", LOOSE, (PROBLEMS[5], PROBLEMS[6], PROBLEMS[7])),
)
INVISIBLE = (
    ("transpose", PROBLEMS[0]),
    ("transpose", PROBLEMS[6]),
    ("stale", PROBLEMS[0]),
)  # these faults change nothing there
STALE_RTOL = 1e-6  # old factors are the worse, the looser the solve


@dataclass(frozen=True)
class Cell:
    """One check and its expected verdict."""

    problem: str
    route: str
    expected: Verdict
    seed: int
    rtol: float = 1e-12


@dataclass(frozen=True)
class Judged:
    cell: Cell
    check: Check

    @property
    def right(self) -> bool:
        return self.check.verdict == self.cell.expected


@dataclass
class Matrix:
    """All cells."""

    cells: list[Judged] = field(default_factory=list)

    @property
    def misjudged(self) -> list[Judged]:
        return [judged for judged in self.cells if not judged.right]


def cells(seed: int = 0) -> Iterator[Cell]:
    """Every sound route on every problem, every fault on the problems it shows on."""
    for k, problem in enumerate(PROBLEMS):
        for route in SOUND:
            yield Cell(problem, route, "agrees", seed + k)
    for fault, verdict, problems in FAULTS:
        for k, problem in enumerate(problems):
            rtol = STALE_RTOL if fault == "stale" else Cell.rtol
            yield Cell(problem, f"faulty-adjoint[fault={fault}]", verdict, seed + 100 + k, rtol)
    for k, (fault, problem) in enumerate(INVISIBLE):
        yield Cell(problem, f"faulty-adjoint[fault={fault}]", "agrees", seed + 200 + k)


@cache
def built(selector: str) -> Problem:
    """Built once, so that its cells share compiled code."""
    (spec,) = case.problems([selector])
    return spec()


def point(problem: Problem, seed: int) -> Array:
    """A point near the start, where no symmetry hides a term."""
    parameters = problem.parameters
    away = SPREAD * parameters.scale * np.random.default_rng(seed).uniform(-1.0, 1.0, len(parameters))
    return parameters.check(parameters.start + away, problem.name)


def judge(cell: Cell) -> Judged:
    """Run one check."""
    problem = built(cell.problem)
    (spec,) = case.routes([cell.route])
    looked_at = subject(problem, spec.route, spec.options, point(problem, cell.seed), Solver(rtol=cell.rtol))
    return Judged(cell, check(looked_at, Plan(seed=cell.seed)))


def matrix(which: Iterable[Cell]) -> Matrix:
    return Matrix([judge(cell) for cell in which])


def table(found: Matrix) -> Table:
    """Routes and faults by problems; wrong verdicts in red."""
    problems = list(dict.fromkeys(judged.cell.problem for judged in found.cells))
    by = {(judged.cell.route, judged.cell.problem): judged for judged in found.cells}
    out = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    out.add_column("route", no_wrap=True)
    for k in range(len(problems)):
        out.add_column(str(k + 1), no_wrap=True)
    for route in dict.fromkeys(judged.cell.route for judged in found.cells):
        line = [by.get((route, problem)) for problem in problems]
        out.add_row(Text(route), *(_cell(judged) for judged in line))
    return out


SHORT = {"agrees": "agrees", WRONG: "wrong", LOOSE: "solver", "inconsistent-discretization": "mesh"}


def _cell(judged: Judged | None) -> Text:
    if judged is None:
        return Text("")
    return Text(SHORT.get(judged.check.verdict, judged.check.verdict), style="" if judged.right else "bold red")


def show_matrix(out: Console) -> bool:
    """Whether no cell is misjudged."""
    found = matrix(cells())
    out.print(table(found))
    for k, problem in enumerate(PROBLEMS):
        out.print(Text(f"{k + 1}: {problem}", style="dim"))
    out.print(f"{len(found.cells)} cells, {len(found.misjudged)} misjudged")
    for judged in found.misjudged:
        out.print(Text(f"{judged.cell}: {judged.check.verdict}: {judged.check.says}", style="red"))
    return not found.misjudged


def show_boxes(out: Console, seeds: int, only: str, jobs: int, json: Path | None) -> bool:
    """Whether no wrong gradient is acquitted."""
    found = judge_all(seeds, only, jobs)
    if not found:
        sys.exit(f"confusion: no box contains {only!r} - see `--boxes --seeds 1` for their ids")
    report.show(out, found)
    if json is not None:
        report.write(found, json)
    return not any(judged.fault == "acquitted" for judged in found)


def positive(text: str) -> int:
    """A whole number of at least 1. Raises ArgumentTypeError."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} - give a whole number, 1 at least")
    return int(text)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--matrix", action="store_true", help="only routes on problems")
    parser.add_argument("--boxes", action="store_true", help="only black boxes")
    parser.add_argument("--seeds", type=positive, default=5, help="of each family of boxes")
    parser.add_argument("--only", default="", metavar="TEXT", help="boxes whose id FAMILY/BOX@SEED contains TEXT")
    parser.add_argument("--jobs", type=positive, default=2, help="processes")
    parser.add_argument("--json", type=Path, metavar="FILE", help="every check of a box")
    given = parser.parse_args()
    if given.json is not None and not given.json.parent.is_dir():
        parser.error(f"--json {given.json}: there is no folder {given.json.parent} - name one that exists")
    out, sound = console(), True
    if given.matrix or not given.boxes:
        sound &= show_matrix(out)
    if given.boxes or not given.matrix:
        sound &= show_boxes(out, given.seeds, given.only, given.jobs, given.json)
    sys.exit(0 if sound else 1)


if __name__ == "__main__":
    main()
