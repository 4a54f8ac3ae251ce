"""A check as one HTML page that needs nothing else: the verdict, its curves as SVG, its evidence."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from gradient_routes.bench.render.format import number
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check
from gradient_routes.bench.verification.table import HEADINGS, LEGEND, rows
from gradient_routes.problems.problem import Array

COLOURS = {"agrees": "#009E73", "wrong-gradient": "#D55E00", "inconsistent-discretization": "#D55E00"}
INCONCLUSIVE = "#B8860B"
WIDTH, HEIGHT, LEFT, RIGHT, BOTTOM, TOP = 640, 360, 64, 20, 44, 12  # [px]
TIGHTENED = ("#0072B2", "#56B4E9", "#009E73")
SHORT = 24  # characters of a cell that is not broken
HIGHEST = 1.0  # decades above 1 that are drawn

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
h1 { font-size: 1.4rem } h2 { font-size: 1.1rem; margin-top: 2rem }
table { border-collapse: collapse; font-size: .9rem }
th, td { padding: .2rem .7rem; text-align: left; vertical-align: top }
td { font-variant-numeric: tabular-nums } td.short { white-space: nowrap } tr.no { color: #b00 }
thead { border-bottom: 1px solid #888 } figure { margin: 1rem 0; overflow-x: auto }
svg text { font: 12px system-ui, sans-serif } .note { color: #555; font-style: italic }
"""


@dataclass(frozen=True)
class Trace:
    """Errors (m,) over steps (m,) under one name, in one colour."""

    name: str
    h: Array
    error: Array
    colour: str

    @property
    def points(self) -> list[tuple[float, float]]:
        pairs = zip(self.h.tolist(), self.error.tolist(), strict=True)
        return [(math.log10(x), math.log10(y)) for x, y in pairs if math.isfinite(y) and y > 0.0]


def page(check: Check) -> str:
    """The whole page as text."""
    colour = COLOURS.get(check.verdict, INCONCLUSIVE)
    body = [
        f"<h1>{escape(check.name)}: <span style='color:{colour}'>{check.verdict}</span></h1>",
        f"<p>{escape(check.says)}</p><p><b>Next:</b> {escape(check.todo)}</p>",
    ]
    if check.readings:
        body.append(f"<h2>Lines</h2>{_lines(check)}{_components(check)}")
    body += [f"<figure>{svg(curves(check, r))}</figure>" for r in _drawn(check)]
    if check.findings:
        body.append(f"<h2>Second evidence</h2>{_findings(check)}")
    body += [f"<p class='note'>{escape(remark)}</p>" for remark in (*check.not_done, *check.remarks)]
    body.append(f"<p class='note'>{check.calls} objective calls, {check.gradients} gradient</p>")
    title = escape(f"{check.name}: {check.verdict}")
    meta = "<meta charset='utf-8'><meta name='viewport' content='width=device-width'>"
    head = f"<head>{meta}<title>{title}</title><style>{STYLE}</style></head>"
    return f"<!doctype html>\n<html lang='en'>{head}\n<body>{''.join(body)}</body></html>\n"


def _drawn(check: Check) -> list[Reading]:
    """The deciding line first, then the others that were swept as widely."""
    if check.deciding is None:
        return []
    others = [
        r for r in check.readings if r is not check.deciding and len(r.quotients.h) >= len(check.deciding.quotients.h)
    ]
    return [check.deciding, *others]


def curves(check: Check, reading: Reading) -> tuple[str, list[Trace]]:
    """A title and the errors of one line, with those of the tightened solve where it was this line's."""
    made, scale = reading.quotients, reading.scale or 1.0
    found = [
        Trace("one-sided", made.h, np.abs(made.off_forward) / scale, "#E69F00"),
        Trace("central", made.h, np.abs(made.off_central) / scale, "#D55E00"),
    ]
    for t, colour in zip(check.tightened, TIGHTENED, strict=False):
        if t.reading.quotients.line.name == made.line.name:
            errors = np.abs(t.reading.quotients.off_central) / scale
            found.append(Trace(f"central, tightened x {t.factor:g}", t.reading.quotients.h, errors, colour))
    if reading.noise:
        least = min((10.0**y for c in found for _, y in c.points), default=0.0)
        noise = reading.noise / (math.sqrt(2.0) * made.h) / scale
        found.append(Trace("noise of J over h", made.h, np.where(noise >= least, noise, np.nan), "#999999"))
    return f"error of quotients along {made.line.name}, relative", found


