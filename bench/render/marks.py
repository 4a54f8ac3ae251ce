"""What is drawn, as layers of Vega-Lite: marks, and the annotations about them. A new one is a function here."""

from __future__ import annotations

import json
from collections.abc import Callable

from gradient_routes.bench.render.figure import Axis
from gradient_routes.bench.render.style import FAINT, PAPER, SOFT
from gradient_routes.bench.render.view import DRAWN, SHORT, STRIP, Spec, View, calculate, datum, layer, words

DENSE = 30  # points of a line that are drawn small


def points(view: View, size: int = 45) -> list[Spec]:
    """With their numbers where they stand in rows."""
    hollow = view.figure.hollow
    look = view.series("color", "shape", "stroke") | {"fillOpacity": {"value": 0.8}, "tooltip": view.tooltip}
    if hollow:
        look["fillOpacity"]["condition"] = {"test": f"!!{datum(hollow)}", "value": 0}
    mark = {"type": "point", "filled": True, "size": size, "strokeWidth": 1.2}
    numbers = [count(view, dx=8, dy=-7 if view.x.ends else 0)] if view.y.scale == "category" else []
    return [layer(mark, view.place | look, DRAWN), *numbers]


def line(view: View) -> list[Spec]:
    """Interrupted where a value is unknown; wide where another lies on it."""
    under = sorted({f"{panel}\n{name}" for panel, name, _ in view.covered})
    wide = {"test": f"indexof({json.dumps(under)}, datum._panel + '\\n' + datum._series) >= 0", "value": 5}
    path = view.series("color", "strokeDash") | {"detail": {"field": "_line"}}
    path["strokeWidth"] = {"condition": wide, "value": 1.5}
    if view.figure.order:
        path["order"] = {"field": view.figure.order, "type": "quantitative"}
    of = view.figure.lines or view.figure.series or view.figure.panels
    dense = len(view.figure.table.rows) > DENSE * len(set(of))
    return [layer({"type": "line"}, view.place | path, "isValid(datum._x)"), *points(view, 8 if dense else 22)]


def bars(view: View) -> list[Spec]:
    """Lengths from 0, with their numbers."""
    look = view.series("color") | {"tooltip": view.tooltip}
    return [layer({"type": "bar"}, view.place | look, DRAWN), count(view, dx=4)]


def cells(view: View) -> list[Spec]:
    """Rectangles coloured by a value; crossed where it says nothing."""
    place: Spec = {}
    corners = []
    for key, axis, side in zip("xy", (view.x, view.y), view.figure.sides, strict=True):
        place |= {key: view.position(f"_{key}_0", axis), f"{key}2": {"field": f"_{key}_1"}}
        corners += [calculate(f"_{key}_{k}", f"datum._{key} + {k - 0.5} * {datum(side)}") for k in (0, 1)]
    values = view.values(view.figure.z)
    signed = min(values, default=0) < 0 < max(values, default=0)
    colours: Spec = {"scheme": "redblue", "domainMid": 0} if signed else {"scheme": "cividis"}
    if view.figure.z.domain:
        colours["domain"] = list(view.figure.z.domain)
    legend = {"title": view.figure.z.label, "gradientLength": 200, "format": ".3~g"}
    unknown = {"condition": {"test": "!isValid(datum._value)", "value": FAINT}}
    colour = unknown | {"field": "_value", "type": "quantitative", "scale": colours, "legend": legend}
    rectangle = {"type": "rect", "stroke": PAPER, "strokeWidth": 0.5}
    layers = [layer(rectangle, place | {"color": colour, "tooltip": view.tooltip}, DRAWN, *corners)]
    if view.figure.hollow:
        cross = {
            "type": "point",
            "shape": "M-1,-1L1,1M-1,1L1,-1",
            "size": 60,
            "strokeWidth": 1.5,
            "color": "white",
            "aria": False,
        }
        at = {key: {"field": f"_{key}", "type": "quantitative"} for key in "xy"}
        layers.append(layer(cross, at, f"{DRAWN} && !!{datum(view.figure.hollow)}"))
    return layers


MARKS: dict[str, Callable[[View], list[Spec]]] = {"points": points, "line": line, "bars": bars, "cells": cells}

# ---- annotations


def count(view: View, dx: int, dy: int = 0) -> Spec:
    mark = {"type": "text", "align": "left", "dx": dx, "dy": dy}
    number = calculate("_count", SHORT.format("datum._x"))
    return layer(mark, view.place | {"text": {"field": "_count"}}, DRAWN, number)


