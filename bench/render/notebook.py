"""A result as a notebook shows it: what it says, its figures as pictures, its numbers to unfold. Nothing is loaded."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html import escape
from importlib.util import find_spec
from typing import Any

from gradient_routes.bench.render.figure import Figure, Section, Table
from gradient_routes.bench.render.html import badge, numbers_of, told
from gradient_routes.bench.render.vega import overlaps, svg

OPEN = ("components",)  # tables that are not folded
NAMES = {"problem", "route", "optimizer", "alpha", "run", "experiment", "at", "n_param"}
MOST = 64  # rows of a table beside a picture
UNSEEN = re.compile(r' (?:aria-[\w-]+|role|class|pointer-events)="[^"]*"')  # in a picture that has a text of its own
LOOK = re.compile(r' ((?:fill|stroke|opacity|font|text-anchor)[\w-]*)="([^"]*)"')
TAG = re.compile(r"(<\w+)([^>]*)")
PLACES = re.compile(r' (?:d|transform)="[^"]*"')
DIGITS = re.compile(r"-?\d+\.\d+")  # pixels
STYLE = """<style>
.routes { max-width: 62rem } .routes p { margin: .3rem 0 } .routes .soft { opacity: .75; font-size: .92em }
.routes img { max-width: 100%; border-radius: 4px } .routes figure { margin: .8rem 0 }
.routes .scroll { overflow: auto; max-height: 24rem } .routes table { font-size: .85em } .routes .t { text-align: left }
.routes .verdict { border-radius: 3px; padding: 0 .4rem; font-weight: 600; background: #f8efd9; color: #7a5600 }
.routes .good { background: #e3f3ed; color: #00684b } .routes .bad { background: #fbe9df; color: #a83e00 }
</style>"""


def shown(name: str, verdict: str, says: str, section: Section) -> str:
    """As HTML."""
    body = "".join(map(_figure, sorted(section.figures, key=lambda figure: figure.mark is None)))
    notes = "".join(f"<p class='soft'>{escape(' '.join((note.title, note.says)))}</p>" for note in section.notes)
    head = f"<p><b>{escape(name)}</b> {badge(verdict)} {escape(says)}</p>"
    after = f"<p>{escape(section.says)}</p>" if section.says else ""
    return f"<div class='routes'>{STYLE}{head}{after}{body}{notes}</div>"


def _figure(figure: Figure) -> str:
    count = len(set(figure.panels))
    part = f" The first of {count} panels." if count > 1 else ""
    figure = _first(figure)
    rows = len(figure.table.rows)
    table = numbers_of(replace(figure, table=_telling(figure.table))) if not figure.mark or rows <= MOST else ""
    if not figure.mark:
        opened = " open" if figure.id in OPEN else ""
        says = f"<p class='soft'>{escape(figure.says)}</p>" if figure.says else ""
        return f"<details{opened}><summary>{escape(figure.title)}</summary>{table}{says}</details>"
    caption = f"<figcaption><b>{escape(figure.title)}.</b> {escape(figure.says + overlaps(figure) + part)}</figcaption>"
    folded = f"<details><summary>Numbers</summary>{table}</details>" if table else ""
    return f"<figure>{caption}{_picture(figure)}{told(figure)}{folded}</figure>"


def _first(figure: Figure) -> Figure:
    """Its first panel."""
    kept = [k for k, panel in enumerate(figure.panels) if panel == figure.panels[0]]
    if len(kept) == len(figure.panels):
        return figure

    def of(rows: tuple[Any, ...]) -> tuple[Any, ...]:
        return tuple(rows[k] for k in kept) if rows else ()

    table = Table(figure.table.columns, of(figure.table.rows))
    return replace(figure, table=table, panels=of(figure.panels), series=of(figure.series), lines=of(figure.lines))


def _picture(figure: Figure) -> str:
    if find_spec("vl_convert") is None:
        return "<p class='soft'>Figures need vl-convert: pip install 'gradient-routes[pictures]'</p>"
    code = base64.b64encode(_small(svg(figure)).encode()).decode()
    return f"<div><img alt='{escape(figure.title, quote=True)}' src='data:image/svg+xml;base64,{code}'></div>"


def _small(svg: str) -> str:
    """A third of it: every look is written once, places to a tenth of a pixel."""
    looks: dict[str, str] = {}

    def once(tag: re.Match[str]) -> str:
        look = "; ".join(f"{name}: {value}" for name, value in LOOK.findall(tag[0]))
        known = f' class="{looks.setdefault(look, f"l{len(looks)}")}"' if look else ""
        return f"{tag[1]}{known}{LOOK.sub('', tag[2])}"

    placed = PLACES.sub(lambda at: DIGITS.sub(lambda x: f"{float(x[0]):.1f}", at[0]), UNSEEN.sub("", svg))
    root, end, rest = TAG.sub(once, placed).partition(">")
    rules = "".join(f".{name} {{{look}}}" for look, name in looks.items())
    return f"{root}{end}<style>{rules}</style>{rest}"


def _telling(table: Table) -> Table:
    """Without names that are the same in every row."""
    kept = [
        k
        for k, column in enumerate(table.columns)
        if column.name not in NAMES or len(set(table.column(column.name))) > 1
    ]
    return Table(tuple(table.columns[k] for k in kept), tuple(tuple(row[k] for k in kept) for row in table.rows))
