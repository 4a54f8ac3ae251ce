"""Rows come in the order asked for, whatever the order in which cases end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from comparisons import row, stored

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.sweep import How, run
from gradient_routes.bench.regression.measured import of_store
from gradient_routes.bench.render.source import read
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.bill.done import Done

ROUTES = ("adjoint", "tangent", "fd-central", "complex-step")


def done(as_json: bool) -> Done:
    return Done(None, as_json, (), views=False)


def take(results: Done, *places: int) -> None:
    for place in places:
        results.take(Outcome(row(route=ROUTES[place]), place=place))


def printed(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return [json.loads(line)["route"] for line in capsys.readouterr().out.splitlines()]


def test_a_json_row_is_printed_once_all_before_it_are(capsys: pytest.CaptureFixture[str]) -> None:
    results = done(as_json=True)
    take(results, 1)
    assert printed(capsys) == []
    take(results, 0, 3)
    assert printed(capsys) == ["adjoint", "tangent"]
    results.close(gradients=False)  # interrupted: place 2 never comes
    assert printed(capsys) == ["complex-step"]


def test_the_table_is_in_the_order_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    results = done(as_json=False)
    take(results, 2, 0, 3, 1)
    results.close(gradients=False)
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0].split("[")[0] for line in lines if line.startswith("  ") and "1 fwd" in line] == list(
        ROUTES
    )


def test_report_and_compare_group_problems_and_sort_routes(cli, tmp_path: Path) -> None:
    cases = [("block", "adjoint"), ("bar", "implicit-ad"), ("block", "fd-central"), ("bar", "adjoint")]
    stored(
        tmp_path / "s.sqlite",
        *(row(problem=p, route=r, problem_options={}, route_options={}) for p, r in cases),
        verdict=None,
    )
    for verb in (("report", "--store", "s.sqlite"), ("compare", "s.sqlite", "s.sqlite")):
        lines = [line.split()[0] for line in cli(*verb).out.splitlines() if line.startswith(("  ", "b"))]
        assert [word.strip(":") for word in lines if word[:2] in ("bl", "ba", "fd", "ad", "im")] == (
            ["block", "fd-central", "adjoint", "bar", "adjoint", "implicit-ad"]
        )
    found = json.loads(cli("compare", "s.sqlite", "s.sqlite", "--format", "json").out)["findings"]
    asked = list(dict.fromkeys((f["problem"], f["route"]) for f in found))
    assert [route for _, route in asked] == ["fd-central", "adjoint", "adjoint", "implicit-ad"]


def test_cases_are_shown_as_asked_for_whatever_the_order_in_which_they_ended(cli, tmp_path: Path) -> None:
    """A store holds them as they ended; a case that is run again keeps its place."""
    asked = ["block", "bar", "advection"]
    began = {problem: f"2026-01-02T00:00:00.00000{i}+00:00" for i, problem in enumerate(asked)}
    again = {"problem": "block", "started": "2026-01-03T00:00:00.000000+00:00"}
    ended = [{"problem": problem, "started": began[problem]} for problem in ("advection", "block", "bar")]
    rows = [row(**of, case_key=of["problem"], problem_options={}, route_options={}) for of in [*ended, again]]
    store = stored(tmp_path / "s.sqlite", *rows, verdict=None)
    assert [of["problem"] for of in read(Store(store)).cases] == asked
    assert [of.row["problem"] for of in of_store(Store(store)).cases] == asked
    for verb in (("report", "--store", "s.sqlite"), ("compare", "s.sqlite", "s.sqlite")):
        lines = [line.split()[0].strip(":") for line in cli(*verb).out.splitlines() if line.strip()]
        assert list(dict.fromkeys(word for word in lines if word in asked)) == asked


@pytest.mark.parametrize("jobs", [1, 3])
def test_cases_begin_in_the_order_asked_for(jobs: int) -> None:
    """By which they are shown later."""
    problems, routes = case.problems(["bar[n=4|3|5]"]), case.routes(["tangent", "adjoint"])
    how = How(jobs=jobs) if jobs > 1 else How(isolate=False)
    ran = sorted(run(problems, routes, Settings(timed=False), how), key=lambda outcome: outcome.place)
    started = [outcome.row["started"] for outcome in ran]
    assert started == sorted(set(started)), "no two at once"
    asked = [(n, route) for n in (4, 3, 5) for route in ("tangent", "adjoint")]
    assert [(outcome.row["n_param"], outcome.row["route"]) for outcome in ran] == asked
