"""A check as a page: the verdict, its curves, its evidence, as a section of the report."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.render import html, notebook
from gradient_routes.bench.render.figure import Axis, Figure, Note, Section, Table
from gradient_routes.bench.render.picking import real, text
from gradient_routes.bench.render.style import DASHES, GREY, Style, of_route
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check
from gradient_routes.bench.verification.table import HEADINGS, LEGEND, rows

QUOTIENTS = {"error_one_sided": "one-sided", "error_central": "central"}
TIGHTENED = ", tightened solve"
LOOKS = {"one-sided": of_route("fd-one-sided"), "central": of_route("fd-central")}
LOOKS |= {name + TIGHTENED: replace(style, dash=DASHES[1]) for name, style in LOOKS.items()}
LOOKS["central" + TIGHTENED] = Style("#0072B2", "circle", DASHES[1])
STEP = Axis("step", "step h, relative", scale="log")
OFF = Axis("", "error |quotient − g·v|, relative", scale="log")
LINES = tuple(text(name) for name in HEADINGS)
SOUND = {True: "ok", False: "NO", None: "?"}
NOISE = "noise of J over h"
POINTS = (
    text("line", "direction in the space of parameters"),
    real("step", "1", "relative to max(|p_i|, s_i)"),
    real("error_one_sided", "1", "|one-sided quotient - g.v|, relative"),
    real("error_central", "1", "|central quotient - g.v|, relative"),
    real("noise", "1", "what the noise of J makes of a quotient, relative"),
    real("factor", "1", "of the solver's tolerance"),
)
COMPONENTS = (
    text("component", "a parameter"),
    real("gradient", "", "what the gradient says"),
    real("differences", "", "what difference quotients say"),
    real("ratio", "1", "the first over the second"),
)
FINDINGS = (
    text("test", "what was tested"),
    text("result", "ok, NO, or ? where it could not be told"),
    real("value", "1", "what was measured"),
    real("limit", "1", "beyond which it fails"),
    text("says", "what it means"),
)


def page(check: Check) -> str:
    """The whole page as text."""
    return html.page(f"{check.name}: {check.verdict}", check.says, [section(check)])


def fragment(check: Check) -> str:
    """What a notebook shows."""
    return notebook.shown(check.name, check.verdict, check.says, section(check))


def section(check: Check) -> Section:
    """The deciding line first, then the others that were swept as widely."""
    figures = [table("lines", "Lines", LEGEND, LINES, [cells for _, cells in rows(check)])] if check.readings else []
    figures += [curves(check)] if check.deciding else []
    if check.located is not None and check.located.worst:
        worst = [(w.name, w.given, w.found, w.factor) for w in check.located.worst]
        figures.append(table("components", "Wrong components", "Those that are off by most.", COMPONENTS, worst))
    if check.findings:
        found = [
            (f.name, SOUND[f.sound], f.value, f.limit, "; ".join(filter(None, (f.says, f.culprit))))
            for f in check.findings
        ]
        figures.append(table("findings", "Second evidence", "Tests of another kind.", FINDINGS, found))
    counted = f"{check.calls} objective calls, gradients: {check.gradients}"
    notes = tuple(Note("note:", remark) for remark in (*check.not_done, *check.remarks, counted))
    return Section("check", "What the verdict rests on", f"Next: {check.todo}", tuple(figures), notes=notes)


def table(id: str, title: str, says: str, columns: Sequence[Column], cells: Sequence[Sequence[Any]]) -> Figure:
    names = [column.name for column in columns]
    return Figure(id, title, says, Table.of(columns, [dict(zip(names, row, strict=True)) for row in cells]))


def curves(check: Check) -> Figure:
    """Errors over steps of each line swept as widely as the deciding one, those of tightened solves beside them."""
    assert check.deciding is not None
    wide = len(check.deciding.quotients.h)
    shown = [check.deciding, *(r for r in check.readings if r is not check.deciding and len(r.quotients.h) >= wide)]
    tightened = [(t.reading, t.factor) for t in check.tightened]
    points = [row for reading, factor in [*((r, 1.0) for r in shown), *tightened] for row in _points(reading, factor)]
    return Figure(
        "curves",
        "Error of difference quotients against the step",
        "A wrong gradient shows as a plateau that no step removes.",
        Table.of(POINTS, points),
        "line",
        x=(STEP,),
        y=(OFF,),
        series=tuple("" if row["factor"] == 1.0 else f"{TIGHTENED} x {row['factor']:g}" for row in points),
        panels=tuple(f"along {row['line']}" for row in points),
        fold=QUOTIENTS | {"noise": NOISE},
        looks=LOOKS | {NOISE: GREY},
    )


def _points(reading: Reading, factor: float) -> Iterator[dict[str, Any]]:
    made, scale = reading.quotients, reading.scale or 1.0
    errors = np.abs([made.off_forward, made.off_central]) / scale
    least = min((e for e in errors.flat if e > 0.0 and math.isfinite(e)), default=0.0)
    for h, one_sided, central in zip(made.h.tolist(), *errors.tolist(), strict=True):
        noise = (reading.noise or 0.0) / (math.sqrt(2.0) * h) / scale
        seen = {"noise": noise if factor == 1.0 and noise >= least else None, "factor": factor}
        known = {"error_one_sided": one_sided if factor == 1.0 else None, "error_central": central}
        yield {"line": made.line.name, "step": h} | known | seen
