"""What the verbs that end in a verdict share: one problem, one route, the files and the store, the showing."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.command_options import complain
from gradient_routes.bench.studies.study import keep
from gradient_routes.problems.errors import InputError, RoutesError

LOST = 2  # exit code where the page asked for could not be written

if TYPE_CHECKING:
    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.verification.result import Check
    from gradient_routes.problems.problem import Array, Problem


def one_route(selector: str) -> RouteSpec:
    """The one route a selector names. Raises InputError for several."""
    from gradient_routes.bench.cases import case

    specs = case.routes([selector])
    if len(specs) != 1:
        raise InputError(f"--route {selector}: names {len(specs)} routes - name one")
    return specs[0]


def built(spec: ProblemSpec, at: str) -> tuple[Problem, Array]:
    """The problem and the point p. Raises InputError for a factory that fails in its own way."""
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.verification.guarded import FOREIGN

    try:
        with stdout_to_stderr():
            problem = spec()
    except (RoutesError, MemoryError):
        raise
    except FOREIGN as error:
        said = " ".join(str(error).split())
        raise InputError(f"problem '{spec.name}' cannot be built: {type(error).__name__}: {said} - mend it") from error
    return problem, case.point(problem, at)


def page_writable(html: Path | None, taken: Iterable[Path | str | None]) -> None:
    """Raise InputError now rather than after all is measured, and for a page that would replace what is read."""
    from gradient_routes.bench.store.output_files import check_writable

    if html is not None:
        files = [Path(str(name).partition(":")[0].partition("[")[0]) for name in taken if name is not None]
        check_writable("--html", html, files)


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
    from gradient_routes.bench.cases.row import clean
    from gradient_routes.bench.verification.result import rows

    lost = html is not None and not _write_page(check, html)
    if as_json:
        click.echo(json.dumps(clean(check.as_dict()), allow_nan=False))
    else:
        from gradient_routes.bench.render.terminal.tables import console
        from gradient_routes.bench.verification.view import show_check

        show_check(console(), check, curves=not no_plot)
    keep(kept, rows(check, what), started, quiet=as_json)
    if html is not None and not lost:
        click.echo(f"page in {html}", err=as_json)
    return LOST if lost else check.exit_code


def _write_page(check: Check, html: Path) -> bool:
    from gradient_routes.bench.verification.page import page

    try:
        html.write_text(page(check), encoding="utf-8", errors="backslashreplace")
    except OSError as error:
        complain(f"--html {html}: {error.strerror or error} - name a file you may write")
        return False
    return True
