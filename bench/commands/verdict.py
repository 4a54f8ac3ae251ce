"""What the verbs that end in a verdict share: one problem, one route, the files and the store, the showing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bench.commands.shared import complain
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


def writable(html: Path | None, store: Path | None) -> None:
    """Raise InputError now rather than after all is measured."""
    from bench.files import check_writable
    from bench.store import Store

    if html is not None:
        check_writable("--html", html, [] if store is None else [store])
    if store is not None:
        Store(store).check_writable()


def keep(check: Check, what: dict[str, Any], store: Path | None, started: str) -> str | None:
    """Rows of the check into the store; a sentence where they are lost."""
    from bench.checking.rows import rows
    from bench.store import Store

    if store is None:
        return None
    try:
        Store(store).append_study(rows(check, what), started)
    except InputError as error:
        return str(error)
    return None


def finish(check: Check, as_json: bool, no_plot: bool, html: Path | None, kept: Path | None) -> None:
    """Write the page, then print the verdict, or one JSON object: a closed pipe loses no file."""
    from bench.rows import clean

    if html is not None:
        _write_page(check, html)
    if as_json:
        click.echo(json.dumps(clean(check.as_dict()), allow_nan=False))
    else:
        from bench.views.tables import console
        from bench.views.verdict import show_check

        out = console()
        show_check(out, check, curves=not no_plot)
        for what in ([] if kept is None else [f"kept in {kept}"]) + ([] if html is None else [f"page in {html}"]):
            out.print(what, style="dim", soft_wrap=True)


def _write_page(check: Check, html: Path) -> None:
    from bench.views.page import page

    try:
        html.write_text(page(check), encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        complain(f"--html {html}: {error.strerror or error} - name a file you may write")


def conclude(
    check: Check,
    what: dict[str, Any],
    started: str,
    *,
    as_json: bool,
    no_plot: bool,
    html: Path | None,
    store: Path | None,
) -> int:
    """Keep, show, and the exit code: what could not be kept is said after what was found."""
    lost = keep(check, what, store, started)
    finish(check, as_json, no_plot, html, None if lost else store)
    if lost is not None:
        complain(f"not kept: {lost}")
    return check.exit_code
