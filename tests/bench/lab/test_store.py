"""A store on the page: its rows are those of `routes export`, its figures those of `routes report`."""

from __future__ import annotations

import json
import shlex
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from commands import Ran
from playwright.sync_api import Page, expect

from benchmarks.invented_store import fill
from gradient_routes.bench.lab import looking
from gradient_routes.bench.lab.parts.store import KeptRows
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.store.filter import Filter
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.store.store import SCHEMA, Store
from gradient_routes.problems.errors import InputError


def part(path: Path, **state: str) -> KeptRows:
    return KeptRows(Place(None, None, path.parent, path), state)  # type: ignore[arg-type]


def test_a_state_is_a_command(kept: Path) -> None:
    state = {"table": "cases", "route": "adjoint", "ended": "ok", "search": "-x y"}
    command = ("export", "--table", "cases", "--route", "adjoint", "--status", "ok", "--search=-x y")
    assert part(kept, **state).command() == (*command, "--store", str(kept))
    assert part(kept, table="samples", route="adjoint").command()[:3] == ("export", "--table", "samples")
    assert "--route" not in part(kept, table="samples", route="adjoint").command()  # it has no such column
    assert part(kept, show="figures", verdict="agrees").command()[:5] == (
        "report", "-o", "report.html", "--verdict", "agrees",
    )  # fmt: skip


def test_a_table_that_there_is_not_is_refused_in_one_line(kept: Path) -> None:
    assert "table stays cases" in part(kept, table="../../etc/passwd").status.object


@pytest.mark.parametrize("table", [*tables()])
def test_the_rows_sent_are_some_of_those_that_the_filter_leaves(kept: Path, table: str) -> None:
    rows = looking.rows(Store(kept), table, Filter(), 0)
    assert rows.every == rows.kept == len(Store(kept).table(table)[1])
    assert rows.text.count("<tr>") == (1 + min(rows.kept, looking.MOST) if rows.kept else 0)


def test_names_of_a_store_are_no_markup(tmp_path: Path) -> None:
    path = tmp_path / "s.sqlite"
    fill(Store(path), 8)
    with sqlite3.connect(path) as db:
        db.execute("UPDATE cases SET route = ?, reason = ?", ("<img src=x onerror=alert(1)>", "</table><script>"))
    text = looking.rows(Store(path), "cases", Filter(), 0).text
    assert "<img" not in text
    assert "<script" not in text


def not_there(path: Path) -> str:
    return "no such file - run `routes run` first"


def empty(path: Path) -> str:
    path.touch()
    return "is empty - run `routes run` first"


def broken(path: Path) -> str:
    path.write_bytes(b"SQLite format 3\0" + bytes(2000))
    return "name a file you may write"


def newer(path: Path) -> str:
    fill(Store(path), 8)
    with sqlite3.connect(path) as db:
        db.execute(f"PRAGMA user_version = {SCHEMA + 1}")
    return f"has schema {SCHEMA + 1}"


def torn(path: Path) -> str:
    fill(Store(path), 400)
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    return "malformed"


@pytest.mark.parametrize("spoil", [not_there, empty, broken, newer, torn])
def test_what_is_no_store_is_refused_in_one_line(tmp_path: Path, spoil: Callable[[Path], str]) -> None:
    path = tmp_path / "s.sqlite"
    says = spoil(path)
    for look in (
        lambda: looking.rows(Store(path), "cases", Filter(), 0),
        lambda: looking.drawn(Store(path), Filter(), ""),
    ):
        with pytest.raises(InputError) as refused:
            look()
        assert says in str(refused.value)
        assert "\n" not in str(refused.value)


def test_a_store_that_another_program_holds_is_said_to_be_locked(tmp_path: Path) -> None:
    path = tmp_path / "s.sqlite"
    fill(Store(path), 8)
    with sqlite3.connect(path) as db:
        db.execute("BEGIN EXCLUSIVE")
        with pytest.raises(InputError, match="locked - try again later"):
            looking.rows(Store(path, patience=0.0), "cases", Filter(), 0)


def test_the_page_shows_the_rows_that_the_command_exports(
    page: Page, laboratory: str, kept: Path, cli: Callable[..., Ran]
) -> None:
    page.goto(f"{laboratory}/store")
    expect(page.locator("thead th").first).to_have_text("case_id")
    choices = looking.rows(Store(kept), "cases", Filter(), 0).choices
    for name, value in (("route", "adjoint"), ("status", "ok")):
        page.get_by_label(name, exact=True).select_option(f"{value} ({choices[name][value]})")
    expect(page.locator("code").last).to_contain_text("--status ok")
    command = shlex.split(page.locator("code").last.text_content() or "")
    rows = json.loads(cli(*command[1:], "--format", "json").out)
    expect(page.locator("td:first-child")).to_have_text([str(row["case_id"]) for row in rows])
    expect(page.get_by_text(f"Rows 1 to {len(rows)} of {len(rows)} of 240 rows.")).to_be_visible()
    expect(page).to_have_url(f"{laboratory}/store?route=adjoint&ended=ok")


def test_the_section_that_is_asked_for_is_drawn(kept: Path) -> None:
    found = [looking.drawn(Store(kept), Filter(), section).section for section in ("vcurves", "bill", "no such")]
    assert found == ["vcurves", "bill", "bill"]


def test_figures_are_drawn_on_the_page(page: Page, laboratory: str) -> None:
    page.goto(f"{laboratory}/store?show=figures&section=vcurves")
    inside = page.frame_locator("iframe")
    inside.locator(".plot").first.scroll_into_view_if_needed()
    expect(inside.locator(".plot svg").first).to_be_visible()