def zeros(view: View) -> list[Spec]:
    """Exact zeros have no place on a logarithmic axis: a strip of their own, below it."""
    if not view.zeros:
        return []
    at = {"y": {"value": view.bottom + STRIP / 2}}
    look = view.series("color", "shape") | {"tooltip": view.tooltip}
    return [
        layer({"type": "point", "filled": True, "size": 45}, {"x": view.place["x"]} | at | look, "datum._zero"),
        {"data": {"values": [{}]}, "mark": {"type": "rule"}, "encoding": {"y": {"value": view.bottom}}},
        words({"value": "exactly 0"}, {"x": {"value": -6}} | at, align="right"),
    ]


def ends(view: View) -> list[Spec]:
    """Intervals; where one end is absent, to the edge of the panel."""
    layers = []
    for key, axis, low_edge, high_edge in (("x", view.x, 0, view.size[0]), ("y", view.y, view.bottom, 0)):
        for of, to, edge in _spans(axis, low_edge, high_edge):
            at = view.place | {
                key: view.place[key] | {"field": of},
                f"{key}2": {"field": to} if to else {"value": edge},
            }
            known = [_known(end, axis) if end in (of, to) else f"!({_known(end, axis)})" for end in axis.ends or ()]
            layers.append(layer({"type": "rule"}, at | view.series("color"), " && ".join([DRAWN, *known])))
    return layers


def _spans(axis: Axis, low_edge: float, high_edge: float) -> list[tuple[str, str, float]]:
    """From one column to another, or to an edge."""
    if axis.ends is None:
        return []
    low, high = axis.ends
    return [(low, high, 0.0), (low, "", high_edge), (high, "", low_edge)]


def _known(column: str, axis: Axis) -> str:
    return f"{datum(column)} > 0" if axis.scale == "log" else f"isValid({datum(column)})"


def guides(view: View) -> list[Spec]:
    """Lines with their labels; where what is below means nothing, it is shaded and the label stands there."""
    layers = []
    once = f" && datum._column == '{next(iter(view.figure.fold))}'" if view.figure.fold else ""
    found = {(g.axis, g.below) for g in view.figure.guides if g.column in ("", getattr(view, g.axis).column)}
    for key, below in sorted(found):
        shown = f"(!datum._of || datum._of == '{getattr(view, key).column}')"
        test = f"datum._axis == '{key}' && datum._below == {str(below).lower()} && {shown}{once}"
        at: Spec = {key: view.place[key] | {"field": "_guide"}}
        place: Spec = {"y": {"value": 8}} if key == "x" else {"x": {"value": 4}}
        look = {"align": "right" if below and key == "x" else "left"}
        offset = {"dx": -4 if below else 4} if key == "x" else {"dy": 8 if below else -6}
        if below:
            edge = {f"{key}2": {"value": 0 if key == "x" else view.bottom + STRIP * view.zeros}}
            layers.append(layer({"type": "rect", "color": SOFT, "opacity": 0.1, "aria": False}, at | edge, test))
        layers.append(layer({"type": "rule", "strokeDash": [4, 3]}, at, test))
        layers.append(layer({"type": "text"} | look | offset, at | place | {"text": {"field": "_label"}}, test))
    return layers


def front(view: View) -> list[Spec]:
    """Of each problem, the points that no other beats on both axes."""
    best = {
        "window": [{"op": "min", "field": "_y", "as": "_best"}],
        "frame": [None, 0],
        "groupby": ["problem"],
        "sort": [{"field": "_x"}, {"field": "_y"}],
    }
    mark = {"type": "line", "strokeWidth": 0.7, "opacity": 0.4, "color": SOFT}
    unbeaten = {"filter": "datum._y <= datum._best"}
    return [layer(mark, view.place | {"detail": {"field": "problem"}}, DRAWN, best, unbeaten)]


def diagonal(view: View) -> list[Spec]:
    """x = y, over all that both axes show."""
    known = [value for axis in (view.x, view.y) for value in view.values(axis) if value > 0]
    corners = [{"_x": value, "_y": value} for value in (min(known), max(known))]
    mark = {"type": "line", "strokeDash": [4, 3], "strokeWidth": 1, "color": SOFT}
    return [{"data": {"values": corners}, "mark": mark, "encoding": view.place}]


def notes(view: View) -> list[Spec]:
    mark = {"type": "text", "align": "left", "dx": 4, "dy": -12}
    said = {"text": {"field": view.figure.note}}
    return [layer(mark, view.place | said, f"{DRAWN} && !!{datum(view.figure.note)}")]
