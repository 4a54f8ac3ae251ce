"""A page as one HTML file that needs nothing else: no server, no network, and for the numbers no JavaScript."""

from __future__ import annotations

import gzip
import json
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files
from typing import Any

from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.cell import heading, shown
from gradient_routes.bench.render.figure import Figure, Note, Section, Table
from gradient_routes.bench.render.picking import in_order
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import AT_NIGHT, of_route
from gradient_routes.bench.render.vega import FIRST, guides, overlaps, panels, spec
from gradient_routes.bench.render.view import View

POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"
ROWS = 1000  # of a table that is written out
SELECTOR = re.compile(r"[^\[,]+(\[[^\]]*\])?")  # a problem without the settings of its run
FOOTER = (
    "Point at a mark to read its numbers; click a name in a legend to see its curves alone, and beside it to see all"
    " again. Numbers are below each figure: click a heading to sort by it."
)


def report(source: Source, sections: Sequence[Section]) -> str:
    """The report of a store."""
    started = sorted(row["started"][:10] for row in (*source.cases, *source.studies) if row["started"])
    when = " to ".join(dict.fromkeys((started[0], started[-1]))) if started else ""
    says = f"What dJ/dp costs by every route, how wrong it is, and why. From {source.name}"
    return page("Routes to the gradient", f"{says}{f', measured {when}' if when else ''}.", sections)


def page(title: str, says: str, sections: Sequence[Section]) -> str:
    """The whole page as text."""
    figures = [figure for section in sections for figure in section.figures]
    labels = dict(zip((figure.id for figure in figures), _labels(figures), strict=True))
    body = "".join(_section(section, labels) for section in sections)
    links = "".join(f"<li><a href='#{s.id}'>{escape(s.title)}</a></li>" for s in sections)
    drawn = any(figure.mark for figure in figures)
    library = gzip.decompress(files("gradient_routes.bench.render").joinpath("vega.js.gz").read_bytes()).decode()
    return (
        "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        f"<title>{escape(title)}</title><style>{_asset('page.css')}</style></head>\n<body>\n"
        f"<header class='title'><h1>{escape(title)}</h1><p>{escape(says)}</p>"
        + (f"<nav aria-label='Sections'><ol>{links}</ol></nav>" if len(sections) > 1 else "")
        + f"</header>\n{_filters(figures)}<main>{body}</main>\n<footer>{FOOTER if drawn else ''}</footer>\n"
        f"<script type='application/json' id='data'>{_payload(figures)}</script>\n"
        + (f"<script>{library}</script>\n" if drawn else "")
        + f"<script>{_asset('page.js')}</script>\n</body></html>\n"
    )


def _asset(name: str) -> str:
    return files("gradient_routes.bench.render").joinpath(name).read_text("utf-8")


def _labels(figures: Sequence[Figure]) -> list[str]:
    """Figures and tables are counted apart."""
    counts = {"Figure": 0, "Table": 0}
    found = []
    for figure in figures:
        kind = "Figure" if figure.mark else "Table"
        counts[kind] += 1
        found.append(f"{kind} {counts[kind]}")
    return found


def _section(section: Section, labels: dict[str, str]) -> str:
    facts = "".join(f"<div><dt>{escape(n)}</dt><dd>{escape(what)}</dd></div>" for n, what in section.facts)
    places = {name: k for k, name in enumerate(labels)}
    figures = "".join(_figure(figure, places[figure.id], labels[figure.id]) for figure in section.figures)
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
    numbers = numbers_of(figure)
    if figure.mark:
        numbers = f"<details><summary>Numbers</summary><noscript>{numbers}</noscript></details>"
    return (
        f"<figure id='{figure.id}' data-figure='{place}'><figcaption><h3><span>{label}</span> {escape(figure.title)}"
        f"</h3>{f'<p>{escape(figure.says + overlaps(figure))}</p>' if figure.says else ''}</figcaption>"
        f"<div class='tools' hidden>{_tools(figure)}</div>"
        f"{'<div class=plot></div>' if figure.mark else ''}{told(figure)}<div class='numbers'>{numbers}</div></figure>"
    )


def _tools(figure: Figure) -> str:
    made = ""
    for key, axes in (("x", figure.x), ("y", figure.y)):
        if len(axes) > 1:
            options = "".join(f"<option value='{k}'>{escape(axis.label)}</option>" for k, axis in enumerate(axes))
            made += f"<label>{key} <select data-axis='{key}'>{options}</select></label>"
    if figure.mark and (count := len(panels(figure))) > FIRST:
        made += f"<button type='button' data-do='all'>Show all {count} panels</button>"
    return f"{made}<button type='button' data-do='csv'>CSV</button>"


def told(figure: Figure) -> str:
    """What is said of each panel, the verdict first."""
    shown = [name for name in dict.fromkeys(figure.panels) if name in figure.told]
    items = [
        f"<li><b>{escape(name)}</b> {badge(figure.told[name].verdict)} {escape(figure.told[name].says)}</li>"
        for name in shown
        if figure.told[name].verdict or figure.told[name].says
    ]
    if len(items) <= FIRST:
        return f"<ul class='told'>{''.join(items)}</ul>" if items else ""
    return f"<details><summary>What is said of {len(items)} panels</summary><ul>{''.join(items)}</ul></details>"


