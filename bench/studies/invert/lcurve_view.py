"""L-curves, and bias against variance, for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from gradient_routes.bench.inversion.lcurve import CLOSE, Point
from gradient_routes.bench.inversion.result import Inversion
from gradient_routes.bench.inversion.tradeoff import Trade
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal.plot import Series, plot

FLAT = 0.99  # of misfit / noise, by the last alpha: it falls no further
NO_CORNER = (
    "no corner: the curve bends the other way throughout - with as many parameters as data, the misfit falls on below"
    " the noise"
)


def progress(found: Inversion) -> str:
    """One minimum, as soon as it is known."""
    last = found.iterates[-1]
    paid = f"{last.iteration} iterations, {last.seconds:.3g} s"
    return f"alpha = {found.alpha:.3g}: misfit {last.misfit:.4g} after {paid}"


def curve(points: Sequence[Point], width: int) -> Text:
    """Phi against the misfit, the chosen ones with marks of their own."""
    of = {"corner": "C", "discrepancy": "D", None: "o"}
    drawn = []
    for name, mark in of.items():
        those = [p for p in points if (p.chosen or "").startswith(name or "!") or (name is None and p.chosen is None)]
        drawn.append(Series(name or "alpha", [p.misfit for p in those], [p.phi for p in those], mark))
    return plot([each for each in drawn if each.x], "misfit", "L-curve: Phi", width)


def table(points: Sequence[Point]) -> Table:
    """One line an alpha."""
    out = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for name in ("alpha", "misfit", "Phi", "curvature", "misfit / noise", "off", "iterations", "fwd", ""):
        out.add_column(name, justify="right" if name else "left")
    for point in points:
        row, misled = point.row, point.inversion.misled
        out.add_row(
            f"{row['alpha']:.3g}",
            number(row["misfit"], 4),
            number(row["phi"], 4),
            number(row["curvature"], 2),
            number(row["discrepancy"], 3),
            number(row["distance"], 3),
            str(row["iterations"]),
            str(row["forward_solves"]),
            row["chosen"] or ("" if point.converged else "wrong gradient" if misled else "not converged"),
        )
    return out


def remarks(points: Sequence[Point]) -> list[Text]:
    """What was not found, and why."""
    lines = []
    if len(points) > 2 and not any("corner" in (point.chosen or "") for point in points):
        lines.append(Text(NO_CORNER, style="dim"))
    if all(point.discrepancy is None for point in points):
        lines.append(Text("no discrepancy principle: the noise of the data is not known", style="dim"))
    elif said := _not_met(points):
        lines.append(Text(said, style="dim"))
    return lines


def _not_met(points: Sequence[Point]) -> str:
    """Why no alpha of the sweep is that of the discrepancy principle."""
    known = [point for point in points if point.converged and point.discrepancy is not None]
    if not known:
        return "no discrepancy principle: no inversion of the sweep has converged - give more --iterations"
    first, last = (float(point.discrepancy or 0.0) for point in (known[0], known[-1]))
    if not known[-1].meets_noise:
        falls = len(known) > 1 and last < FLAT * float(known[-2].discrepancy or 0.0)
        why = "begin the sweep lower" if falls else "no smaller alpha will: the model does not explain the data"
        least = f"misfit / noise is {last:.3g} at {known[-1].inversion.alpha:g}"
        return f"no alpha meets the data to their noise: {least}; {why}"
    if known[0].meets_noise and first < 1.0 - CLOSE:
        return f"every alpha meets the data to their noise, the largest to {first:.3g} of it: end the sweep higher"
    return ""


def trades(found: Sequence[Trade]) -> Table:
    """One line an alpha; the least total marked."""
    out = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for name in ("alpha", "bias", "variance", "total", ""):
        out.add_column(name, justify="right" if name else "left")
    least = min((trade.row["total"] for trade in found), default=None)
    for trade in found:
        row = trade.row
        mark = "least" if row["total"] == least else ""
        out.add_row(*(f"{row[name]:.3g}" for name in ("alpha", "bias", "variance", "total")), mark)
    return out


def trade_plot(found: Sequence[Trade], width: int) -> Text:
    alphas = [trade.inversion.alpha for trade in found]
    drawn = [
        Series(name, alphas, [trade.row[name] for trade in found], mark)
        for name, mark in (("bias", "b"), ("variance", "v"), ("total", "T"))
    ]
    return plot(drawn, "alpha", "mean square over parameters", width)
