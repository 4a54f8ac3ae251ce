"""routes consistency: what it costs that a gradient is not that of the discretized J."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.bench.render.source import read
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.consistency import STUDY
from gradient_routes.bench.studies.consistency.figures import section
from gradient_routes.bench.studies.consistency.measure import INCONSISTENT, TRUE, Consistency, consistency
from gradient_routes.routes.model import Model

PROBLEM = "advection[n=4,data=twin,noise=0.01,alpha=0.001]"
WRONG = {"otd", "quadrature", "stabilization", "mesh"}


def measured(problem: str = PROBLEM, routes=(TRUE, *INCONSISTENT), **engine) -> Consistency:
    (spec,) = case.problems([problem])
    return consistency(spec, case.routes(routes), Engine(limits=engine.pop("limits", Limits(200, 1e-9)), **engine))


@pytest.fixture(scope="module")
def found() -> Consistency:
    return measured()


def by_fault(found: Consistency) -> dict[str, dict]:
    return {row["route"].partition("fault=")[2].rstrip("]") or row["route"]: row for row in found.runs}


def test_the_true_gradient_goes_to_the_minimum_and_inconsistent_ones_stall_above_it(found: Consistency) -> None:
    rows = by_fault(found)
    true = rows.pop(TRUE)
    assert (true["outcome"], true["shortest_step"], true["error_start"]) == ("converged", None, 0.0)
    assert true["gradient_norm"] < 1e-7 * true["gradient_norm_start"]
    assert rows.keys() == WRONG
    for fault, row in rows.items():
        assert row["outcome"] == "stalled", fault
        assert row["above_minimum"] > 1e3 * true["above_minimum"] >= 0.0
        assert row["gradient_norm"] > 1e-4 * row["gradient_norm_start"]
        assert row["evaluations"] > row["iterations"] + 1
        assert 0.0 <= row["shortest_step"] < 1e-6
        assert row["ended"].startswith("gradient is not that of J")


def test_numbers_are_those_of_the_inversion_by_other_means(found: Consistency) -> None:
    """J, its gradient and the error at the start, evaluated here."""
    (spec,), (true, wrong) = case.problems([PROBLEM]), case.routes([TRUE, INCONSISTENT[0]])
    problem = spec()
    p = problem.parameters.start
    g, h = (way.route.prepare(Model(problem), p, **way.options)(p).gradient for way in (true, wrong))
    row = by_fault(found)["otd"]
    assert row["error_start"] == pytest.approx(np.linalg.norm(g - h) / np.linalg.norm(g), rel=1e-12)
    assert row["gradient_norm_start"] == pytest.approx(np.linalg.norm(g), rel=1e-12)
    assert row["objective_start"] == pytest.approx(Model(problem).value(p), rel=1e-12)
    assert row["objective"] - row["objective_minimum"] == row["above_minimum"]
    assert 0.5 < row["error_end"] < 2.0, "near its own zero the error is as large as the true gradient"
    assert row["error_end"] != row["error_start"]


def test_steps_end_where_the_run_does(found: Consistency) -> None:
    for row in found.runs:
        steps = [step for step in found.steps if step["route"] == row["route"]]
        assert [step["iteration"] for step in steps] == [*range(row["iterations"] + 1)]
        assert steps[-1]["objective"] == row["objective"]
        assert steps[-1]["above_minimum"] == row["above_minimum"]
        assert steps[0]["objective"] == row["objective_start"]
        assert (np.diff([step["objective"] for step in steps]) <= 0.0).all()


def test_evaluations_are_counted_until_the_end_and_the_minimum_is_that_of_all_runs() -> None:
    few = measured(routes=[TRUE], limits=Limits(2, 0.0))
    (row,) = few.runs
    assert (row["outcome"], row["iterations"], row["shortest_step"]) == ("not converged", 2, None)
    assert row["evaluations"] == few.steps[-1]["forward_solves"]  # the adjoint solves once for each
    assert row["above_minimum"] > 0.0
    assert row["objective_minimum"] < few.steps[-1]["objective"]


def test_a_finer_mesh_brings_the_stall_nearer_to_the_minimum() -> None:
    """All adjoints agree as h goes to 0."""
    faults = [f"faulty-adjoint[fault={fault}]" for fault in ("otd", "stabilization")]
    coarse, fine = (measured(f"advection[n={n},data=twin,alpha=0.001]", faults) for n in (4, 8))
    for one, other in zip(coarse.runs, fine.runs, strict=True):
        assert other["error_start"] < one["error_start"]
        assert other["above_minimum"] / other["objective_start"] < one["above_minimum"] / one["objective_start"]


def test_what_cannot_run_is_a_row_that_says_why(tmp_path: Path) -> None:
    done = measured("bar", [TRUE, INCONSISTENT[0]])
    assert [row["status"] for row in done.runs] == ["ok", "skipped"]
    assert "needs an adjoint equation of its own" in done.runs[1]["reason"]
    file = tmp_path / "mine.py"
    file.write_text(
        "from gradient_routes.problems.problem import Offers\n"
        "from gradient_routes.routes.route import Work, route\n"
        "@route('mine', needs=Offers.SOLVE, cost=lambda n_p, forward: Work())\n"
        "def mine(model, p):\n    raise ZeroDivisionError('mine')\n"
    )
    (row,) = measured("bar", [f"{file}:mine"]).runs
    assert (row["status"], row["reason"]) == ("failed", "ZeroDivisionError: mine")


def test_the_command_prints_a_narrow_table_and_keeps_rows(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    ran = cli("consistency", "--problem", PROBLEM, "--no-plot")
    assert (ran.code, ran.err) == (0, "")
    lines = ran.out.splitlines()
    table = lines[: next(k for k, line in enumerate(lines) if line.startswith("error: of the gradient"))]
    assert max(map(len, table)) <= 80
    assert [line.split()[0] for line in table[2:]] == ["adjoint", "otd", "quadrature", "stabilization", "mesh"]
    assert ran.out.count(" stalls after ") == 4
    store = Store(Path("results/routes.sqlite"))
    assert [row["outcome"] for row in store.records("consistency")] == ["converged"] + ["stalled"] * 4
    drawn = section(read(store))
    assert drawn is not None
    assert [figure.id for figure in drawn.figures] == ["consistency", "stalls"]
    assert "4 of 5 line searches have stalled; the highest, faulty-adjoint[fault=mesh]" in drawn.figures[1].says


def test_json_is_rows_of_the_declared_columns(cli) -> None:
    ran = cli("consistency", "--problem", PROBLEM, "--route", "adjoint", "--iterations", "3", "--json", "--no-store")
    assert {row["table"] for row in ran.rows} == set(STUDY.tables)
    for row in ran.rows:
        assert row.keys() - {"table"} == {column.name for column in STUDY.tables[row["table"]].columns}


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--iterations", "0"), "--iterations 0"),
        (("--tolerance", "1"), "--tolerance 1 - give a number >= 0 and < 1"),
        (("--problem", "all"), "name one"),
        (("--route", "nobody"), "no route 'nobody'"),
        (("--optimizer", "adam"), "'adam'"),
    ],
)
def test_wrong_usage_is_one_line(cli, arguments: tuple[str, ...], says: str) -> None:
    ran = cli("consistency", "--no-store", *arguments)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err
