"""Where a report goes: what cannot be written is refused before anything is built."""

from __future__ import annotations

import os
from pathlib import Path

from gradient_routes.bench.render import html, markdown, pictures
from gradient_routes.bench.render.figure import Section
from gradient_routes.bench.render.sections import sections
from gradient_routes.bench.render.source import Source, read
from gradient_routes.bench.store.filter import EVERYTHING, Filter
from gradient_routes.bench.store.output_files import Output, print_bytes
from gradient_routes.bench.store.store import Store

STDOUT = Path("-")
SUFFIXES = (".html", ".htm", ".md", ".markdown")


def report(
    store: Store, output: Path | None, format: str | None, folder: Path | None, where: Filter = EVERYTHING
) -> list[str]:
    """Write what is asked for: a page or Markdown to `output` (stdout where none), figures to `folder`.

    Sentences for what was written. Raises RoutesError.
    """
    file = None if output in (None, STDOUT) or output is None else Output("report -o", output, SUFFIXES)
    if file is not None:
        file.check([store.path])
    if folder is not None:
        pictures.check(folder)
    source = read(store, where)
    made = sections(source)
    drawn = [] if folder is None else pictures.write(made, folder, store.path)
    said = [] if folder is None else [f"{len(drawn)} figures as {', '.join(pictures.FORMATS)} in {folder}"]
    if format is not None:
        text = _text(source, made, format, output, folder, drawn)
        _write(file, text.encode("utf-8", "backslashreplace"))
        said += [] if file is None else [f"report of {source.counts.cases} cases in {output}"]
    return said


def _text(
    source: Source, made: list[Section], format: str, output: Path | None, folder: Path | None, drawn: list[str]
) -> str:
    if format == "html":
        return html.report(source, made)
    beside = Path.cwd() if output in (None, STDOUT) or output is None else output.resolve().parent
    where = "" if folder is None else Path(os.path.relpath(folder.resolve(), beside)).as_posix()
    return markdown.text(source, made, where, drawn)


def _write(file: Output | None, content: bytes) -> None:
    if file is None:
        print_bytes(content)
        return
    with file.open() as target:
        target.write(content)
