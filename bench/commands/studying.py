"""What the verbs of studies share: one problem, rows that are kept and printed."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from problems.errors import InputError

if TYPE_CHECKING:
    from bench.case import ProblemSpec
    from bench.rows import Row
    from bench.store import Store

PROBLEM = "NAME or 'NAME[key=value]': one problem."
BUDGET = "Skip what is predicted to take more seconds; inf forces it."

problem_option = click.option("--problem", "selector", required=True, metavar="SELECTOR", help=PROBLEM)
budget_option = click.option("--budget", type=float, default=60.0, show_default=True, help=BUDGET)
no_plot_option = click.option("--no-plot", is_flag=True, help="Only the tables.")
json_option = click.option("--json", "as_json", is_flag=True, help="One JSON object a row and nothing else.")


def one_problem(selector: str) -> ProblemSpec:
    """The only problem that a selector names. Raises InputError."""
    from bench import case

    specs = case.problems([selector])
    if len(specs) != 1:
        raise InputError(f"--problem {selector}: names {len(specs)} problems - name one, without | and all")
    return specs[0]


def checked(budget: float) -> float:
    if not budget > 0:
        raise InputError(f"--budget {budget:g} - give seconds > 0, or inf")
    return budget


def writable(store: Path, no_store: bool) -> Store | None:
    """The store, tried before anything is measured. Raises InputError."""
    if no_store:
        return None
    from bench.store import Store

    kept = Store(store)
    kept.check_writable()
    return kept


def now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="milliseconds")


def echo_json(tables: Mapping[str, Sequence[Row]]) -> None:
    """One object a line, its table among its values."""
    from bench.rows import as_json

    for name, rows in tables.items():
        for row in rows:
            click.echo(as_json({"table": name, **row}))


def keep(store: Store | None, tables: Mapping[str, Sequence[Row]], started: str, quiet: bool) -> None:
    if store is not None:
        store.append_study(tables, started)
        if not quiet:
            from bench.views.tables import console

            console().print(f"kept in {store.path}", style="dim", soft_wrap=True)
