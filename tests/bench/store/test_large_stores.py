"""Large stores are read in pieces, shown in part, and what is left out is said."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.invented_store import case, fill
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.row import ANSWERED
from gradient_routes.bench.render import html, source
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.store import cases as reading
from gradient_routes.bench.store import export as exporting
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.bill import done

CASES = 88  # of eight routes


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("large") / "large.sqlite"
    fill(Store(path), CASES, 0)
    return path


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything counts as large."""
    monkeypatch.setattr(source, "MOST", 20)
    monkeypatch.setattr(source.thinned, "__defaults__", (20,))
    monkeypatch.setattr(html, "ROWS", 5)
    monkeypatch.setattr(reading, "AT_ONCE", 3)
    monkeypatch.setattr(exporting, "AT_ONCE", 7)


def test_rows_read_in_part_are_those_of_the_whole(large: Path) -> None:
    store = Store(large)
    whole = store.rows()
    assert [*reading.cases(store, reading.EVERY)] == whole
    assert [row["work"] for row in reading.cases(store, ("work",))] == [row["work"] for row in whole]
    chosen = [7, 3, 80, 5, 6]
    assert [row["case_key"] for row in reading.numbered(store, chosen)] == [whole[k - 1]["case_key"] for k in chosen]


def test_the_newest_row_of_a_case_stands_where_its_first_one_stood(tmp_path: Path) -> None:
    store = Store(tmp_path / "twice.sqlite")
    fill(store, 8, 0)
    again = store.rows()[2]
    store.append(again | {"seconds": 123.0}, None)
    found = [*reading.cases(store, ("case_key", "seconds"))]
    assert [row["case_key"] for row in found] == [row["case_key"] for row in store.rows()[:8]]
    assert found[2]["seconds"] == 123.0


def test_thinned_rows_are_whole_problems(large: Path) -> None:
    rows = [*reading.cases(Store(large), source.LIGHT, parse=False)]
    ids = source.thinned(rows)
    assert 16 <= len(ids) <= 20
    problems = {row["problem_options"] for row in rows if row["case_id"] in ids}
    assert {row["case_id"] for row in rows if row["problem_options"] in problems} == {*ids}
    assert len(source.thinned(rows, 5)) <= 5
    assert source.thinned(rows, 1000) == [row["case_id"] for row in rows]


def test_a_report_counts_all_cases_and_says_that_it_shows_some(cli, large: Path) -> None:
    ran = cli("report", "--store", str(large), "-o", "report.html")
    assert f"report of {CASES} cases" in ran.out
    page = Path("report.html").read_text()
    assert f"<dt>{CASES}</dt><dd>cases: " in page
    shown = len(source.read(Store(large)).cases)
    assert page.count(f"{shown} of {CASES} cases are shown, those of evenly spaced problems") >= 3
    assert "more rows: `routes export` writes all" in page
    assert max(table.count("<tr>") for table in page.split("<table>")) <= 5 + 1


def test_so_do_tables_in_the_terminal(cli, large: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tables, "MOST", 20)
    out = cli("report", "--store", str(large)).out
    assert f"of {CASES} rows are shown, those of evenly spaced problems" in out
    assert len(out.splitlines()) < CASES
    monkeypatch.setattr("gradient_routes.bench.commands.status_view.MOST", 4)
    status = cli("status", "--store", str(large)).out
    assert "... 7 more problems; --json has all" in status
    assert len(cli("status", "--store", str(large), "--json").rows) == CASES
    monkeypatch.setattr("gradient_routes.bench.regression.view.MOST", 10)
    compared = cli("compare", str(large), str(large))
    assert compared.code == 0
    assert f"10 of {CASES} cases, those that changed first; --format json has all" in compared.out


def test_an_export_in_pieces_is_the_whole_table(cli, large: Path) -> None:
    names, records = Store(large).table("cases")
    assert cli("export", "--store", str(large), "-o", "cases.csv").code == 0
    with open("cases.csv", newline="") as file:
        heading, *rows = csv.reader(file)
    assert (heading, len(rows)) == (names, CASES)
    assert rows[80] == ["" if value is None else str(value) for value in records[80]]
    found = json.loads(cli("export", "--store", str(large), "--format", "json").out)
    assert found == [dict(zip(names, record, strict=True)) for record in records]
    assert json.loads(cli("export", "--store", str(large), "--format", "json", "--table", "samples").out) == []


def test_a_run_keeps_some_of_its_rows(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The first ones, and some of those that failed; all are counted."""
    monkeypatch.setattr(done, "MOST", 3)
    rng = np.random.default_rng(0)
    rows = [case(k, rng) for k in range(90)]
    results = done.Done(None, False, (), views=False)
    for place, row in enumerate(rows):
        results.take(Outcome(row, place=place))
    kept = [outcome.row["status"] for outcome in results.outcomes]
    failed = [row for row in rows if row["status"] not in ANSWERED]
    assert len(kept) == 6
    assert len([status for status in kept if status not in ANSWERED]) == 3 < len(failed)
    assert (results.count, results.failures) == (90, len(failed))
    results.close(gradients=False)
    assert "6 of 90 cases are shown; `routes export` writes all" in capsys.readouterr().out
