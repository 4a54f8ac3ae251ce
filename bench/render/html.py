"""The report as one HTML file that needs nothing else: no server, no network, and for the numbers no JavaScript."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from importlib.resources import files

from gradient_routes.bench.render.cell import heading, shown
from gradient_routes.bench.render.figure import Figure, Note, Section, Table
from gradient_routes.bench.render.payload import payload
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import Style

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"

SCRIPTS = ("numbers.js", "panel.js", "page.js")


def page(source: Source, sections: Sequence[Section]) -> str:
    """The whole page as text."""
    data, styles = payload(sections)
    labels = labelled(sections)
    body = "".join(_section(section, labels) for section in sections)
    links = "".join(f"<li><a href='#{s.id}'>{escape(s.title)}</a></li>" for s in sections)
    head = (
        "<meta charset='utf-8'><meta name='viewport' content='width=device-width, initial-scale=1'>"
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>Routes to the gradient: {escape(source.name)}</title>"
        f"<style>{_asset('page.css')}{_colours(styles)}</style>"
    )
    return (
        f"<!doctype html>\n<html lang='en'><head>{head}</head>\n<body>\n"
        f"<header class='title'><h1>Routes to the gradient</h1><p>{escape(_measured(source))}</p>"
        f"<nav aria-label='Sections'><ol>{links}</ol></nav></header>\n"
        "<div class='filters' role='group' aria-label='Show routes and problems' hidden></div>\n"
        f"<main>{body}</main>\n<footer>{FOOTER}</footer>\n"
        f"<script type='application/json' id='data'>{data}</script>\n<script>{_scripts()}</script>\n"
        "</body></html>\n"
    )


FOOTER = (
    "Drag over a figure to zoom, or click it and turn the wheel; double-click to see all again. Click a name in a"
    " legend to hide it. Arrow keys walk through the points of a figure that has the focus."
)


def _asset(name: str) -> str:
    return files("gradient_routes.bench.render").joinpath(name).read_text("utf-8")


def _scripts() -> str:
    """All in one scope of its own."""
    return '"use strict";\n(() => {\n' + "".join(map(_asset, SCRIPTS)) + "})();\n"


def _measured(source: Source) -> str:
    started = sorted(row["started"][:10] for row in (*source.cases, *source.studies) if row["started"])
    when = f", measured {started[0]}" if started else ""
    when += f" to {started[-1]}" if started and started[-1] != started[0] else ""
    return f"What dJ/dp costs by every route, how wrong it is, and why. From {source.name}{when}."


def _colours(styles: Sequence[Style]) -> str:
    """Variables of every style, by day, at night and on paper."""
    fills = "".join(f"--f{k}:{style.colour};" for k, style in enumerate(styles))
    light = "".join(f"--s{k}:{style.light};" for k, style in enumerate(styles))
    dark = "".join(f"--s{k}:{style.dark};" for k, style in enumerate(styles))
    dark += "".join(f"--f{k}:{style.dark};" for k, style in enumerate(styles) if style.dark != style.colour)
    return f":root{{{fills}{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"


def labelled(sections: Sequence[Section]) -> dict[str, tuple[int, str]]:
    """The place of every figure by its id, and its number: figures and tables are counted apart."""
    counts = {"Fig.": 0, "Table": 0}
    found = {}
    for place, figure in enumerate(figure for section in sections for figure in section.figures):
        kind = "Fig." if figure.series else "Table"
        counts[kind] += 1
        found[figure.id] = (place, f"{kind} {counts[kind]}")
    return found


def _section(section: Section, labels: dict[str, tuple[int, str]]) -> str:
    facts = "".join(f"<div><dt>{escape(n)}</dt><dd>{escape(what)}</dd></div>" for n, what in section.facts)
    figures = "".join(_figure(figure, *labels[figure.id]) for figure in section.figures)
    notes = "".join(map(_note, section.notes))
    return (
        f"<section id='{section.id}'><h2>{escape(section.title)}</h2>"
        + (f"<p>{escape(section.says)}</p>" if section.says else "")
        + (f"<dl class='facts'>{facts}</dl>" if facts else "")
        + figures
        + (f"<div class='notes'>{notes}</div>" if notes else "")
        + "</section>\n"
    )


def _figure(figure: Figure, place: int, label: str) -> str:
    says = f"<p>{escape(figure.says)}</p>" if figure.says else ""
    return (
        f"<figure class='figure' id='{figure.id}' data-figure='{place}'><figcaption><div class='words'>"
        f"<h3><span class='number-of'>{label}</span>{escape(figure.title)}</h3>{says}</div>"
        "<div class='tools'></div></figcaption><div class='legend'></div><div class='panels'></div>"
        f"<div class='numbers'></div><noscript>{_table(figure.table)}</noscript></figure>"
    )


def _note(note: Note) -> str:
    words = "".join(f"<p>{escape(heading)}</p><pre>{escape(text)}</pre>" for heading, text in note.words)
    return (
        f'<details class="note" data-problem="{escape(note.problem)}" data-route="{escape(note.route)}">'
        f"<summary>{escape(note.title)} <span>{escape(note.says)}</span></summary>{words}</details>"
    )


def _table(table: Table) -> str:
    """For those without JavaScript."""
    places = [k for k, name in enumerate(table.names) if any(value is not None for value in table.column(name))]
    columns = [(k, table.columns[k], " class=t" if table.columns[k].type == "TEXT" else "") for k in places]
    head = "".join(f"<th>{escape(heading(column))}" for _, column, _ in columns)
    lines = ("".join(f"<td{kind}>{escape(shown(c, row[k]))}" for k, c, kind in columns) for row in table.rows)
    body = "".join(f"<tr>{line}" for line in lines)
    return f"<div class='scroll'><table class=plain><thead><tr>{head}</thead><tbody>{body}</table></div>"