def svg(titled: tuple[str, Sequence[Trace]]) -> str:
    """Log-log, decades as grid lines."""
    title, found = titled
    points = [p for c in found for p in c.points if p[1] <= HIGHEST]
    if not points:
        return f"<p>{escape(title)}: nothing to draw</p>"
    xs, ys = zip(*points, strict=True)
    x_0, x_1 = math.floor(min(xs)), max(math.ceil(max(xs)), math.floor(min(xs)) + 1)
    y_0, y_1 = math.floor(min(ys)), max(math.ceil(max(ys)), math.floor(min(ys)) + 1)

    def at(x: float, y: float) -> tuple[float, float]:
        right, up = (x - x_0) / (x_1 - x_0), (y - y_0) / (y_1 - y_0)
        return LEFT + right * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - BOTTOM - TOP)

    parts = [f"<svg viewBox='0 0 {WIDTH} {HEIGHT + 20 * len(found)}' width='{WIDTH}' role='img'>"]
    parts.append(f"<title>{escape(title)}</title>")
    for x in range(x_0, x_1 + 1, max(1, math.ceil((x_1 - x_0) / 8))):
        (left, low), (_, high) = at(x, y_0), at(x, y_1)
        parts.append(f"<path d='M{left:.1f} {low:.1f}V{high:.1f}' stroke='#eee'/>")
        parts.append(f"<text x='{left:.1f}' y='{low + 16:.1f}' text-anchor='middle'>1e{x}</text>")
    for y in range(y_0, y_1 + 1, max(1, math.ceil((y_1 - y_0) / 8))):
        (left, low), (right, _) = at(x_0, y), at(x_1, y)
        parts.append(f"<path d='M{left:.1f} {low:.1f}H{right:.1f}' stroke='#eee'/>")
        parts.append(f"<text x='{LEFT - 6}' y='{low + 4:.1f}' text-anchor='end'>1e{y}</text>")
    for k, curve in enumerate(found):
        places = [at(*p) for p in curve.points if p[1] <= HIGHEST]
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        dash = "" if k < 2 else " stroke-dasharray='5 3'"
        parts.append(f"<polyline points='{line}' fill='none' stroke='{curve.colour}' stroke-width='1.5'{dash}/>")
        if k < 2:
            parts += [f"<circle cx='{x:.1f}' cy='{y:.1f}' r='2.5' fill='{curve.colour}'/>" for x, y in places]
        legend = HEIGHT + 20 * k + 6
        parts.append(f"<rect x='{LEFT}' y='{legend - 8}' width='14' height='4' fill='{curve.colour}'/>")
        parts.append(f"<text x='{LEFT + 22}' y='{legend}'>{escape(curve.name)}</text>")
    parts.append(f"<text x='{WIDTH - RIGHT}' y='{HEIGHT - 8}' text-anchor='end'>h, relative</text></svg>")
    return f"<figcaption>{escape(title)}</figcaption>{''.join(parts)}"


def _lines(check: Check) -> str:
    return _table(HEADINGS, [cells for _, cells in rows(check)]) + f"<p class='note'>{escape(LEGEND)}</p>"


def _components(check: Check) -> str:
    if check.located is None or not check.located.worst:
        return ""
    cells = [(w.name, f"{w.given:.6g}", f"{w.found:.6g}", number(w.factor, 4)) for w in check.located.worst]
    return "<h2>Wrong components</h2>" + _table(("component", "gradient", "differences", "ratio"), cells)


def _findings(check: Check) -> str:
    found = []
    for f in check.findings:
        value = "" if math.isnan(f.value) else number(f.value, 2)
        mark = {True: "ok", False: "NO", None: "?"}[f.sound]
        found.append([f.name, mark, value, number(f.limit, 2), "; ".join(filter(None, (f.says, f.culprit)))])
    return _table(("test", "", "value", "limit", ""), found)


def _td(cell: str) -> str:
    return f"<td{' class=short' if len(cell) < SHORT else ''}>{escape(cell)}</td>"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = ""
    for row in rows:
        mark = " class='no'" if "NO" in row or "plateau" in row else ""
        body += f"<tr{mark}>" + "".join(_td(cell) for cell in row) + "</tr>"
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
