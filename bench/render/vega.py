"""A figure as a Vega-Lite specification: the same one for the page, PNG, SVG and PDF."""

from __future__ import annotations

import json

from gradient_routes.bench.render import marks
from gradient_routes.bench.render.figure import Figure
from gradient_routes.bench.render.style import FAINT, INK, PAPER, SOFT
from gradient_routes.bench.render.view import Spec, View, calculate, datum

FIRST = 6  # panels shown before one asks for all
NAMED = 3  # pairs of curves that are named
CONFIG: Spec = {
    "background": PAPER,
    "font": "Liberation Sans, Arial, Helvetica, sans-serif",
    "view": {"stroke": None},
    "axis": {
        "domainColor": SOFT,
        "tickColor": SOFT,
        "gridColor": FAINT,
        "labelColor": SOFT,
        "labelOverlap": "greedy",
        "labelSeparation": 4,
        "titleColor": INK,
        "titleFontWeight": "normal",
        "titleLimit": 330,
    },
    "header": {"labelColor": INK, "labelFontSize": 12, "labelFontWeight": "bold", "labelLimit": 400, "title": None},
    "legend": {"orient": "bottom", "columns": 4, "labelColor": INK, "labelLimit": 320, "title": None}
    | {"titleColor": INK},
    "text": {"color": INK, "fontSize": 11},
    "rule": {"color": SOFT},
}


def spec(figure: Figure, x: int = 0, y: int = 0) -> Spec:
    """Of the figure on these of its axes; its data are those named "rows"."""
    assert figure.mark is not None
    view = View(figure, figure.x[x], figure.y[y])
    layers = [
        *(marks.front(view) if figure.front else []),
        *(marks.diagonal(view) if figure.diagonal else []),
        *marks.ends(view),
        *marks.MARKS[figure.mark](view),
        *marks.zeros(view),
        *(marks.notes(view) if figure.note else []),
        *marks.guides(view),
    ]
    picked = {"name": "picked", "select": {"type": "point", "fields": ["_series"]}, "bind": "legend"}
    if figure.mark != "cells":
        next(layer for layer in layers if "opacity" in layer["encoding"])["params"] = [picked]
    width, height = view.size
    inner = {"width": width, "height": height, "layer": layers}
    whole: Spec = {"data": {"name": "rows"}, "transform": _derived(view), "config": CONFIG, "description": figure.title}
    if not any(figure.panels):
        return whole | inner
    facet = {"field": "_panel", "type": "nominal", "sort": panels(figure)}
    how = "shared" if figure.mark == "cells" else "independent"
    resolve = {"scale": {"x": how, "y": how}}
    return whole | {"facet": facet, "columns": 4 if figure.mark == "cells" else 2, "spec": inner, "resolve": resolve}


def _derived(view: View) -> list[Spec]:
    """_x, _y and _series of every row; what a logarithmic axis cannot show is none."""
    figure = view.figure
    made: list[Spec] = []
    if figure.fold:
        made.append({"fold": list(figure.fold), "as": ["_column", "_value"]})
        name = f"({json.dumps(dict(figure.fold))})[datum._column]"
        made.append(calculate("_series", f"{name} + datum._series"))
        if figure.mark == "cells":
            made.append(calculate("_panel", f"datum._panel + ': ' + {name}"))
    for key, axis in (("_x", view.x), ("_y", view.y)):
        value = datum(axis.column or "_value")
        made.append(calculate(key, f"{value} > 0 ? {value} : null" if axis.scale == "log" else value))
    if view.zeros:
        made.append(calculate("_zero", f"{datum(view.y.column or '_value')} === 0 && isValid(datum._x)"))
    return made


def panels(figure: Figure) -> list[str]:
    """Their names, in order."""
    names = list(dict.fromkeys(figure.panels))
    if figure.mark == "cells":
        return [f"{name}: {folded}" for name in names for folded in figure.fold.values()]
    return names


def overlaps(figure: Figure) -> str:
    """The curves of a figure that lie on each other, in words."""
    covered = View(figure, figure.x[0], figure.y[0]).covered if figure.mark else []
    pairs = list(dict.fromkeys((under, over) for _, under, over in covered))
    told = [f"{under} and {over}" for under, over in pairs[:NAMED]] + ["and others"] * (len(pairs) > NAMED)
    return f" The wider line is seen below one that lies on it: {'; '.join(told)}." if pairs else ""


def records(figure: Figure) -> list[Spec]:
    """The rows with what they are drawn as, then the guides."""
    blank = ("",) * len(figure.table.rows)
    drawn = zip(figure.panels or blank, figure.series or blank, figure.lines or blank, strict=True)
    names = (*figure.table.names, "_panel", "_series", "_line")
    rows = [dict(zip(names, (*row, *more), strict=True)) for row, more in zip(figure.table.rows, drawn, strict=True)]
    return rows + guides(figure)


def guides(figure: Figure) -> list[Spec]:
    """One record for each panel that a guide is in."""
    return [
        {"_axis": g.axis, "_guide": g.value, "_label": g.label, "_of": g.column, "_panel": panel, "_below": g.below}
        for g in figure.guides
        for panel in dict.fromkeys(figure.panels or [""])
        if g.panel in ("", panel)
    ]


def svg(figure: Figure) -> str:
    """The first panels on the first axes."""
    import vl_convert

    first = set(list(dict.fromkeys(figure.panels or [""]))[:FIRST])
    rows = [row for row in records(figure) if row["_panel"] in first]
    return str(vl_convert.vegalite_to_svg(spec(figure) | {"datasets": {"rows": rows}}))
