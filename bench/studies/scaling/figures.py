"""How bills grow with size: cases of one problem over n, fitted exponents, and where the adjoint begins to win."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.selector import bare
from gradient_routes.bench.render.figure import Axis, Figure, Guide, Section, Told
from gradient_routes.bench.render.format import number, seconds
from gradient_routes.bench.render.picking import doubt, each, grouped, tabulate, text
from gradient_routes.bench.render.source import Source, selector
from gradient_routes.bench.render.terminal.tables import RESOLUTION
from gradient_routes.bench.studies.bill.figures import DOUBT, FORWARD, GUIDES, HOLLOW, MEMORY, SECONDS, TAPE
from gradient_routes.bench.studies.tolerance.figures import without_following

FEWEST = 3  # sizes of a family that make a curve
SIZES = ("n", "nx", "ny", "nz", "steps")  # options of problems that make their size
PAIR = text("pair", "the two routes compared")


def section(source: Source) -> Section | None:
    figures = (
        *growth(source.answered),
        exponents(source.table("scaling_fits")),
        crossing(source.table("break_even")),
        over_intervals(source.table("checkpoints")),
    )
    drawn = tuple(f for f in figures if f is not None)
    says = "The same problem at several sizes. Both axes are logarithmic: a slope is an exponent."
    says = f"{says} {source.thinned}".rstrip()
    return Section("scaling", "Scaling", says, drawn) if drawn else None


def growth(cases: Sequence[Row]) -> list[Figure]:
    """Seconds, and bytes, over n_u, a panel for a problem whose options agree but for those of its size."""
    families = {name: curves(of) for name, of in grouped(cases, family).items()}
    families = {name: several_sizes(of) for name, of in families.items()}
    families = {name: of for name, of in families.items() if len({row["n_state"] for row in of}) >= FEWEST}
    rows = [row | {"family": name, "doubt": doubt(row)} for name, of in families.items() for row in of]
    if not rows:
        return []
    columns = "problem route n_state n_param seconds seconds_q1 seconds_q3 n_samples peak_bytes tape_bytes"
    time = Figure(
        "growth",
        "Time against size",
        f"Median time of every case, bars from quartile to quartile. Each size was run by itself, in rounds of its own"
        f" number: lines only guide the eye. {HOLLOW}",
        tabulate("cases", rows, f"{columns} forward_ratio gradient_error doubt", (DOUBT,)),
        "line",
        x=(Axis("n_state", "n_u, unknowns", scale="log"), Axis("n_param", "n_p, parameters", scale="log")),
        y=(replace(SECONDS, ends=("seconds_q1", "seconds_q3")), FORWARD),
        series=each(rows, "route"),
        panels=each(rows, "family"),
        routes=True,
        guides=tuple(replace(guide, axis="y") for guide in GUIDES),
        hollow="doubt",
        told={name: Told(says=dearest(of)) for name, of in families.items()},
    )
    says = "Peak memory of one gradient above what was held before it; the tape of AD is part of it."
    memory = replace(time, id="growth-memory", title="Memory against size", says=says, y=(MEMORY, TAPE), told={})
    return [time, replace(memory, hollow="")] if any(row["peak_bytes"] is not None for row in rows) else [time]


def several_sizes(rows: Sequence[Row]) -> list[Row]:
    """Those of routes that were run at more than one."""
    sizes = {route: {row["n_state"] for row in of} for route, of in grouped(rows, lambda r: str(r["route"])).items()}
    return [row for row in rows if len(sizes[row["route"]]) > 1]


def curves(rows: Sequence[Row]) -> list[Row]:
    """Iterations that follow the size are no part of a curve's name: without them it has one row a size still."""
    short = [row | {"route": without_following(row)} for row in rows]
    sizes = grouped(short, lambda row: (row["route"], row["n_state"], row["n_param"]))
    several = {of[0]["route"] for of in sizes.values() if len(of) > 1}
    return [row if new["route"] in several else new for row, new in zip(rows, short, strict=True)]


def family(row: Row) -> str:
    """The problem without what makes its size, and the settings of its run where those are unusual."""
    named = row | {"problem": row["family"]}
    settings = str(row["problem"]).removeprefix(selector("problem", named))
    options = {k: v for k, v in (row["problem_options"] or {}).items() if k not in SIZES}
    return selector("problem", named | {"problem_options": options}) + settings


