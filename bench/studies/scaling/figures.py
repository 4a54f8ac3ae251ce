"""How bills grow with size: cases of one problem over n, fitted exponents, and where the adjoint begins to win."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gradient_routes.bench.cases.column import Column, Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Guide, Section, Series
from gradient_routes.bench.render.format import number, seconds
from gradient_routes.bench.render.picking import grouped, in_order, sorted_by, tabulate, text
from gradient_routes.bench.render.source import Source, selector
from gradient_routes.bench.render.style import of_routes
from gradient_routes.bench.studies.bill.figures import FORWARD, MEMORY, SECONDS, TAPE, UNRESOLVED
from gradient_routes.bench.studies.tolerance.figures import without_following

FEWEST = 3  # sizes of a family that make a curve
SIZES = ("n", "nx", "ny", "nz")  # options of problems that make their size

HELD = "Peak memory of one gradient; what AD tapes between its sweeps is part of it."


def section(source: Source) -> Section | None:
    fits, races = source.table("scaling_fits"), source.table("break_even")
    figures = (*growth(source.answered), exponents(fits), crossing(races))
    drawn = tuple(f for f in figures if f is not None)
    says = "The same problem at several sizes: slopes in these log-log plots are exponents."
    return Section("scaling", "Scaling", says, drawn) if drawn else None


def growth(cases: Sequence[Row]) -> list[Figure]:
    """Seconds, and bytes, over n_u, a panel for a problem whose options agree but for those of its size."""
    families = grouped(cases, family)
    rows: list[Row] = []
    facets: list[Facet] = []
    lines: list[tuple[str, tuple[int, ...], int]] = []
    for name, places in families.items():
        of = curves([cases[i] for i in places])
        if len({row["n_state"] for row in of}) < FEWEST:
            continue
        first = len(rows)
        rows += of
        for route, drawn in grouped(of, lambda row: row["route"]).items():
            lines.append((route, sorted_by(rows, (first + i for i in drawn), "n_state"), len(facets)))
        facets.append(Facet(name, says=_dearest(of)))
    if not rows:
        return []
    styles = of_routes(in_order(route for route, _, _ in lines))
    columns = "problem route n_state n_param seconds peak_bytes tape_bytes forward_ratio gradient_error"
    time = Figure(
        "growth",
        "Time against size",
        f"{len(facets)} {'problem' if len(facets) == 1 else 'problems'} run at {FEWEST} sizes or more, all else alike.",
        tabulate("cases", rows, columns),
        x=(Axis("n_state", "n_u, unknowns", scale="log"), Axis("n_param", "n_p, parameters", scale="log")),
        y=(SECONDS, FORWARD),
        series=tuple(Series(route, styles[route], line, facet) for route, line, facet in lines),
        facets=tuple(facets),
    )
    bare = tuple(replace(facet, says="", guides=UNRESOLVED) for facet in facets)
    memory = replace(time, id="growth-memory", title="Memory against size", says=HELD, y=(MEMORY, TAPE), facets=bare)
    return [time, memory] if any(row["peak_bytes"] is not None for row in rows) else [time]


def curves(rows: Sequence[Row]) -> list[Row]:
    """Iterations that follow the size are no part of a curve's name: without them it has one row a size still."""
    short = [row | {"route": without_following(row["by"], row["route_options"])} for row in rows]
    sizes = grouped(short, lambda row: (row["route"], row["n_state"], row["n_param"]))
    single = {short[places[0]]["route"]: True for places in sizes.values()}
    for places in sizes.values():
        single[short[places[0]]["route"]] &= len(places) == 1
    return [new if single[new["route"]] else row for row, new in zip(rows, short, strict=True)]


def family(row: Row) -> str:
    """The problem without what makes its size, and the settings of its run where those are unusual."""
    options = row["problem_options"] or {}
    settings = str(row["problem"]).removeprefix(selector("problem", row["family"], options))
    return selector("problem", row["family"], {k: v for k, v in options.items() if k not in SIZES}) + settings


def _dearest(rows: Sequence[Row]) -> str:
    largest = max(row["n_state"] or 0 for row in rows)
    timed = [row for row in rows if row["n_state"] == largest and row["seconds"] is not None]
    if not timed:
        return ""
    cheap, dear = min(timed, key=lambda r: r["seconds"]), max(timed, key=lambda r: r["seconds"])
    if cheap is dear:
        return f"n_u = {largest}: {cheap['route']} {seconds(cheap['seconds'])}."
    return (
        f"At n_u = {largest}, {cheap['route']} takes {seconds(cheap['seconds'])},"
        f" {dear['route']} {seconds(dear['seconds'])}."
    )


def exponents(fits: Sequence[Row]) -> Figure | None:
    """Exponents with their confidence intervals, a panel a problem, quantity and abscissa."""
    rows = [row for row in fits if row["exponent"] is not None]
    if not rows:
        return None
    panels = grouped(rows, lambda row: (row["problem"], row["quantity"], row["against"]))
    styles = of_routes(in_order(row["route"] for row in rows))
    steepest = max(rows, key=lambda row: row["exponent"])
    columns = "problem route quantity against law exponent exponent_low exponent_high prefactor constant points"
    return Figure(
        "exponents",
        "Fitted exponents",
        f"quantity = constant + prefactor · n^exponent, with 95 % confidence. Steepest: {steepest['quantity']} of"
        f" {steepest['route']} over {steepest['against']}, exponent {number(steepest['exponent'])}.",
        tabulate("scaling_fits", rows, f"{columns} fitted_from fitted_to fit_residual largest stopped_by"),
        x=(Axis("exponent", "exponent"),),
        y=(Axis("route", "", scale="category"),),
        series=tuple(
            Series(rows[i]["route"], styles[rows[i]["route"]], (i,), facet)
            for facet, places in enumerate(panels.values())
            for i in places
        ),
        facets=tuple(Facet(f"{problem}: {what} over {over}") for problem, what, over in panels),
        mark="ranges",
        interval=("exponent_low", "exponent_high"),
    )


PAIR = text("pair", "the two routes compared")


def crossing(races: Sequence[Row]) -> Figure | None:
    """The number of parameters from which one route is cheaper than another."""
    if not races:
        return None
    rows = [row | {"pair": f"{row['route']} / {row['other']}"} for row in races]
    drawn = [i for i, row in enumerate(rows) if row["break_even"] is not None and row["break_even"] > 0]
    panels = grouped([rows[i] for i in drawn], lambda row: row["problem"])
    places = {problem: [drawn[i] for i in of] for problem, of in panels.items()}
    styles = of_routes(in_order(row["route"] for row in rows))
    columns = "problem route other pair break_even break_even_low break_even_high predicted says points m_largest"
    known: tuple[Column, ...] = (PAIR,)
    return Figure(
        "break-even",
        "From how many parameters on",
        " ".join(dict.fromkeys(f"{row['pair']}: {row['says']}." for row in rows[:3] if row["says"])),
        tabulate("break_even", rows, f"{columns} fixed_s each_s other_fixed_s other_each_s predicted_says", known),
        x=(Axis("break_even", "parameters at which both cost the same", scale="log"),),
        y=(Axis("pair", "", scale="category"),),
        series=tuple(
            Series(rows[i]["route"], styles[rows[i]["route"]], (i,), facet)
            for facet, of in enumerate(places.values())
            for i in of
        ),
        facets=tuple(Facet(problem, guides=(Guide("x", 1.0, "one"),)) for problem in places) or (Facet(),),
        mark="ranges",
        interval=("break_even_low", "break_even_high"),
    )
