"""What the verbs of studies share: one problem, rows that are kept and printed."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.sanitize import unread
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec
    from gradient_routes.bench.cases.row import Row

PROBLEM = "NAME or 'NAME[key=value]': one problem."
BUDGET = "Skip what is predicted to take more seconds; inf forces it."

problem_option = click.option("--problem", "selector", required=True, metavar="SELECTOR", help=PROBLEM)
budget_option = click.option("--budget", type=float, default=60.0, show_default=True, help=BUDGET)
no_plot_option = click.option("--no-plot", is_flag=True, help="Only the tables.")
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object a row and nothing else.")


def one_problem(selector: str) -> ProblemSpec:
    """The only problem that a selector names. Raises InputError."""
    from gradient_routes.bench.cases import case

    specs = case.problems([selector])
    if len(specs) != 1:
        raise InputError(f"--problem {selector}: names {len(specs)} problems - name one, without | and all")
    return specs[0]


def writable(kept: Path | None) -> None:
    """Raise InputError now rather than after all is measured."""
    from gradient_routes.bench.store.store import Store

    if kept is not None:
        Store(kept).check_writable()


def echo_json(tables: Mapping[str, Sequence[Row]]) -> None:
    """One object a line, its table among its values."""
    from gradient_routes.bench.cases.row import as_json

    try:
        for name, rows in tables.items():
            for row in rows:
                click.echo(as_json({"table": name, **row}))
    except BrokenPipeError:
        unread(sys.stdout)


def keep(kept: Path | None, tables: Mapping[str, Sequence[Row]], started: str, quiet: bool) -> None:
    """Rows of a study into the store, and a line that says so. Raises InputError where they are lost: last of all."""
    from gradient_routes.bench.store.store import Store

    if kept is None:
        return
    try:
        Store(kept).append_study(tables, started)
    except InputError as error:
        raise InputError(f"not kept: {error}") from error
    if not quiet:
        from gradient_routes.bench.render.terminal.tables import console

        console().print(f"kept in {kept}", style="dim", soft_wrap=True)
