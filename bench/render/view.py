"""A figure on one pair of its axes: where its values go, and how its series are told apart, in Vega-Lite's words."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

from gradient_routes.bench.render.figure import Axis, Figure
from gradient_routes.bench.render.style import SOFT, Style, of_routes, others

Spec = dict[str, Any]
SIZE = {True: (340, 220), False: (640, 340)}  # [px] width, height of a panel: one of several, the only one
STEP = {True: 10, False: 22}  # [px] a category's lane for each series, or for all
CELLS = 170  # [px] longer side of a body
STRIP = 24  # [px] below a logarithmic axis for values that are exactly 0
TOLD = 10  # columns in a tooltip
DRAWN = "isValid(datum._x) && isValid(datum._y)"
SHORT = (
    "abs({0}) >= .001 && abs({0}) < 1e5 || {0} == 0"
    " ? format({0}, '.4~r') : replace(format({0}, '.2~e'), '+', '')"
)  # fmt: skip
TICK = "datum.label == '' ? '' : "  # what Vega leaves out between the powers of ten stays out
SI = TICK + "replace(format(datum.value, '.3~s'), regexp('([^0-9.−]?)$'), ' $1{}')"
UNITS = {"s": SI.format("s"), "byte": SI.format("B")}
PLAIN = TICK + SHORT.format("datum.value")


def datum(column: str) -> str:
    return f"datum[{json.dumps(column)}]"


@dataclass(frozen=True)
class View:
    """A figure on one of its x axes and one of its y axes."""

    figure: Figure
    x: Axis
    y: Axis

    @property
    def several(self) -> bool:
        return len(set(self.figure.panels)) > 1

    @property
    def size(self) -> tuple[float, float | Spec]:
        """[px] width and height of a panel; a body has its own proportions."""
        width, height = SIZE[self.several]
        if self.figure.mark == "cells":
            centres = (self.values(self.x), self.values(self.y))
            sides = [max(self.figure.table.column(side)) for side in self.figure.sides]
            spans = [max(at) - min(at) + side for at, side in zip(centres, sides, strict=True)]
            scale = CELLS / max(spans)
            return scale * spans[0], scale * spans[1]
        if self.y.scale == "category":
            return width - 100 * self.several, {"step": STEP[bool(self.figure.fold)]}
        return width, height

    @property
    def bottom(self) -> float:
        """[px] lower edge of what is plotted."""
        return SIZE[self.several][1]

    @property
    def zeros(self) -> bool:
        return self.y.scale == "log" and 0 in self.values(self.y)

    @property
    def styles(self) -> dict[str, Style]:
        names = self.figure.names
        return (of_routes(names) if self.figure.routes else others(names)) | dict(self.figure.looks)

    def values(self, axis: Axis) -> list[Any]:
        """What is drawn along it."""
        columns = [axis.column] if axis.column else list(self.figure.fold)
        return [value for column in columns for value in self.figure.table.column(column) if value is not None]

    # ---- encodings

    @cached_property
    def place(self) -> Spec:
        """Of x and y; of categories, a lane for each series that is folded."""
        made = {"x": self.position("_x", self.x), "y": self.position("_y", self.y)}
        if self.zeros:
            made["x"]["axis"]["offset"] = STRIP
        if self.y.scale == "category" and self.figure.fold:
            made["yOffset"] = {"field": "_series", "sort": self.figure.names}
        return made

    def position(self, field: str, axis: Axis) -> Spec:
        if axis.scale == "category":
            bounds = {"grid": True, "tickBand": "extent"} if self.figure.fold else {}
            shown = {"title": None, "labelLimit": 260} | bounds
            return {"field": field, "type": "nominal", "sort": None, "axis": shown}
        bars = self.figure.mark == "bars"
        scale: Spec = {"type": "log"} if axis.scale == "log" else {"zero": bars}
        if not bars:
            scale |= {"nice": False, "padding": 0 if self.figure.mark == "cells" else 10}
        if axis.domain:
            scale["domain"] = list(axis.domain)
        unit = f" [{axis.unit}]" if axis.unit and axis.unit not in UNITS else ""
        shown = {
            "title": axis.label + unit,
            "labelExpr": UNITS.get(axis.unit, PLAIN),
            "gridOpacity": {"condition": {"test": "datum.label == ''", "value": 0}, "value": 1},
        }
        if all(isinstance(value, int) for value in self.values(axis)):
            shown["tickMinStep"] = 1
        return {"field": field, "type": "quantitative", "scale": scale, "axis": shown}

    def series(self, *channels: str) -> Spec:
        """What tells series apart, with one legend for all."""
        names = self.figure.names
        looks = [self.styles[name] for name in names]
        ranges: dict[str, list[Any]] = {
            "color": [look.light for look in looks],
            "stroke": [look.light for look in looks],
            "shape": [look.marker for look in looks],
            "strokeDash": [list(look.dash) for look in looks],
        }
        unnamed = names == [""]
        return {
            channel: {
                "field": "_series",
                "type": "nominal",
                "scale": {"domain": names, "range": ranges[channel]},
                "legend": None if unnamed or channel == "stroke" else {"symbolOpacity": 1},
            }
            for channel in channels
        } | {"opacity": {"condition": {"param": "picked", "value": 0.9}, "value": 0.12}}

    @property
    def tooltip(self) -> list[Spec]:
        """A series' name, then what is drawn, then other columns."""
        known = {column.name: column for column in self.figure.table.columns}
        wanted = dict.fromkeys([self.x.column, self.y.column, "problem", "route", *known])
        made = [{"field": "_series", "title": "curve"}] if len(self.figure.names) > 1 else []
        if self.figure.fold:
            folded = next((axis for axis in (self.x, self.y) if not axis.column), self.figure.z)
            made.append({"field": "_value", "title": folded.label, "format": ".4~g", "type": "quantitative"})
        for name in [name for name in wanted if name in known][:TOLD]:
            number = {} if known[name].type == "TEXT" else {"format": ".4~g", "type": "quantitative"}
            made.append({"field": name, "title": name.replace("_", " ")} | number)
        return made

    # ---- what a reader could miss

    @cached_property
    def covered(self) -> list[tuple[str, str, str]]:
        """Panels, and pairs of curves that lie on each other there, the lower first."""
        if self.figure.mark != "line":
            return []
        curves = self._curves()  # in the order in which they are drawn
        found = []
        for ((panel, name), curve), ((other_panel, other), above) in combinations(curves.items(), 2):
            if panel == other_panel:
                both = [(curve[x], above[x]) for x in curve.keys() & above.keys()]
                if len(both) > max(2, len(curve) // 2) and self._same(both):
                    found.append((panel, name, other))
        return found

    def _curves(self) -> dict[tuple[str, str], dict[float, float]]:
        """y by x, by panel and series."""
        made: dict[tuple[str, str], dict[float, float]] = {}
        table = self.figure.table
        blank = [""] * len(table.rows)
        for column, name in (self.figure.fold or {self.y.column: ""}).items():
            x, y = (table.column(axis.column or column) for axis in (self.x, self.y))
            for panel, series, *at in zip(self.figure.panels or blank, self.figure.series or blank, x, y, strict=True):
                if None not in at:
                    made.setdefault((panel, name + series), {})[at[0]] = at[1]
        return made

    def _same(self, pairs: list[tuple[float, float]]) -> bool:
        """Whether no eye tells most of the two apart on this axis."""
        every = [value for pair in pairs for value in pair]
        room = 0.01 * (max(every) - min(every))
        if self.y.scale == "log":
            near = [a == b or (min(a, b) > 0 and max(a, b) < 1.1 * min(a, b)) for a, b in pairs]
        else:
            near = [abs(a - b) <= room for a, b in pairs]
        return sum(near) >= 0.8 * len(near)


def layer(mark: Spec, encoding: Spec, test: str, *transform: Spec) -> Spec:
    return {"mark": mark, "encoding": encoding, "transform": [{"filter": test}, *transform]}


def calculate(name: str, expression: str) -> Spec:
    return {"calculate": expression, "as": name}


def words(text: Spec, place: Spec, **mark: Any) -> Spec:
    """A layer of one text that depends on no row."""
    look = {"type": "text", "color": SOFT, "fontSize": 10} | mark
    return {"data": {"values": [{}]}, "mark": look, "encoding": {"text": text} | place}
