"""What the data can tell at all: spectra, blind and weak parameters, experiments, sensors worth adding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render import fields
from gradient_routes.bench.render.figure import Axis, Figure, Guide, Section
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import each, grouped, tabulate
from gradient_routes.bench.render.source import Source

PLACE = "problem experiment parameter number slice x y z width height"
COLUMNS = f"{PLACE} column_norm kind null_share posterior_sd prior_sd blind"
CRITERIA = {"D": "log det of the information", "A": "trace of the posterior covariance"}
COUNTS = {"rank": "identifiable directions", "weak": "weak parameters", "blind": "blind parameters"}


def section(source: Source) -> Section | None:
    figures = (
        spectrum(source.table("spectrum")),
        experiments(source.table("experiments")),
        *identified(source.table("identified")),
        placement(source.table("placement")),
    )
    drawn = tuple(f for f in figures if f is not None)
    says = "Which combinations of parameters stand above the noise, and which no optimizer can find."
    return Section("identifiability", "Identifiability", says, drawn) if drawn else None


def spectrum(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    y = (
        Axis("relative_to_noise", "singular value / noise", scale="log"),
        Axis("singular_value", "singular value σ_k", "unit of Su", "log"),
    )
    found = [
        f"{experiment}: {sum(1 for row in of if row['identifiable'])} of {len(of)}"
        for (_, experiment), of in grouped(rows, lambda row: (row["study_id"], row["experiment"])).items()
    ]
    columns = "problem experiment at index_ singular_value relative_to_noise identifiable n_param"
    return Figure(
        "spectrum",
        "Spectrum of the sensitivity",
        f"Identifiable directions: {'; '.join(found[:4])}.",
        tabulate("spectrum", rows, columns),
        "line",
        x=(Axis("index_", "k, number of the singular value"),),
        y=y if any(row["relative_to_noise"] is not None for row in rows) else y[::-1],
        series=each(rows, "experiment"),
        panels=each(rows, "problem"),
        guides=(Guide("y", 1.0, "noise", column="relative_to_noise"),),
    )


def experiments(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    gained = max(rows, key=lambda row: row["gained"] or 0)
    says = "Directions above the noise, parameters below it, parameters that no datum depends on."
    if gained["gained"]:
        says += f" {gained['experiment']} gains {gained['gained']} more directions than the first experiment."
    return Figure(
        "experiments",
        "What another experiment would tell",
        says,
        tabulate("experiments", rows, "problem experiment at data sigma n_param rank blind weak gained"),
        "bars",
        x=(Axis("", "count"),),
        y=(Axis("experiment", "", scale="category"),),
        panels=each(rows, "problem"),
        fold=COUNTS,
    )


def identified(rows: Sequence[Row]) -> list[Figure]:
    """The share of every parameter that the data leave open."""
    if not rows:
        return []
    rows = [row | {"panel": row["experiment"], "blind": int(row["kind"] == "blind")} for row in rows]
    flat = Figure(
        "identified",
        "What the data leave open, parameter by parameter",
        "Null share: 0 where the data fix a parameter, 1 where they say nothing of it. Hollow: blind.",
        fields.columns("identified", COLUMNS),
        y=(
            Axis("null_share", "null share", domain=(0.0, 1.0)),
            Axis("posterior_sd", "posterior σ", "its own unit"),
            Axis("column_norm", "|H e_i|"),
        ),
        hollow="blind",
        z=Axis("null_share", "null share", domain=(0.0, 1.0)),
    )
    return fields.figures(flat, rows, {"null_share": "null share"}, says)


def says(rows: Sequence[Row]) -> str:
    return ", ".join(f"{count} {kind}" for kind, count in Counter(row["kind"] for row in rows).most_common()) + "."


def placement(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    first = rows[0]
    return Figure(
        "placement",
        "Sensors worth adding",
        f"Chosen one after the other; by criterion {first['criterion']} the first on {first['experiment']} is"
        f" {first['sensor']}, worth {number(first['value'])}.",
        tabulate("placement", rows, "problem experiment criterion step sensor x y z value rank"),
        "line",
        x=(Axis("step", "sensors chosen"),),
        y=(Axis("value", "value of the criterion"), Axis("rank", "identifiable directions")),
        panels=tuple(f"{row['experiment']}, {row['criterion']}: {CRITERIA.get(row['criterion'], '')}" for row in rows),
        note="sensor",
    )
