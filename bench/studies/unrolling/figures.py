"""What unrolled AD takes to be right: errors, tape and time against its iterations."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Guide, Section
from gradient_routes.bench.render.format import bytes_
from gradient_routes.bench.render.picking import each, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.studies.bill.figures import ERROR, SECONDS, TAPE


def section(source: Source) -> Section | None:
    rows = [row for row in source.table("unrolling") if row["iterations"] is not None]
    fits = source.table("unrolling_fits")
    if not rows:
        return None
    figures = (curves(rows, fits), *([tapes(fits)] if fits else []))
    says = "An iteration that AD differentiates step by step has to converge twice: in u, then in its derivative."
    return Section("unrolling", "Unrolled iterations", says, figures)


def curves(rows: Sequence[Row], fits: Sequence[Row]) -> Figure:
    implicit = {row["problem"]: row["implicit_error"] for row in fits if row["implicit_error"]}
    columns = "problem inner checkpoint iterations newton gradient_error objective_error tape_bytes products seconds"
    return Figure(
        "unrolling",
        "Error and tape against iterations",
        says(fits),
        tabulate("unrolling", rows, f"{columns} residual status reason"),
        "line",
        x=(Axis("iterations", "k, iterations", scale="log"),),
        y=(
            ERROR,
            Axis("objective_error", "error |J − J_ref| / |J_ref|", scale="log"),
            TAPE,
            Axis("products", "products with R_u", scale="log"),
            SECONDS,
        ),
        series=tuple(map(named, rows)),
        panels=each(rows, "problem"),
        guides=tuple(
            Guide("y", error, "error of implicit-ad", problem, ERROR.column) for problem, error in implicit.items()
        ),
    )


def named(row: Row) -> str:
    kept = "" if row["checkpoint"] is None else f", a checkpoint every {row['checkpoint']} iterations"
    return f"{row['inner']}{kept}"


def says(fits: Sequence[Row]) -> str:
    met = [
        f"{named(row)} reaches the error of implicit-ad at k = {row['meets']}"
        + (f", with {bytes_(row['bytes_per_iteration'])} of tape per iteration" if row["bytes_per_iteration"] else "")
        for row in fits
        if row["meets"] is not None
    ]
    return f"{'; '.join(met[:3])}." if met else "Errors fall with k while tape and time grow with it."


def tapes(fits: Sequence[Row]) -> Figure:
    columns = "problem inner checkpoint meets implicit_error enough bytes_per_iteration fixed_bytes fit_residual"
    return Figure(
        "tapes",
        "Tape per iteration",
        "Bytes of tape fitted as a line in k; checkpoints save tape and cost further products.",
        tabulate("unrolling_fits", fits, f"{columns} compared_at tape_ratio products_ratio time_ratio"),
    )
