"""Figures as one JSON object that stands inside a page: each table and style once, texts of a column once."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from gradient_routes.bench.render.figure import Axis, Facet, Figure, Section, Table
from gradient_routes.bench.render.picking import bare, in_order
from gradient_routes.bench.render.style import Style, of_route


class Styles:
    """Styles by their number."""

    def __init__(self) -> None:
        self.known: dict[Style, int] = {}

    def __call__(self, style: Style) -> int:
        return self.known.setdefault(style, len(self.known))


def payload(sections: Sequence[Section]) -> tuple[str, list[Style]]:
    """The JSON, in which nothing ends a <script>, and the styles it refers to."""
    styles = Styles()
    tables: list[Table] = []
    figures = [_figure(figure, tables, styles) for section in sections for figure in section.figures]
    routes = [{"name": name, "s": styles(of_route(name))} for name in route_names(sections)]
    made = {
        "tables": [_table(table) for table in tables],
        "figures": figures,
        "routes": routes,
        "styles": [{"marker": s.marker, "dash": s.dash, "hollow": s.hollow} for s in styles.known],
    }
    text = json.dumps(made, allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text, list(styles.known)


def route_names(sections: Sequence[Section]) -> list[str]:
    """All routes that any table speaks of."""
    found = [
        bare(route)
        for section in sections
        for figure in section.figures
        if "route" in figure.table.names
        for route in dict.fromkeys(figure.table.column("route"))
    ]
    return in_order(filter(None, found))


def _table(table: Table) -> dict[str, Any]:
    columns = [(c.name, c.unit, c.type, c.meaning) for c in table.columns]
    data = [_texts(values) if _worded(values) else values for values in map(table.column, table.names)]
    return {"columns": columns, "data": data}


def _worded(values: list[Any]) -> bool:
    return any(isinstance(value, str) for value in values)


def _texts(values: list[Any]) -> dict[str, list[Any]]:
    """Each different text once, and where it stands; -1 where there is none."""
    of: dict[str, int] = {}
    at = [-1 if value is None else of.setdefault(_text(value), len(of)) for value in values]
    return {"of": list(of), "at": at}


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _figure(figure: Figure, tables: list[Table], styles: Styles) -> dict[str, Any]:
    place = next((i for i, table in enumerate(tables) if table == figure.table), len(tables))
    if place == len(tables):
        tables.append(figure.table)
    series = [
        {"n": s.name, "s": styles(s.style), "r": s.rows, "f": s.facet}
        | ({"x": s.x} if s.x else {})
        | ({"y": s.y} if s.y else {})
        for s in figure.series
    ]
    return {
        "id": figure.id,
        "title": figure.title,
        "says": figure.says,
        "t": place,
        "x": [_axis(axis) for axis in figure.x],
        "y": [_axis(axis) for axis in figure.y],
        "values": [_axis(axis) for axis in figure.values],
        "series": series,
        "facets": [_facet(facet) for facet in figure.facets],
        "mark": figure.mark,
        "note": figure.note,
        "hatched": figure.hatched,
        "interval": figure.interval,
        "front": figure.front,
        "diagonal": figure.diagonal,
    }


def _axis(axis: Axis) -> dict[str, str]:
    return {"c": axis.column, "label": axis.label, "unit": axis.unit, "scale": axis.scale}


def _facet(facet: Facet) -> dict[str, Any]:
    guides = [{"axis": g.axis, "value": g.value, "label": g.label, "column": g.column} for g in facet.guides]
    return {"name": facet.name, "verdict": facet.verdict, "says": facet.says, "guides": guides, "cell": facet.cell}
