"""The generated reference pages name everything that the program declares."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from typing import get_args

import click
import pytest
from commands import ROOT

import gradient_routes
from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.options import options_of
from gradient_routes.bench.cases.row import STATUSES
from gradient_routes.bench.cli import main
from gradient_routes.bench.store.schema import tables
from gradient_routes.bench.verification.result import Verdict

GENERATED = runpy.run_path(str(ROOT / "docs" / "generated.py"))


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    return GENERATED["pages"]()


def section(page: str, title: str) -> str:
    """What stands under a heading of the second level."""
    assert f"\n## {title}\n" in page
    return page.partition(f"\n## {title}\n")[2].partition("\n## ")[0]


def shown(text: str) -> str:
    """What a reader sees of Markdown: escapes taken away."""
    return text.replace("\\", "")


def test_every_command_and_option(pages: dict[str, str]) -> None:
    for name, command in main.commands.items():
        part = shown(section(pages["commands.md"], f"`routes {name}`"))
        assert " ".join((command.help or "").split("\n\n")[0].split()) in " ".join(part.split())
        for parameter in command.params:
            if isinstance(parameter, click.Option):
                assert all(name in part for name in (*parameter.opts, *parameter.secondary_opts))
                assert f"| {' '.join((parameter.help or '').split())} |" in part
            else:
                assert parameter.make_metavar(click.Context(command)) in part


@pytest.mark.parametrize("kind", ["problem", "route"])
def test_every_problem_and_route_with_its_options(pages: dict[str, str], kind: registry.Kind) -> None:
    entries = [entry for entry in registry.registered(kind) if entry.origin == registry.BUILT_IN]
    assert len(entries) >= {"problem": 3, "route": 8}[kind]
    for entry in entries:
        part = shown(section(pages[f"{kind}s.md"], entry.name))
        for option in options_of(registry.factory_of(entry.load())).values():
            assert f"| `{option.text}` | {option.help} |" in part


def test_every_column_of_every_table(pages: dict[str, str]) -> None:
    assert len(tables()) > 10
    for name, columns in tables().items():
        part = shown(section(pages["tables.md"], name))
        for column in columns:
            assert f"| `{column.name}` | {column.unit} | {column.meaning} |" in part


def test_the_committed_table_of_columns_is_up_to_date() -> None:
    assert (ROOT / "results" / "README.md").read_text() == GENERATED["tables"]("Results"), (
        "run python docs/generated.py"
    )


def test_every_verdict_status_and_public_name(pages: dict[str, str]) -> None:
    assert all(f"| `{verdict}` |" in pages["verdicts.md"] for verdict in get_args(Verdict))
    assert all(status in pages["tables.md"] for status in STATUSES)
    assert all(f"## `{name}`" in pages["python.md"] for name in gradient_routes.__all__)


@pytest.mark.parametrize("text", ["R_u^T lam = -J_u", "p -> (n_p,)", "|R| *relative* to [start] <lam, v>", "a~b #c \\"])
def test_markdown_shows_words_as_they_are(text: str) -> None:
    from markdown_it import MarkdownIt

    plain: Callable[[str], str] = GENERATED["plain"]
    (inline,) = (token for token in MarkdownIt().parse(plain(text)) if token.type == "inline")
    assert inline.children is not None
    assert [child.type for child in inline.children if child.type not in ("text", "text_special")] == []
    assert "".join(child.content for child in inline.children) == text


def test_only_changed_pages_are_written(tmp_path) -> None:
    GENERATED["write"](tmp_path / "reference")
    before = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "reference").iterdir()}
    (tmp_path / "reference" / "routes.md").write_text("old")
    GENERATED["write"](tmp_path / "reference")
    after = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "reference").iterdir()}
    assert len(before) == 8
    assert {name for name in after if after[name] != before[name]} == {"routes.md"}


def test_the_tour_is_a_page(pages: dict[str, str]) -> None:
    """With its text, code and pictures; formulas are set, links lead to pages of the site."""
    page = pages["tour.md"]
    assert page.startswith("# What a gradient can tell")
    assert page.count("```python\n") > 10
    assert page.count("src='data:image/svg+xml") > 8
    assert "<math" in page
    assert "$" not in page
    assert "](../tutorial.md)" in page
