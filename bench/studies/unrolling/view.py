"""The study of unrolling for a terminal: errors and tape against k, where it meets implicit AD, bytes an iteration."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import bytes_, number, ratio, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.plot import Series, plot
from gradient_routes.bench.studies.unrolling.measure import Unrolling
from gradient_routes.bench.units import size

WIDE = 130  # columns from which plots stand side by side
LEGEND = (
    "k: iterations, of each Newton step where there are several; J: |J - J_ref| / |J_ref|; g: |g - g_ref| / |g_ref|;"
    " residual: |R| / |R_0|;\ntape: kept for the backward sweep; products with R_u, both sweeps"
)


def show(out: Console, done: Unrolling, plotted: bool = True) -> None:
    iterates, curves = done.tables["unrolling"], done.tables["unrolling_fits"]
    if plotted:
        out.print(plots(iterates, out.width))
        out.print()
    first = iterates[0]
    steps = f", {first['newton']} Newton steps" if first["newton"] else ""
    title = f"{tables.named('problem', first)}, unrolled-ad[inner={first['inner']}]{steps}"
    out.print(Text(title, style="bold"), soft_wrap=not out.is_terminal)
    tables.show(out, table(iterates))
    for line in [Text(LEGEND, style="dim"), *remarks(iterates, curves)]:
        out.print(line, soft_wrap=not out.is_terminal)


def plots(iterates: Sequence[Row], width: int) -> RenderableType:
    """Errors of g and J, and the tape, each against k; side by side where there is room."""
    side_by_side = width >= WIDE
    each = (width - 4) // 2 if side_by_side else width
    every = [row for row in iterates if row["checkpoint"] is None]
    thinned = [row for row in iterates if row["checkpoint"] is not None]
    style = route_style("unrolled-ad")
    errors = [_series("J", "J", every, "objective_error"), _series("g", "g", every, "gradient_error", style)]
    kept = [_series("all kept", "T", every, "tape_bytes", style)]
    kept += [_series(f"one in {thinned[0]['checkpoint']} kept", "C", thinned, "tape_bytes")] if thinned else []
    name = tables.named("problem", iterates[0])
    grid = Table.grid(padding=(0, 4 if side_by_side else 0, 0, 0))
    left, right = plot(errors, "k", f"{name}: error", each), plot(kept, "k", "tape [byte]", each)
    if side_by_side:
        grid.add_row(left, right)
    else:
        grid.add_row(left)
        grid.add_row(Text())
        grid.add_row(right)
    return grid


def _series(name: str, mark: str, rows: Sequence[Row], column: str, style: str = "") -> Series:
    return Series(name, [row["iterations"] for row in rows], [row[column] for row in rows], mark, style)


def table(iterates: Sequence[Row]) -> Table:
    """One line an iterate."""
    thinned = any(row["checkpoint"] for row in iterates)
    first = ["checkpoint"] if thinned else []
    out = tables.columns(*first, "k", "J", "g", "residual", "tape", "products", "time")
    for row in iterates:
        cells = [str(row["checkpoint"] or "")] if thinned else []
        cells.append(str(row["iterations"]))
        if row["status"] == "ok":
            cells += [number(row[name], 2) for name in ("objective_error", "gradient_error", "residual")]
            cells += [bytes_(row["tape_bytes"]), str(row["products"]), seconds(row["seconds"])]
        else:
            cells.append(row["status"])
        out.add_row(*cells)
    return out


def remarks(iterates: Sequence[Row], curves: Sequence[Row]) -> list[Text]:
    """Where it meets implicit AD, what an iteration keeps, what checkpoints cost, why points are missing."""
    lines = [Text(_meeting(iterates, curves[0]))]
    lines += [Text(line) for curve in curves for line in (_fitted(curve), _compared(curve)) if line]
    reasons = {row["reason"]: row for row in iterates if row["status"] != "ok"}
    lines += [
        Text(
            f"{row['status']} at k = {row['iterations']}: {reason}",
            style="dim" if row["status"] == "skipped" else "red",
        )
        for reason, row in reasons.items()
    ]
    return lines


def _meeting(iterates: Sequence[Row], curve: Row) -> str:
    meant = f"error {number(curve['implicit_error'], 2) or 'unknown'}: wanted <= {curve['enough']:.2g}"
    if curve["meets"] is not None:
        return f"meets implicit-ad at k = {curve['meets']} ({meant})"
    known = [row for row in iterates if row["gradient_error"] is not None]
    if not known:
        return f"does not meet implicit-ad ({meant})"
    best = min(known, key=lambda row: float(row["gradient_error"]))
    return (
        f"does not meet implicit-ad up to k = {known[-1]['iterations']} ({meant}): the least error is"
        f" {best['gradient_error']:.2g} at k = {best['iterations']}"
    )


def _fitted(curve: Row) -> str:
    if curve["bytes_per_iteration"] is None:
        return ""
    kept = "all kept" if curve["checkpoint"] is None else f"one in {curve['checkpoint']} kept"
    return (
        f"{kept}: tape = {size(curve['bytes_per_iteration'])} an iteration + {size(curve['fixed_bytes'])}, fitted to"
        f" {curve['points']} points, off by {100 * curve['fit_residual']:.1f} % of the largest at most"
    )


def _compared(curve: Row) -> str:
    if curve["compared_at"] is None:
        return ""
    return (
        f"checkpoints at k = {curve['compared_at']}: tape x {ratio(curve['tape_ratio'])}, products x"
        f" {ratio(curve['products_ratio'])}, time x {ratio(curve['time_ratio'])}"
    )
