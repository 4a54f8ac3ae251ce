"""What checks and V-curves share: the page, the rows and the exit code of a verdict."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.study import Found, Kept, Note, Say
from gradient_routes.bench.store.output_files import Output, read_by
from gradient_routes.bench.verification.page import page
from gradient_routes.bench.verification.result import Check, rows
from gradient_routes.problems.errors import RoutesError

LOST = 1  # exit code where the page asked for could not be written


def page_writable(html: Path | None, kept: Path | None, read: Iterable[Path | str | None]) -> None:
    """Raise InputError now rather than after all is measured, and for a page that would replace what is read."""
    if html is not None:
        _output(html).check([*([] if kept is None else [kept]), *read_by(*read)])


def conclude(say: Say, check: Check, what: Row, html: Path | None) -> int:
    """Write the page, say the verdict and its rows; the exit code."""
    for table, of in rows(check, what).items():
        for row in of:
            say(Kept(table, row))
    written = None if html is None else _written(check, html)
    say(Found(check))
    if written is not None:
        say(written)
    return check.exit_code if written is None or written.result else LOST


def _written(check: Check, html: Path) -> Note:
    """What to say of the page: a result, or why it is lost."""
    try:
        with _output(html).text() as file:
            file.write(page(check))
    except RoutesError as error:
        return Note(str(error))
    return Note(f"page in {html}", result=True)


def _output(html: Path) -> Output:
    return Output("--html", html, (".html", ".htm"))
