"""Some rows of a store: the same ones by export and by report."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import Ran

from benchmarks.invented_store import fill
from gradient_routes.bench.store.filter import Filter
from gradient_routes.bench.store.store import Store


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("filter") / "s.sqlite"
    fill(Store(path), 40)
    return path


@pytest.mark.parametrize(
    "options",
    [
        {"route": "adjoint"},
        {"route": "fd-central", "status": "ok"},
        {"status": "pruned"},
        {"search": "Number 8"},
        {"problem": "bar", "search": '"n": 16'},
        {"problem": "block"},
        {},
    ],
)
def test_export_and_report_take_the_rows_that_hold_every_value(
    kept: Path, cli: Callable[..., Ran], options: dict[str, str]
) -> None:
    given = [text for name, value in options.items() for text in (f"--{name}", value)]
    whole = json.loads(cli("export", "--format", "json", "--store", str(kept)).out)
    found = json.loads(cli("export", "--format", "json", "--store", str(kept), *given).out)
    exact = {name: value for name, value in options.items() if name != "search"}
    text = options.get("search", "").lower()
    assert found == [
        row
        for row in whole
        if all(row[name] == value for name, value in exact.items())
        and any(text in str(value).lower() for value in row.values() if value is not None)
    ]
    said = cli("report", "-o", "r.md", "--store", str(kept), *given)
    assert said.out == f"report of {len(found)} cases in r.md\n"


@pytest.mark.parametrize("command", ["export", "report"])
def test_that_nothing_is_as_asked_is_said(kept: Path, cli: Callable[..., Ran], command: str) -> None:
    ran = cli(command, "--problem", "bar[n=16]", "--store", str(kept))
    assert ran.code == 0
    assert "is as asked - name problems and routes without options" in ran.err


def test_variants_of_a_name_are_its_own(kept: Path) -> None:
    assert Filter(problem="bar").keeps({"problem": "bar[n=8], at true"})
    assert not Filter(problem="bar").keeps({"problem": "barrel"})
    assert not Filter(problem="bar").keeps({"problem": None})
    assert Filter(verdict="agrees").keeps({"problem": "bar"})  # of columns that are not there nothing is asked


def test_a_filter_by_a_column_that_the_table_lacks_is_refused(kept: Path, cli: Callable[..., Ran]) -> None:
    refused = cli("export", "--table", "points", "--status", "ok", "--store", str(kept))
    assert (refused.code, refused.err) == (
        2,
        "routes: export: table 'points' has no column 'status' - leave --status out\n",
    )
