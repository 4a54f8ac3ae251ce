"""What the verbs that end in a verdict share: one problem, one route, the files and the store, the showing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands.shared import complain
from bench.commands.studying import keep
from problems.errors import InputError

if TYPE_CHECKING:
    from bench.case import ProblemSpec, RouteSpec
    from bench.checking.result import Check
    from problems.problem import Array, Problem


def one_route(selector: str) -> RouteSpec:
    """The one route a selector names. Raises InputError for several."""
    from bench import case

    specs = case.routes([selector])
    if len(specs) != 1:
        raise InputError(f"--route {selector}: names {len(specs)} routes - name one")
    return specs[0]


def built(spec: ProblemSpec, at: str) -> tuple[Problem, Array]:
    """The problem and the point p. Raises InputError for a factory that fails in its own way."""
    from bench import case

    try:
        problem = spec()
    except (TypeError, ValueError, ArithmeticError, LookupError, AttributeError) as error:
        raise InputError(f"problem '{spec.name}' cannot be built: {type(error).__name__}: {error} - mend it") from error
    return problem, case.point(problem, at)


def page_writable(html: Path | None, kept: Path | None) -> None:
    """Raise InputError now rather than after all is measured."""
    from bench.files import check_writable

    if html is not None:
        check_writable("--html", html, [] if kept is None else [kept])


def conclude(
    check: Check,
    what: dict[str, Any],
    started: str,
    *,
    as_json: bool,
    no_plot: bool,
    html: Path | None,
    kept: Path | None,
) -> int:
    """Write the page, print the verdict or one JSON object, keep the rows; the exit code.

    The page first: a closed pipe loses no file.
    """
    from bench.checking.rows import rows
    from bench.rows import clean

    if html is not None:
        _write_page(check, html)
    if as_json:
        click.echo(json.dumps(clean(check.as_dict()), allow_nan=False))
    else:
        from bench.views.tables import console
        from bench.views.verdict import show_check

        show_check(console(), check, curves=not no_plot)
    keep(kept, rows(check, what), started, quiet=as_json)
    if html is not None:
        click.echo(f"page in {html}", err=as_json)
    return check.exit_code


def _write_page(check: Check, html: Path) -> None:
    from bench.views.page import page

    try:
        html.write_text(page(check), encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        complain(f"--html {html}: {error.strerror or error} - name a file you may write")
