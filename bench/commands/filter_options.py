"""Options that say which rows of a store are asked for."""

from __future__ import annotations

from functools import wraps
from typing import Any

import click

from gradient_routes.bench.command_options import Command

FILTERS = (
    ("problem", "Rows of this problem, by its name without options."),
    ("route", "Rows of this route, by its name without options."),
    ("status", "Rows with this status."),
    ("verdict", "Rows with this verdict."),
    ("search", "Rows with this text in any column; upper and lower case are equal."),
)


def filter_options(command: Command) -> Command:
    """They are passed to the command as one `where`."""

    @wraps(command)
    def with_filter(*, problem: str, route: str, status: str, verdict: str, search: str, **others: Any) -> Any:
        from gradient_routes.bench.store.filter import Filter

        return command(where=Filter(problem, route, status, verdict, search), **others)

    made = with_filter
    for name, text in reversed(FILTERS):
        made = click.option(f"--{name}", default="", metavar="TEXT", help=text)(made)
    return made
