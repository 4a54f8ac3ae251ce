"""What holds for every study: how it ends is stored, rows are checked where they are said, a view loses no row."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Column, Table
from gradient_routes.bench.cases.study import Found, Kept, Say, Study
from gradient_routes.bench.cli import main
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.command import command_of
from gradient_routes.problems.errors import InputError

TABLES = {"measured": Table((Column("x", "REAL", "1", "a number"),), ("x",))}


def run(say: Say, *, does: str, **options: Any) -> int | None:
    if does == "unknown-column":
        say(Kept("measured", {"x": 1.0, "y": 2.0}))
    if does == "unknown-table":
        say(Kept("others", {"x": 1.0}))
    say(Kept("measured", {"x": 1.0}))
    if does == "fail":
        raise ValueError("mine")
    if does == "interrupt":
        raise KeyboardInterrupt
    say(Found("shown"))
    return {"code": 3, "too-large": 256}.get(does)


def show(out: Any, value: Any, plots: bool) -> None:
    raise ZeroDivisionError("a view that fails")


@pytest.fixture
def trial(monkeypatch: pytest.MonkeyPatch, cli) -> Any:
    """routes trial --does WHAT, with a view or without."""

    def call(does: str, view: str | None = None, *options: str) -> Any:
        here = "test_study"
        study = Study(
            "trial", "?", TABLES, f"{here}:run", view=view and f"{here}:{view}", options=(click.option("--does"),)
        )
        monkeypatch.setitem(registry.studies(), "trial", study)
        monkeypatch.setitem(main.commands, "trial", command_of(study))
        from gradient_routes.bench.store import schema

        monkeypatch.setitem(schema.tables(), "measured", (schema.KEY, *TABLES["measured"].columns))
        return cli("trial", "--does", does, "--no-isolate", *options)

    return call


def ended() -> tuple[str, str | None, int]:
    """Status and reason of the only study in the store, and its number of rows."""
    (study,) = Store(Path("results/routes.sqlite")).records("studies")
    assert study["study"] == "trial"
    return study["status"], study["reason"], len(Store(Path("results/routes.sqlite")).records("measured"))


@pytest.mark.parametrize(
    ("does", "code", "status"),
    [("well", 0, "ok"), ("code", 3, "ok"), ("fail", 1, "failed"), ("interrupt", 130, "interrupted")],
)
def test_rows_are_kept_with_how_the_study_ended(trial, does: str, code: int, status: str) -> None:
    ran = trial(does)
    assert ran.code == code
    assert (ended()[0], ended()[2]) == (status, 1)
    assert "nothing is kept" not in ran.err


def test_a_view_that_fails_loses_no_row(trial) -> None:
    ran = trial("well", "show")
    assert (ran.code, ended()[0], ended()[2]) == (1, "failed", 1)
    assert ran.err.startswith("routes: trial: ZeroDivisionError: a view that fails")


@pytest.mark.parametrize("does", ["unknown-column", "unknown-table"])
def test_rows_that_are_not_declared_are_refused_where_they_are_said(trial, does: str) -> None:
    ran = trial(does)
    assert ran.code == 1
    assert re.search(r"routes: trial: a row of '\w+' has not the columns that are declared", ran.err)


def test_an_exit_code_that_a_shell_cannot_have_is_refused(trial) -> None:
    ran = trial("too-large")
    assert (ran.code, "returned 256" in ran.err) == (1, True)


@pytest.mark.parametrize(
    ("odd", "tables"),
    [(name, {name: TABLES["measured"]}) for name in ("cases", "my-table", "studies")]
    + [("study_id", {"t": Table((Column("study_id", "TEXT", "", ""),))})],
)
def test_names_that_a_store_cannot_have_are_refused(odd: str, tables: dict[str, Table]) -> None:
    point = SimpleNamespace(name="trial", dist=None, load=lambda: Study("trial", "?", tables))
    with pytest.raises(InputError, match=f"study 'trial' of trial: a table or column cannot be named '{odd}'"):
        registry.Entry("study", point).load()
