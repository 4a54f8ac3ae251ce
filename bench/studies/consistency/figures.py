"""Inversions with inconsistent gradients: how far above the minimum each has stalled."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Section
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.picking import each, tabulate
from gradient_routes.bench.render.source import Source

RUNS = (
    "problem route at optimizer error_start error_end iterations evaluations objective above_minimum gradient_norm"
    " own_gradient_norm step_length shortest_step outcome ended status reason"
)


def section(source: Source) -> Section | None:
    runs, steps = source.table("consistency"), source.table("consistency_steps")
    if not runs:
        return None
    says = "A gradient that is not that of the discretized J is zero elsewhere, and a line search stalls on the way."
    return Section("consistency", "Inconsistent gradients", says, (*([falls(steps)] if steps else []), stalls(runs)))


def falls(steps: Sequence[Row]) -> Figure:
    return Figure(
        "consistency",
        "J above its minimum, step by step",
        "A line that ends high has stalled there.",
        tabulate(
            "consistency_steps",
            steps,
            "problem route at optimizer iteration forward_solves objective above_minimum own_gradient_norm step_length",
        ),
        "line",
        x=(Axis("iteration", "iteration"), Axis("forward_solves", "forward solves")),
        y=(
            Axis("above_minimum", "J − J_min", "unit of J", "log"),
            Axis("own_gradient_norm", "|g| by the route", "unit of J / p", "log"),
            Axis("step_length", "step length", scale="log"),
        ),
        series=each(steps, "route"),
        panels=each(steps, "problem"),
        routes=True,
    )


def stalls(runs: Sequence[Row]) -> Figure:
    stalled = [row for row in runs if row["outcome"] == "stalled"]
    worst = max(stalled, key=lambda row: row["above_minimum"], default=None)
    says = (
        "No line search has stalled."
        if worst is None
        else f"{len(stalled)} of {len(runs)} line searches have stalled; the highest, {worst['route']}, at"
        f" J = {number(worst['objective'])}, {number(worst['above_minimum'])} above the minimum."
    )
    return Figure("stalls", "Where the line search stalls", says, tabulate("consistency", runs, RUNS))
