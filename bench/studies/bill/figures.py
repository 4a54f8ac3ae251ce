"""The bill of routes: time and memory against error, counted work, and whether the bill was foreseen."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import median

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Guide, Section, Series
from gradient_routes.bench.render.format import bytes_, number, ratio, seconds
from gradient_routes.bench.render.picking import by_column, grouped, in_order, real, tabulate, text
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import of_route, others
from gradient_routes.bench.render.terminal.tables import RESOLUTION

ERROR = Axis("gradient_error", "|g − g_ref| / |g_ref|", scale="log")
SECONDS = Axis("seconds", "time of one gradient", "s", "log")
FORWARD = Axis("forward_ratio", "time in forward solves", scale="log")
MEMORY = Axis("peak_bytes", "peak memory of one call", "byte", "log")
TAPE = Axis("tape_bytes", "tape of AD", "byte", "log")
KINDS = {
    "forward": "forward solves",
    "linearized": "linearized solves",
    "adjoint": "adjoint solves",
    "products": "products",
}
COUNTED = (
    real("forward", "1", "forward solves counted"),
    real("linearized", "1", "substitutions with R_u beyond those of Newton"),
    real("adjoint", "1", "substitutions with R_u^T"),
    real("products", "1", "products with R_u or R_u^T"),
)
UNRESOLVED = (Guide("y", RESOLUTION, "not resolved below", "peak_bytes"),)
CASE = "problem route n_state n_param"


def section(source: Source) -> Section | None:
    rows = source.answered
    if not rows:
        return None
    figures = (paying(rows), memory(rows), work(rows), foreseen(rows))
    says = "What one gradient costs by every route, and how wrong it is. The newest run of every case."
    return Section("bill", "The bill of routes", says, tuple(f for f in figures if f is not None))


def of_bare_routes(rows: Sequence[Row]) -> tuple[Series, ...]:
    """A series a route, its variants in one: hovering tells them apart."""
    groups = by_column(rows, "by")
    return tuple(Series(name, of_route(name), groups[name]) for name in in_order(groups))


def paying(rows: Sequence[Row]) -> Figure:
    """Error against time."""
    columns = (
        f"{CASE} gradient_error seconds forward_ratio seconds_min seconds_q1 seconds_q3 unstable objective reference"
    )
    return Figure(
        "error-and-time",
        "What accuracy costs",
        f"{best(rows)} Thin lines join, problem by problem, the routes that no other beats on both axes.",
        tabulate("cases", rows, columns),
        x=(SECONDS, FORWARD),
        y=(ERROR,),
        series=of_bare_routes(rows),
        mark="points",
        front=True,
    )


def best(rows: Sequence[Row]) -> str:
    """The largest gradient on which an exact route and one of differences can be compared, in words."""
    for problem, of in sorted(_problems(rows), key=lambda each: -max(r["n_param"] or 0 for r in each[1])):
        judged = [r for r in of if r["gradient_error"] is not None and r["forward_ratio"] is not None]
        exact = [r for r in judged if not r["by"].startswith("fd-") and r["gradient_error"] < 1e-6]
        quotients = [r for r in judged if r["by"].startswith("fd-")]
        if exact and quotients:
            a, b = min(exact, key=lambda r: r["forward_ratio"]), min(quotients, key=lambda r: r["forward_ratio"])
            return (
                f"On {problem}, {a['n_param']} parameters: {a['by']} costs {ratio(a['forward_ratio'])} forward solves"
                f" with error {number(a['gradient_error'], 2)}, {b['by']} {ratio(b['forward_ratio'])} with error"
                f" {number(b['gradient_error'], 2)}."
            )
    return f"{len(rows)} gradients; down and to the left is better."


def _problems(rows: Sequence[Row]) -> Iterator[tuple[str, list[Row]]]:
    for problem, places in by_column(rows, "problem").items():
        yield problem, [rows[i] for i in places]


def memory(rows: Sequence[Row]) -> Figure | None:
    known = [row for row in rows if row["peak_bytes"] is not None or row["tape_bytes"] is not None]
    if not known:
        return None
    taped = max((r for r in known if r["tape_bytes"]), key=lambda r: r["tape_bytes"], default=None)
    says = "Peak memory of one call above what was held before it."
    if taped is not None:
        says += f" The longest tape is that of {taped['route']} on {taped['problem']}: {bytes_(taped['tape_bytes'])}."
    return Figure(
        "memory-and-time",
        "Memory against time",
        says,
        tabulate("cases", known, f"{CASE} peak_bytes tape_bytes factor_bytes seconds forward_ratio memory_method"),
        x=(SECONDS, FORWARD),
        y=(MEMORY, TAPE),
        series=of_bare_routes(known),
        facets=(Facet(guides=UNRESOLVED),),
        mark="points",
    )


def work(rows: Sequence[Row]) -> Figure | None:
    """Bars of counted operations, a panel a problem."""
    counted = [row | operations(row) for row in rows if row["work"] is not None]
    if not counted:
        return None
    styles = others(KINDS.values())
    counted.sort(key=lambda row: registry.place(row["by"]))
    problems = grouped(counted, lambda row: row["problem"])
    series = []
    for facet, places in enumerate(problems.values()):
        for kind, name in KINDS.items():
            drawn = tuple(i for i in places if counted[i][kind])
            if drawn:
                series.append(Series(name, styles[name], drawn, facet, x=kind))
    same = sum(row["work"] == row["predicted_work"] for row in counted)
    return Figure(
        "work",
        "Work, counted",
        f"Operations during one gradient. {same} of {len(counted)} routes did exactly the work they declare.",
        tabulate("cases", counted, f"{CASE} {' '.join(KINDS)} declared", (*COUNTED, text("declared", DECLARED))),
        x=(Axis("forward", "operations in one gradient", scale="log"),),
        y=(Axis("route", "", scale="category"),),
        series=tuple(series),
        facets=tuple(Facet(problem) for problem in problems),
        mark="bars",
    )


DECLARED = "whether the route declared just this work"


def operations(row: Row) -> Row:
    """The four kinds a person compares."""
    done = row["work"]
    return {
        "forward": done["forward_solves"],
        "linearized": max(0, done["solves"] - done["newton_iterations"]),
        "adjoint": done["transposed_solves"],
        "products": done["matvecs"],
        "declared": "yes" if row["predicted_work"] == done else "no",
    }


def foreseen(rows: Sequence[Row]) -> Figure | None:
    """Seconds predicted from declared work against seconds measured."""
    known = [row for row in rows if row["predicted_s"] and row["seconds"]]
    if not known:
        return None
    off = [max(r["predicted_s"] / r["seconds"], r["seconds"] / r["predicted_s"]) for r in known]
    far = known[off.index(max(off))]
    return Figure(
        "foreseen",
        "Was the bill foreseen?",
        f"Declared work priced by one measured forward solve is off by a factor of {median(off):.2g} in the median;"
        f" most for {far['route']} on {far['problem']}: {seconds(far['predicted_s'])} predicted,"
        f" {seconds(far['seconds'])} measured. Below the diagonal a gradient was dearer than declared.",
        tabulate("cases", known, f"{CASE} predicted_s seconds forward_s prepare_s first_s"),
        x=(SECONDS,),
        y=(Axis("predicted_s", "predicted time", "s", "log"),),
        series=of_bare_routes(known),
        mark="points",
        diagonal=True,
    )