def dearest(rows: Sequence[Row]) -> str:
    largest = max(row["n_state"] or 0 for row in rows)
    timed = [row for row in rows if row["n_state"] == largest and row["seconds"] is not None]
    told = [f"{row['route']} takes {seconds(row['seconds'])}" for row in sorted(timed, key=lambda r: r["seconds"])]
    return f"At n_u = {largest}, {', '.join(dict.fromkeys((told[0], told[-1])))}." if told else ""


def exponents(fits: Sequence[Row]) -> Figure | None:
    """Exponents with their confidence intervals, a panel a problem, quantity and abscissa."""
    rows = [row for row in fits if row["exponent"] is not None]
    if not rows:
        return None
    steepest = max(rows, key=lambda row: row["exponent"])
    columns = "problem route quantity against law exponent exponent_low exponent_high prefactor constant points"
    return Figure(
        "exponents",
        "Fitted exponents",
        "quantity = constant + prefactor · size^exponent, with 95 % confidence intervals. Steepest:"
        f" {steepest['quantity']} of {steepest['route']} over {steepest['against']}, exponent"
        f" {number(steepest['exponent'])}.",
        tabulate("scaling_fits", rows, f"{columns} fitted_from fitted_to fit_residual largest stopped_by"),
        "points",
        x=(Axis("exponent", "exponent", ends=("exponent_low", "exponent_high")),),
        y=(Axis("route", "", scale="category"),),
        series=each(rows, "route"),
        panels=tuple(f"{row['problem']}: {row['quantity']} over {row['against']}" for row in rows),
        routes=True,
    )


def crossing(races: Sequence[Row]) -> Figure | None:
    """The number of parameters from which one route is cheaper than another."""
    if not races:
        return None
    rows = [row | {"pair": f"{row['route']} / {row['other']}"} for row in races]
    columns = "problem route other pair break_even break_even_low break_even_high predicted says points m_largest"
    return Figure(
        "break-even",
        "The number of parameters from which a route is cheaper",
        " ".join(dict.fromkeys(f"{row['pair']}: {row['says']}." for row in rows[:3] if row["says"]))
        + " Bars: 95 % confidence. Shaded: less than one parameter, so that the first route is always the cheaper one.",
        tabulate("break_even", rows, f"{columns} fixed_s each_s other_fixed_s other_each_s predicted_says", (PAIR,)),
        "points",
        x=(Axis("break_even", "parameters n_p at equal cost", "", "log", ("break_even_low", "break_even_high")),),
        y=(Axis("pair", "", scale="category"),),
        series=each(rows, "route"),
        panels=each(rows, "problem"),
        routes=True,
        guides=(Guide("x", 1.0, "", below=True),),
    )


def over_intervals(marches: Sequence[Row]) -> Figure | None:
    """Memory over the interval between states that a march keeps, a panel a problem, its steps among its options."""
    rows = [row | {"note": "least" if row["least"] else None} for row in marches if row["interval"] is not None]
    if not rows:
        return None
    found = [f"k = {row['interval']} on {row['problem']}, {row['least']}" for row in rows if row["least"]]
    columns = "problem route steps interval states_kept state_bytes peak_bytes recomputed seconds least note"
    return Figure(
        "checkpoints",
        "Memory against the interval between checkpoints",
        "States after 0, k, 2 k, .. steps and those of one interval are kept: T/k + k, the fewest at k = √T. Peaks have"
        f" in them all else that a call needs. Least: {'; '.join(found) or 'not found'}.",
        tabulate("checkpoints", rows, columns, (text("note", "where memory is least over k"),)),
        "line",
        x=(Axis("interval", "k, steps between states kept", scale="log"),),
        y=(Axis("", "memory", "byte", "log"),),
        series=tuple(f" of {bare(row['route'])}" for row in rows),
        panels=each(rows, "problem"),
        fold={"peak_bytes": "peak", "state_bytes": "states kept"},
        guides=(Guide("y", RESOLUTION, "peaks are not resolved below 1 MiB"),),
        note="note",
    )
