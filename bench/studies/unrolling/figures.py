"""What unrolled AD takes to be right: errors, tape and time against its iterations."""

from __future__ import annotations

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Guide, Section, Series
from gradient_routes.bench.render.format import bytes_
from gradient_routes.bench.render.picking import grouped, sorted_by, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import of_route, variant


def section(source: Source) -> Section | None:
    rows = [row for row in source.table("unrolling") if row["iterations"] is not None]
    fits = source.table("unrolling_fits")
    if not rows:
        return None
    figures = (curves(rows, fits), *([] if not fits else [met(fits)]))
    says = "An iteration that AD differentiates step by step has to converge twice: in u, then in its derivative."
    return Section("unrolling", "Unrolled iterations", says, figures)


def curves(rows: list[Row], fits: list[Row]) -> Figure:
    panels = grouped(rows, lambda row: row["problem"])
    names = list(dict.fromkeys(named(row) for row in rows))
    styles = {name: variant(of_route("unrolled-ad"), k) for k, name in enumerate(names)}
    series = []
    for facet, places in enumerate(panels.values()):
        for name, of in grouped([rows[i] for i in places], named).items():
            line = sorted_by(rows, (places[i] for i in of), "iterations")
            series.append(Series(name, styles[name], line, facet))
    columns = "problem inner checkpoint iterations newton gradient_error objective_error tape_bytes products seconds"
    return Figure(
        "unrolling",
        "Error and tape against iterations",
        _says(fits),
        tabulate("unrolling", rows, f"{columns} residual status reason"),
        x=(Axis("iterations", "k, iterations", scale="log"),),
        y=(
            Axis("gradient_error", "|g − g_ref| / |g_ref|", scale="log"),
            Axis("objective_error", "|J − J_ref| / |J_ref|", scale="log"),
            Axis("tape_bytes", "tape", "byte", "log"),
            Axis("products", "products with R_u", scale="log"),
            Axis("seconds", "one gradient", "s", "log"),
        ),
        series=tuple(series),
        facets=tuple(Facet(problem, guides=_guides(problem, fits)) for problem in panels),
    )


def named(row: Row) -> str:
    kept = "" if row["checkpoint"] is None else f", every {row['checkpoint']}th kept"
    return f"{row['inner']}{kept}"


def _guides(problem: str, fits: list[Row]) -> tuple[Guide, ...]:
    """Where implicit AD stands; drawn over errors alone."""
    errors = [row["implicit_error"] for row in fits if row["problem"] == problem and row["implicit_error"]]
    return (Guide("y", errors[0], "implicit-ad", "gradient_error"),) if errors else ()


def _says(fits: list[Row]) -> str:
    met = [row for row in fits if row["meets"] is not None]
    if not met:
        return "Errors fall with k; so does nothing else: tape and time grow with it."
    said = [
        f"{named(row)} meets implicit-ad at k = {row['meets']}"
        + (f", {bytes_(row['bytes_per_iteration'])} of tape each" if row["bytes_per_iteration"] else "")
        for row in met[:3]
    ]
    return f"{'; '.join(said)}."


def met(fits: list[Row]) -> Figure:
    columns = "problem inner checkpoint meets implicit_error enough bytes_per_iteration fixed_bytes fit_residual"
    return Figure(
        "tapes",
        "Tapes, fitted",
        "Bytes of tape are a line in k; checkpoints trade them for products.",
        tabulate("unrolling_fits", fits, f"{columns} compared_at tape_ratio products_ratio time_ratio"),
    )
