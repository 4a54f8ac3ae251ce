"""Rows come in the order asked for, whatever the order in which cases end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from comparisons import row, stored

from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.studies.bill.command import Done

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
    results.show(gradients=False)  # interrupted: place 2 never comes
    assert printed(capsys) == ["complex-step"]


def test_the_table_is_in_the_order_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    results = done(as_json=False)
    take(results, 2, 0, 3, 1)
    results.show(gradients=False)
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
