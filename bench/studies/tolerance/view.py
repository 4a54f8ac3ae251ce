"""The study of tolerances for a terminal: one plot, one table of residuals beside errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.plot import Series, marks, plot
from gradient_routes.bench.studies.tolerance.measure import Tolerance
from gradient_routes.bench.verification.curve import slope

SWEPT = {
    "both": "tolerance of forward and adjoint solves",
    "forward": "tolerance of forward solves, linearized and adjoint ones at",
    "adjoint": "tolerance of linearized and adjoint solves, forward ones at",
}
NOT_YET: Row = {"status": "", "residual": None, "adjoint_residual": None, "objective_error": None}  # interrupted
EXACT = 1e-6  # of the tolerance asked for
ROUNDING, WITHIN = 1e-12, 3.0  # errors above the first are to be estimated within a factor of the second
JUMPED = "forward solves are exact at the loosest tolerance"
SLOWLY = ": --linear-solver descent takes it step by step"
LEGEND = (
    "residual: |R| / |R_0| achieved, adjoint: |R_u^T lam + J_u| / |J_u|, J: |J - J_ref| / |J_ref|, each of the first"
    " route that tells it\nthen |g - g_ref| / |g_ref| by route; floor: the least of a column"
)


def show(out: Console, done: Tolerance, plotted: bool = True) -> None:
    rows = done.rows
    measured = [row for row in rows if row["rtol"] is not None]
    if plotted and measured:
        out.print(curves(measured, out.width))
        out.print()
    if measured:
        title = f"{tables.named('problem', rows[0])}, {rows[0]['linear_solver']}: {_axis(measured[0])}"
        out.print(Text(title, style="bold"), soft_wrap=not out.is_terminal)
        tables.show(out, table(measured))
        out.print(Text(LEGEND, style="dim"), soft_wrap=not out.is_terminal)
    for said in filter(None, (estimates(measured), order(measured))):
        out.print(Text(said), soft_wrap=not out.is_terminal)
    for line in remarks(rows, done.jumps):
        out.print(line, soft_wrap=not out.is_terminal)


def swept(row: Row) -> float:
    """The tolerance that varies."""
    return float(row["adjoint_rtol"] if row["sweep"] == "adjoint" else row["rtol"])


def by_route(rows: Sequence[Row]) -> dict[str, list[Row]]:
    """The rows of each curve; k of an unrolled route is no part of its name, for it follows the tolerance."""
    curves: dict[str, list[Row]] = {}
    for row in rows:
        curves.setdefault(_name(row), []).append(row)
    return curves


def _name(row: Row) -> str:
    given = {key: value for key, value in row["route_options"].items() if key not in ("iterations", "newton")}
    return tables.named("route", row | {"route_options": given})


def curves(rows: Sequence[Row], width: int) -> Text:
    """Errors of all routes against the tolerance."""
    routes = by_route(rows)
    letters = _marks(routes)
    series = [
        Series(name, [swept(r) for r in of], [r["gradient_error"] for r in of], mark, route_style(of[0]["route"]))
        for (name, of), mark in zip(routes.items(), letters, strict=True)
    ]
    return plot(series, _axis(rows[0]), f"{tables.named('problem', rows[0])}: |g - g_ref| / |g_ref|", width)


def estimates(rows: Sequence[Row]) -> str:
    """How near the estimates of errors come to the errors that are more than rounding."""
    known = [(r["gradient_error"], r["gradient_error_estimate"]) for r in rows]
    ratios = [estimate / error for error, estimate in known if error and estimate is not None and error > ROUNDING]
    if not ratios:
        return ""
    within = sum(1.0 / WITHIN <= ratio <= WITHIN for ratio in ratios)
    least, most = (number(end(ratios), 2) for end in (min, max))
    return (
        f"estimated error / error: {least} to {most}; within a factor of {WITHIN:g} for {within} of {len(ratios)}"
        f" errors above {ROUNDING:g}"
    )


def order(rows: Sequence[Row]) -> str:
    """The power with which the error of the corrected adjoint falls where that of the adjoint does."""
    plain, better = ({swept(r): r["gradient_error"] for r in rows if _adjoint(r, correct)} for correct in ("no", "yes"))
    pairs = {(plain[t], better[t]) for t in plain.keys() & better.keys() if plain[t] and better[t]}
    pairs = {(error, less) for error, less in pairs if less > ROUNDING}
    x, y = (np.array(each) for each in (zip(*sorted(pairs), strict=True) if pairs else ((), ())))
    power = slope(x, y, np.ones(len(x), dtype=bool))
    if power is None:
        return ""
    return f"the error of adjoint[correct=yes] falls like that of adjoint to the power {power:.2g}"


def _adjoint(row: Row, correct: str) -> bool:
    return bool(row["route"] == "adjoint" and row["route_options"].get("correct") == correct)


def _axis(row: Row) -> str:
    fixed = {"both": "", "forward": f" {row['adjoint_rtol']:g}", "adjoint": f" {row['rtol']:g}"}[row["sweep"]]
    return SWEPT[row["sweep"]] + fixed


def _marks(routes: dict[str, list[Row]]) -> list[str]:
    """By the name of the route where only one curve has it."""
    names = [of[0]["route"] for of in routes.values()]
    return marks([name if names.count(name) == 1 else curve for name, curve in zip(names, routes, strict=True)])


def table(rows: Sequence[Row]) -> Table:
    """One line a tolerance: what the solves achieved, then the error of every route."""
    routes = by_route(rows)
    out = tables.columns("tolerance", "residual", "adjoint", "J")
    for name, of in routes.items():
        out.add_column(Text(name), justify="right", overflow="fold", min_width=7, style=route_style(of[0]["route"]))
    for t in dict.fromkeys(swept(row) for row in rows):
        at = {name: next((row for row in of if swept(row) == t), NOT_YET) for name, of in routes.items()}
        achieved = (_first(at.values(), key) for key in ("residual", "adjoint_residual", "objective_error"))
        out.add_row(f"{t:.2g}", *(number(value, 2) for value in achieved), *map(_cell, at.values()))
    floors = [
        min((r["gradient_error"] for r in of if r["gradient_error"] is not None), default=None)
        for of in routes.values()
    ]
    out.add_row("floor", "", "", "", *(number(floor, 2) for floor in floors), style="bold")
    return out


def _first(rows: Iterable[Row], key: str) -> float | None:
    return next((row[key] for row in rows if row[key] is not None), None)


def _cell(row: Row) -> str:
    return (number(row["gradient_error"], 2) or "unknown") if row["status"] == "ok" else row["status"]


def remarks(rows: Sequence[Row], jumps: bool = False) -> list[Text]:
    """Reasons of what was skipped, and of what failed at which tolerances."""
    at: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        if row["status"] != "ok":
            reason = row["reason"] if row["reason"].startswith(row["route"]) else f"{row['route']}: {row['reason']}"
            tolerances = at.setdefault((row["status"], reason, row["route"]), [])
            tolerances += [] if row["rtol"] is None else [swept(row)]
    lines = [
        Text(
            f"{status}{' at ' + ', '.join(f'{t:.2g}' for t in where) if where else ''}: {reason}",
            style="dim" if status == "skipped" else "red",
        )
        for (status, reason, _), where in at.items()
    ]
    slowly = SLOWLY if jumps else ""
    return lines + ([Text(f"note: {JUMPED}{slowly}", style="italic")] if _jumped(rows) else [])


def _jumped(rows: Sequence[Row]) -> bool:
    """Whether forward solves were swept that are exact at the loosest tolerance already."""
    swept = [row for row in rows if row["residual"] is not None and row["sweep"] != "adjoint"]
    loosest = max((row["rtol"] for row in swept), default=0.0)
    return any(row["rtol"] == loosest and row["residual"] < EXACT * loosest for row in swept)
