"""Where a report goes: what cannot be written is refused before anything is built."""

from __future__ import annotations

import os
from pathlib import Path

import click

from gradient_routes.bench.render import html, markdown, pictures
from gradient_routes.bench.render.figure import Section
from gradient_routes.bench.render.sections import sections
from gradient_routes.bench.render.source import Source, read
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

STDOUT = Path("-")


def report(store: Store, output: Path | None, format: str | None, folder: Path | None) -> list[str]:
    """Write what is asked for: a page or Markdown to `output` (stdout where none), figures to `folder`.

    Sentences for what was written. Raises InputError.
    """
    if output not in (None, STDOUT):
        assert output is not None
        _check(store, output)
    if folder is not None:
        pictures.check(folder)
    source = read(store)
    made = sections(source)
    drawn = [] if folder is None else pictures.write(made, folder)
    said = [] if folder is None else [f"{len(drawn)} figures as {', '.join(pictures.FORMATS)} in {folder}"]
    if format is not None:
        text = _text(source, made, format, output, folder, drawn)
        _write(output or STDOUT, text)
        said += [] if output in (None, STDOUT) else [f"report of {len(source.cases)} cases in {output}"]
    return said


def _text(
    source: Source, made: list[Section], format: str, output: Path | None, folder: Path | None, drawn: list[str]
) -> str:
    if format == "html":
        return html.report(source, made)
    beside = Path.cwd() if output in (None, STDOUT) or output is None else output.resolve().parent
    where = "" if folder is None else Path(os.path.relpath(folder.resolve(), beside)).as_posix()
    return markdown.text(source, made, where, drawn)


def _check(store: Store, output: Path) -> None:
    if output.is_dir():
        raise InputError(f"report -o {output}: is a directory - name a file in it: {output}/report.html")
    if output.exists() and store.path.exists() and output.samefile(store.path):
        raise InputError(f"report -o {output}: is the store itself - name another file")
    new = not output.exists()
    try:
        output.open("ab").close()
    except OSError as error:
        raise InputError(f"report -o {output}: {error.strerror} - name a file you may write") from error
    if new:
        output.unlink()


def _write(output: Path, text: str) -> None:
    try:
        with click.open_file(str(output), "wb") as file:
            file.write(text.encode("utf-8", "backslashreplace"))
    except BrokenPipeError:
        raise
    except OSError as error:
        raise InputError(f"report -o {output}: {error.strerror} - name a file you may write") from error