def kind_of(verdict: str) -> str:
    """Its class: good, bad or unsure."""
    return "good" if verdict == "agrees" else "bad" if verdict.startswith(("wrong", "incons")) else "unsure"


def badge(word: str) -> str:
    return f"<span class='verdict {kind_of(word)}'>{escape(word)}</span>" if word else ""


def _note(note: Note) -> str:
    words = "".join(f"<p>{escape(heading)}</p><pre>{escape(text)}</pre>" for heading, text in note.words)
    summary = f"{escape(note.title)} <span>{escape(note.says)}</span>"
    if not words:
        return f"<p class='note'>{summary}</p>"
    data = f'data-problem="{escape(note.problem)}" data-route="{escape(note.route)}"'
    return f"<details class='note' {data}><summary>{summary}</summary>{words}</details>"


def numbers_of(figure: Figure) -> str:
    table = figure.table
    columns = [(k, table.columns[k], " class=t" if table.columns[k].type == "TEXT" else "") for k in table.known]
    head = "".join(
        f'<th scope=col{kind} title="{escape(column.meaning)}">{escape(heading(column).replace("_", " "))}</th>'
        for _, column, kind in columns
    )

    def cell(row: tuple[Any, ...], k: int, column: Any, kind: str) -> str:
        words = badge(row[k] or "") if column.name == "verdict" else escape(shown(column, row[k]))
        return f"<td{kind}>{words}"

    body = "".join(f"<tr>{''.join(cell(row, *column) for column in columns)}" for row in table.rows[:ROWS])
    more = f"<p>{left} more rows: `routes export` writes all.</p>" if (left := len(table.rows) - ROWS) > 0 else ""
    label = escape(f"Numbers of {figure.title}")
    return (
        f'<div class=scroll tabindex=0 role=region aria-label="{label}">'
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>{more}"
    )


def _filters(figures: Sequence[Figure]) -> str:
    """Boxes for all routes and problems that any table speaks of; shown by the script."""
    found: dict[str, dict[str, None]] = {"route": {}, "problem": {}}
    for table in (figure.table for figure in figures):
        for kind in found.keys() & set(table.names):
            found[kind] |= dict.fromkeys(filter(None, table.column(kind)))
    routes = in_order(map(bare, found["route"]))
    problems = list(dict.fromkeys(match[0] for name in found["problem"] if (match := SELECTOR.match(name))))

    def box(kind: str, name: str, colour: str = "") -> str:
        mark = f"<i style='background:{colour}'></i>" if colour else ""
        return f'<label><input type=checkbox checked name={kind} value="{escape(name)}">{mark}{escape(name)}</label>'

    shown = "".join(box("route", name, of_route(name).colour) for name in routes)
    listed = "".join(box("problem", name) for name in problems)
    if len(problems) > 1:
        families = [name for name in dict.fromkeys(map(bare, problems)) if sum(bare(p) == name for p in problems) > 1]
        every = "".join(box("family", name).replace("</label>", " (all)</label>") for name in families)
        shown += f"<details><summary>{len(problems)} problems</summary><div>{every}{listed}</div></details>"
    return f"<form class='filters' aria-label='Show routes and problems' hidden>{shown}</form>\n"


def _payload(figures: Sequence[Figure]) -> str:
    """What the script draws from, as JSON in which nothing ends a <script>."""
    night = dict(AT_NIGHT)
    for figure in figures:
        if figure.mark:
            night |= {s.light: s.dark for s in View(figure, figure.x[0], figure.y[0]).styles.values()}
    made = {"night": night, "first": FIRST, "figures": [_drawn(figure) for figure in figures]}
    text = json.dumps(made, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _drawn(figure: Figure) -> dict[str, Any]:
    """Its numbers column by column, what rows are drawn as, and its specifications by x and y axis."""
    table: Table = figure.table
    made: dict[str, Any] = {
        "id": figure.id,
        "columns": [[column.name, column.unit] for column in table.columns],
        "known": table.known,
        "data": [_coded(table.column(name)) for name in table.names],
    }
    if figure.mark:
        made["drawn"] = {
            name: _coded(values)
            for name, values in (("_panel", figure.panels), ("_series", figure.series), ("_line", figure.lines))
            if values
        }
        made["guides"] = guides(figure)
        made["specs"] = [[spec(figure, x, y) for y in range(len(figure.y))] for x in range(len(figure.x))]
    return made


def _coded(values: Sequence[Any]) -> Any:
    """Texts once each, and where they stand; numbers as they are."""
    if not any(isinstance(value, str) for value in values):
        return values
    known: dict[Any, int] = {}
    return {"at": [known.setdefault(value, len(known)) for value in values], "of": list(known)}
