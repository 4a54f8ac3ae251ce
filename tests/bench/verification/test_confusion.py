"""Zero misjudgements: every sound route agrees, every fault gets its name, on every problem where it shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import ROOT

from benchmarks.boxes import judging
from benchmarks.boxes.families import FAMILIES
from benchmarks.confusion import PROBLEMS, Cell, Judged, built, cells, judge, point
from gradient_routes.bench.cases import case
from gradient_routes.bench.verification.check import check
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.registered import subject
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Offers, Result, route

CELLS = list(cells(seed=7))
DUFFING = f"{ROOT / 'examples' / 'plugin' / 'duffing' / 'problem.py'}:Duffing"
CULPRITS = {
    "sign": "the sign of lam",
    "factor": "off by the factor 2",
    "transpose": "the solve used R_u instead of R_u^T",
    "missing-term": "J_p was dropped",
    "functional": "the functional",
    "scale": "the chain rule",
    "otd": "an adjoint discretized on its own",
    "loose": "the forward state",
    "stale": "the adjoint solve",
}


def chosen() -> list[Cell]:
    """Of the cells expected alike on problems of a kind, two on bars and one on others; the problems take turns.
    `python -m benchmarks.confusion`, a part of `make benchmark`, has all.
    """
    alike: dict[tuple[str, str, str], list[Cell]] = {}
    for cell in CELLS:
        alike.setdefault((cell.problem.partition("[")[0], cell.route, cell.expected), []).append(cell)
    picked: dict[Cell, None] = {}
    for k, ((kind, by, _), group) in enumerate(alike.items()):
        turns = (k, k + len(group) // 2) if kind == "bar" and by != "unrolled-ad" else (k,)
        picked |= dict.fromkeys(group[turn % len(group)] for turn in turns)
    return list(picked)


def names(cell: Cell) -> str:
    return f"{cell.problem}-{cell.route}"


def test_the_matrix_is_as_large_as_promised() -> None:
    assert len(CELLS) >= 60
    assert len({(cell.problem, cell.route) for cell in CELLS}) == len(CELLS)
    assert len({cell.seed for cell in CELLS}) > 10
    assert {cell.problem for cell in chosen()} == set(PROBLEMS)
    assert {(cell.route, cell.expected) for cell in chosen()} == {(cell.route, cell.expected) for cell in CELLS}


@pytest.mark.parametrize("cell", chosen(), ids=names)
def test_every_cell_gets_the_verdict_it_deserves(cell: Cell) -> None:
    judged = judge(cell)
    assert judged.right, f"{judged.check.verdict}: {judged.check.says}"
    assert judged.check.calls <= 240
    _, _, fault = cell.route.partition("fault=")
    if cell.expected != "agrees":
        assert CULPRITS[fault.rstrip("]")] in (judged.check.culprit or "")


@pytest.mark.parametrize(
    ("fault", "expected"),
    [("sign", "wrong-gradient"), ("factor", "wrong-gradient"), ("loose", "solver-limited"), ("transpose", "agrees")],
)
def test_a_problem_of_a_file_is_judged_alike(fault: str, expected: str) -> None:
    assert_cell(Cell(DUFFING, f"faulty-adjoint[fault={fault}]", expected, 3))


@pytest.mark.parametrize("route", ["fd-one-sided", "fd-central", "complex-step", "tangent", "adjoint"])
def test_sound_routes_agree_on_a_problem_of_a_file(route: str) -> None:
    assert_cell(Cell(DUFFING, route, "agrees", 3))


def assert_cell(cell: Cell) -> None:
    (spec,), (route,) = case.problems([cell.problem]), case.routes([cell.route])
    problem = spec()
    p = point(problem, cell.seed)
    found = check(subject(problem, route.route, route.options, p, Solver(rtol=cell.rtol)), Plan(seed=cell.seed))
    assert Judged(cell, found).right, found.says


@pytest.mark.parametrize("seed", range(3))
def test_errors_without_order_are_no_matter_of_the_mesh(seed: int) -> None:
    """Every component 30 % too large or too small: along smooth fields that averages out as the mesh is refined."""

    @route("scattered", needs=Offers.LINEARIZE, cost=adjoint.cost)
    def scattered(model, p, *, factors="refined"):
        J, g, *_ = adjoint.function(model, p)
        return Result(J, g * (1.0 + 0.3 * np.random.default_rng(seed).choice([-1.0, 1.0], len(g))))

    problem = built("advection")
    found = check(subject(problem, scattered, {}, point(problem, seed), Solver()), Plan(seed=seed))
    assert found.verdict == "wrong-gradient"
    assert found.refined.order == pytest.approx(0.0, abs=0.3)  # the same error on both meshes


def test_a_fault_that_cannot_show_says_so(cli) -> None:
    ran = cli("check", "--problem", "bar[parametrization=raw]", "--route", "faulty-adjoint[fault=scale]", "--no-store")
    assert ran.code == 2
    assert "needs parameters that are logarithms" in ran.err


def test_faulty_routes_are_not_among_all(cli, tmp_path: Path) -> None:
    ran = cli("run", "--problem", "bar", "--route", "all", "--json", "--no-store", "--budget", "1e-9")
    assert "faulty-adjoint" not in {row["route"] for row in ran.rows}
    assert len(ran.rows) == 7
    assert "faulty-adjoint" in cli("list", "routes").out


@pytest.mark.parametrize("part", range(4))
def test_a_box_of_every_family_is_judged_rightly(part: int) -> None:
    """Of a seed that the judge was not made with: no wrong gradient is acquitted, no right one convicted."""
    for k, name in enumerate(FAMILIES):
        if k % 4 != part:
            continue
        boxes = FAMILIES[name].boxes(7)
        judged = judging.judge(boxes[k % len(boxes)], name, "", 7)
        assert judged.fault not in ("acquitted", "convicted"), f"{judged.id}: {judged.verdict}: {judged.says}"
