"""What the data can tell at all: spectra, blind and weak parameters, experiments, sensors worth adding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render import fields
from gradient_routes.bench.render.figure import Axis, Facet, Figure, Guide, Section, Series
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import grouped, sorted_by, tabulate
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.render.style import others

COLUMNS = "problem experiment parameter number slice x y z column_norm kind null_share posterior_sd prior_sd"
CRITERIA = {"D": "log det of the information", "A": "trace of the posterior covariance"}


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
    studies = grouped(rows, lambda row: row["study_id"])
    styles = others(row["experiment"] for row in rows)
    noisy = any(row["relative_to_noise"] is not None for row in rows)
    y = (
        Axis("relative_to_noise", "singular value / noise", scale="log"),
        Axis("singular_value", "σ_k", "problem's", "log"),
    )
    found = [
        f"{rows[places[0]]['experiment']}: {sum(1 for i in places if rows[i]['identifiable'])} of {len(places)}"
        for places in grouped(rows, lambda row: (row["study_id"], row["experiment"])).values()
    ]
    return Figure(
        "spectrum",
        "Spectrum of the sensitivity",
        f"Identifiable directions: {'; '.join(found[:4])}.",
        tabulate(
            "spectrum", rows, "problem experiment at index_ singular_value relative_to_noise identifiable n_param"
        ),
        x=(Axis("index_", "k"),),
        y=y if noisy else y[::-1],
        series=tuple(
            Series(name, styles[name], sorted_by(rows, (places[i] for i in of), "index_"), facet)
            for facet, places in enumerate(studies.values())
            for name, of in grouped([rows[i] for i in places], lambda row: row["experiment"]).items()
        ),
        facets=tuple(
            Facet(rows[places[0]]["problem"], guides=(Guide("y", 1.0, "noise", "relative_to_noise"),))
            for places in studies.values()
        ),
    )


def experiments(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    panels = grouped(rows, lambda row: row["study_id"])
    names = {"rank": "identifiable", "weak": "weak", "blind": "blind"}
    styles = others(names.values())
    gained = max(rows, key=lambda row: row["gained"] or 0)
    says = "Directions above the noise, parameters below it, parameters that no datum depends on."
    if gained["gained"]:
        says += f" {gained['experiment']} gains {gained['gained']} more than the first experiment."
    return Figure(
        "experiments",
        "What another experiment would tell",
        says,
        tabulate("experiments", rows, "problem experiment at data sigma n_param rank blind weak gained"),
        x=(Axis("rank", "parameters, directions"),),
        y=(Axis("experiment", "", scale="category"),),
        series=tuple(
            Series(name, styles[name], places, facet, x=column)
            for facet, places in enumerate(panels.values())
            for column, name in names.items()
        ),
        facets=tuple(Facet(rows[places[0]]["problem"]) for places in panels.values()),
        mark="bars",
    )


def identified(rows: Sequence[Row]) -> list[Figure]:
    """The share of every parameter that the data leave open."""
    if not rows:
        return []
    rows = [row | {"panel": row["experiment"], "blind": int(row["kind"] == "blind")} for row in rows]
    says = {}
    for panel, places in fields.by_panel(rows).items():
        counted = Counter(rows[i]["kind"] for i in places)
        says[panel] = ", ".join(f"{count} {kind}" for kind, count in counted.most_common()) + "."
    table = fields.columns("identified", f"{COLUMNS} blind")
    figure = Figure(
        "identified",
        "What the data leave open, parameter by parameter",
        "Null share: 0 where the data fix a parameter, 1 where they say nothing of it; hatched or grey: blind.",
        table,
        y=(Axis("null_share", "null share"), Axis("posterior_sd", "posterior σ"), Axis("column_norm", "|H e_i|")),
        values=(Axis("null_share", "null share"),),
        hatched="blind",
    )
    style = others(["null share"])["null share"]
    flat = fields.along(figure, rows, lambda row: {"null_share": Series("null share", style, ())}, says)
    if flat is not None:
        flat = replace(flat, values=(), series=tuple(replace(s, y="") for s in flat.series))
    return [f for f in (flat, fields.over(figure, rows, says)) if f is not None]


def placement(rows: Sequence[Row]) -> Figure | None:
    if not rows:
        return None
    panels = grouped(rows, lambda row: (row["experiment"], row["criterion"]))
    styles = others(CRITERIA)
    first = rows[0]
    return Figure(
        "placement",
        "Sensors worth adding",
        f"Chosen one after the other; by criterion {first['criterion']} the first on {first['experiment']} is"
        f" {first['sensor']}, worth {number(first['value'])}.",
        tabulate("placement", rows, "problem experiment criterion step sensor x y z value rank"),
        x=(Axis("step", "sensors chosen"),),
        y=(Axis("value", "criterion"), Axis("rank", "identifiable directions")),
        series=tuple(
            Series(f"criterion {criterion}", styles.get(criterion, styles["D"]), places, facet)
            for facet, ((_, criterion), places) in enumerate(panels.items())
        ),
        facets=tuple(
            Facet(f"{experiment}, {criterion}: {CRITERIA.get(criterion, '')}") for experiment, criterion in panels
        ),
        note="sensor",
    )
