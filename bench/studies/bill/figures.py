"""The bill of routes: time and memory against error, counted work, and how well the bill was predicted."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Guide, Section
from gradient_routes.bench.render.format import bytes_, number, ratio, seconds
from gradient_routes.bench.render.picking import doubt, each, grouped, real, tabulate, text
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.terminal.tables import RESOLUTION

ERROR = Axis("gradient_error", "error |g − g_ref| / |g_ref|", scale="log")
SECONDS = Axis("seconds", "time of one gradient", "s", "log")
FORWARD = Axis("forward_ratio", "cost of one gradient / forward solve", scale="log")
MEMORY = Axis("peak_bytes", "peak memory of one gradient", "byte", "log")
TAPE = Axis("tape_bytes", "tape of AD", "byte", "log")
DOUBT = text("doubt", "why its time is not to be relied on")
HOLLOW = "Hollow: the time is noisy, or less than the forward solves that it contains."
GUIDES = (
    Guide("x", 1.0, "less than 1 forward solve", column="forward_ratio", below=True),
    Guide("y", RESOLUTION, "not resolved below 1 MiB", column="peak_bytes", below=True),
)
KINDS = {
    "forward": "forward solves",
    "linearized": "linearized solves",
    "adjoint": "adjoint solves",
    "products": "products with R_u",
}
COUNTED = (
    real("forward", "1", "forward solves counted"),
    real("linearized", "1", "substitutions with R_u beyond those of Newton"),
    real("adjoint", "1", "substitutions with R_u^T"),
    real("products", "1", "products with R_u or R_u^T"),
    text("declared", "whether the route declared just this work"),
)
CASE = "problem route n_state n_param"


def section(source: Source) -> Section | None:
    rows = [row | {"doubt": doubt(row)} for row in source.answered]
    if not rows:
        return None
    figures = (error_and_time(rows), memory_and_time(rows), work(rows), prediction(rows))
    says = "What one gradient costs by every route, and how wrong it is. The newest run of every case."
    says = f"{says} {source.thinned}".rstrip()
    return Section("bill", "The bill of routes", says, tuple(f for f in figures if f is not None))


def error_and_time(rows: Sequence[Row]) -> Figure:
    columns = (
        f"{CASE} gradient_error seconds forward_ratio doubt seconds_min seconds_q1 seconds_q3 unstable objective"
        " reference"
    )
    return Figure(
        "error-and-time",
        "What accuracy costs",
        f"{best(rows)} Down and to the left is better. {HOLLOW} A grey line joins the routes of one problem that no"
        " other beats in both error and time.",
        tabulate("cases", rows, columns, (DOUBT,)),
        "points",
        x=(SECONDS, FORWARD),
        y=(ERROR,),
        series=each(rows, "by"),
        routes=True,
        guides=GUIDES,
        hollow="doubt",
        front=True,
    )


def best(rows: Sequence[Row]) -> str:
    """The largest gradient on which an exact route and one of differences can be compared, in words."""
    problems = grouped(rows, lambda row: str(row["problem"]))
    for problem, of in sorted(problems.items(), key=lambda each: -max(r["n_param"] or 0 for r in each[1])):
        judged = [r for r in of if r["gradient_error"] is not None and r["forward_ratio"] is not None]
        exact = [r for r in judged if not r["by"].startswith("fd-") and r["gradient_error"] < 1e-6]
        quotients = [r for r in judged if r["by"].startswith("fd-")]
        if exact and quotients:
            told = [
                f"{r['by']} costs {ratio(r['forward_ratio'])} forward solves with error"
                f" {number(r['gradient_error'], 2)}"
                for r in (min(group, key=lambda r: r["forward_ratio"]) for group in (exact, quotients))
            ]
            return f"On {problem}, {exact[0]['n_param']} parameters: {', '.join(told)}."
    return f"{len(rows)} gradients."


def memory_and_time(rows: Sequence[Row]) -> Figure | None:
    known = [row for row in rows if row["peak_bytes"] is not None or row["tape_bytes"] is not None]
    if not known:
        return None
    taped = max((r for r in known if r["tape_bytes"]), key=lambda r: r["tape_bytes"], default=None)
    says = "Peak memory of one gradient above what was held before it."
    if taped is not None:
        says += f" The longest tape is that of {taped['route']} on {taped['problem']}: {bytes_(taped['tape_bytes'])}."
    columns = f"{CASE} peak_bytes tape_bytes factor_bytes seconds forward_ratio doubt memory_method"
    return Figure(
        "memory-and-time",
        "Memory against time",
        f"{says} {HOLLOW}",
        tabulate("cases", known, columns, (DOUBT,)),
        "points",
        x=(SECONDS, FORWARD),
        y=(MEMORY, TAPE),
        series=each(known, "by"),
        routes=True,
        guides=GUIDES,
        hollow="doubt",
    )


def work(rows: Sequence[Row]) -> Figure | None:
    """Counted operations, a panel a problem."""
    counted = [row | operations(row) for row in rows if row["work"] is not None]
    if not counted:
        return None
    counted.sort(key=lambda row: registry.place(row["by"]))
    same = sum(row["work"] == row["predicted_work"] for row in counted)
    return Figure(
        "work",
        "Work, counted",
        f"Operations during one gradient; a kind without a mark was not needed. {same} of {len(counted)} routes did"
        " exactly the work they declare.",
        tabulate("cases", counted, f"{CASE} {' '.join(KINDS)} declared", COUNTED),
        "points",
        x=(Axis("", "operations in one gradient", scale="log"),),
        y=(Axis("route", "", scale="category"),),
        panels=each(counted, "problem"),
        fold=KINDS,
    )


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


def prediction(rows: Sequence[Row]) -> Figure | None:
    """Seconds predicted from declared work against seconds measured."""
    known = [row for row in rows if row["predicted_s"] and row["seconds"]]
    if not known:
        return None
    off = [max(r["predicted_s"] / r["seconds"], r["seconds"] / r["predicted_s"]) for r in known]
    far = known[off.index(max(off))]
    return Figure(
        "prediction",
        "Time predicted from declared work",
        "The work a route declares times the cost of one measured forward solve, against the time it took."
        f" Off by a factor of {median(off):.2g} in the median; most for {far['route']} on {far['problem']}:"
        f" {seconds(far['predicted_s'])} predicted, {seconds(far['seconds'])} measured. Below the dashed line the"
        " gradient took longer than predicted.",
        tabulate("cases", known, f"{CASE} predicted_s seconds forward_s prepare_s first_s doubt", (DOUBT,)),
        "points",
        x=(Axis("seconds", "measured time", "s", "log"),),
        y=(Axis("predicted_s", "predicted time", "s", "log"),),
        series=each(known, "by"),
        routes=True,
        hollow="doubt",
        diagonal=True,
    )
