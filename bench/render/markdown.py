"""The report as Markdown for a repository: the same sections, tables of numbers, and figures where they were drawn."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from gradient_routes.bench.render.cell import heading, shown
from gradient_routes.bench.render.figure import Figure, Section, Table
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.vega import overlaps
from gradient_routes.bench.sanitize import plain

ROWS = 40  # of a table; a repository wants a page, not a store
LONGEST = 300  # characters of a cell
SPECIAL = re.compile(r"([\\`*_{}\[\]<>|#~])")


def text(source: Source, sections: Sequence[Section], folder: str = "", drawn: Collection[str] = ()) -> str:
    """The whole report; `drawn` are the figures that lie in `folder` as PNG."""
    parts = [f"# Routes to the gradient\n\nFrom `{source.name}`.\n"]
    for section in sections:
        parts.append(f"## {section.title}\n\n{escaped(section.says)}\n" if section.says else f"## {section.title}\n")
        if section.facts:
            parts.append("\n".join(f"- **{number}** {escaped(what)}" for number, what in section.facts) + "\n")
        parts += [_figure(figure, folder, drawn) for figure in section.figures]
        for note in section.notes:
            said = "\n\n".join(fenced(words) for _, words in note.words)
            parts.append(f"**{escaped(note.title)}** {escaped(note.says)}\n\n{said}\n")
    return "\n".join(parts)


def _figure(figure: Figure, folder: str, drawn: Collection[str]) -> str:
    lines = [f"### {figure.title}\n", f"{escaped(figure.says + overlaps(figure))}\n" if figure.says else ""]
    if figure.id in drawn:
        lines.append(f"![{escaped(figure.title)}](<{folder}/{figure.id}.png>)\n")
    for name, told in figure.told.items():
        if told.says and name in figure.panels:
            verdict = f" **{escaped(told.verdict)}**" if told.verdict else ""
            lines.append(f"- {escaped(name)}{verdict}: {escaped(told.says)}")
    lines += ["", table(figure.table)]
    return "\n".join(lines)


def table(numbers: Table) -> str:
    """The first rows; the rest is in the store."""
    places = numbers.known
    columns = [numbers.columns[k] for k in places]
    lines = [
        f"| {' | '.join(escaped(heading(column)) for column in columns)} |",
        f"|{'|'.join('---' if column.type == 'TEXT' else '---:' for column in columns)}|",
    ]
    for row in numbers.rows[:ROWS]:
        cells = (escaped(shown(numbers.columns[k], row[k])) for k in places)
        lines.append(f"| {' | '.join(cells)} |")
    if len(numbers.rows) > ROWS:
        lines.append(f"\n{len(numbers.rows) - ROWS} more rows are in the store.")
    return "\n".join(lines) + "\n"


def escaped(words: str) -> str:
    """Nothing in it is markup, or a second line."""
    line = plain(" ".join(words.split()))
    return SPECIAL.sub(r"\\\1", line if len(line) <= LONGEST else f"{line[: LONGEST - 1]}…")


def fenced(words: str) -> str:
    """A block of code whose fence is longer than any in it."""
    longest = max((len(run) for run in re.findall(r"`+", words)), default=0)
    fence = "`" * max(3, longest + 1)
    return f"{fence}\n{plain(words)}\n{fence}"
