"""Inversions: how fast each route and optimizer gets to the parameters, and what it costs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.inversion import estimates_figures as estimates
from gradient_routes.bench.inversion.history_figure import RUN, history, named
from gradient_routes.bench.render.figure import Figure, Section
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import grouped, real, tabulate, text
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.studies.invert import regularization_figures as regularization
from gradient_routes.bench.studies.invert import residuals_figures as residuals

CLOSE = 1.1  # times the least misfit that a run on the problem ended with: arrived
REACHED = (
    RUN,
    real("aim", "problem's", f"misfit to reach: {CLOSE:g} times the least of any run on the problem"),
    real("iterations", "1", "steps until there; absent where it never was"),
    real("solves", "1", "forward solves until there"),
    real("adjoints", "1", "linearized and transposed substitutions until there"),
    real("time", "s", "until there"),
    real("final", "problem's", "misfit at the end"),
    text("ended", "why it stopped"),
)


def section(source: Source) -> Section | None:
    rows = [row | {"run": named(row)} for row in source.table("inversion")]
    found, constants, met, missed = (
        [row | {"run": named(row), "panel": f"{row['problem']} by {named(row)}"} for row in source.table(table)]
        for table in ("estimates", "constants", "fit", "residuals")
    )
    fields = (
        *estimates.figures(found),
        *residuals.constants(constants),
        *residuals.fits(met),
        *residuals.figures(missed),
    )
    figures = (history(rows, paid_and_met(rows)), reached(rows), *fields, *regularization.figures(source))
    drawn = tuple(f for f in figures if f is not None)
    says = "From gradients to parameters: the misfit step by step, what was found, how much to regularize."
    return Section("inversion", "Inversion", says, drawn) if drawn else None


def paid_and_met(rows: Sequence[Row]) -> str:
    met = [
        f"{row['run']} meets the data to their noise at iteration {row['iteration']}." for row in rows if row["chosen"]
    ]
    return " ".join([paid(rows), *met[:2]])


def paid(rows: Sequence[Row]) -> str:
    costs = [row for row in arrivals(rows) if row["solves"] is not None]
    if not costs:
        return "A flat line has stalled."
    cheap, dear = min(costs, key=lambda r: r["solves"]), max(costs, key=lambda r: r["solves"])
    said = (
        f"{cheap['run']} comes close to the least misfit after {cheap['solves']} forward solves on {cheap['problem']}"
    )
    return f"{said}; the most costly, {dear['run']}, after {dear['solves']}." if cheap != dear else f"{said}."


def arrivals(rows: Sequence[Row]) -> Iterator[Row]:
    """What each run took to come close to the least misfit of its problem."""
    for of in grouped(rows, lambda row: (row["problem"], row["alpha"])).values():
        runs = list(grouped(of, lambda row: str(row["run"])).values())
        ends = [run[-1]["misfit"] for run in runs if run[-1]["misfit"] is not None]
        for run in runs if ends else []:
            aim = CLOSE * min(ends)
            there = next((row for row in run if row["misfit"] is not None and row["misfit"] <= aim), {})
            yield {
                **{name: run[0][name] for name in ("problem", "route", "run")},
                "aim": aim,
                "iterations": there.get("iteration"),
                "solves": there.get("forward_solves"),
                "adjoints": there.get("adjoint_solves"),
                "time": there.get("seconds"),
                "final": run[-1]["misfit"],
                "ended": run[-1]["says"],
            }


def reached(rows: Sequence[Row]) -> Figure | None:
    found = list(arrivals(rows))
    if not found:
        return None
    there = sum(row["iterations"] is not None for row in found)
    best = min(row["final"] for row in found if row["final"] is not None)
    return Figure(
        "arrivals",
        "What it costs to come close to the least misfit",
        f"{there} of {len(found)} runs come within {CLOSE:g} times the least misfit on their problem;"
        f" the least of all is {number(best)}.",
        tabulate("inversion", found, "problem route run aim iterations solves adjoints time final ended", REACHED),
    )
