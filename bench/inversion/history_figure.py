"""The misfit of inversions, step by step."""

from __future__ import annotations

from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.figure import Axis, Figure, Guide
from gradient_routes.bench.render.picking import each, tabulate, text

RUN = text("run", "route and optimizer")
STEPS = "iteration objective misfit regularization gradient_norm step_length forward_solves adjoint_solves"
ENDS = "distance discrepancy chosen says"
ALL = f"problem route optimizer alpha run {STEPS} seconds {ENDS}"


def named(row: Row) -> str:
    """Route, optimizer, and the weight where the problem's name does not tell it."""
    alpha = f", alpha = {row['alpha']:g}" if row["alpha"] and "alpha=" not in row["problem"] else ""
    return f"{row['route']}, {row['optimizer']}{alpha}"


def history(rows: Sequence[Row], says: str, columns: str = ALL) -> Figure | None:
    """`rows` of the table inversion with their `run`."""
    if not rows:
        return None
    return Figure(
        "history",
        "Misfit, step by step",
        says,
        tabulate("inversion", rows, columns, [RUN]),
        "line",
        x=(
            Axis("iteration", "iteration"),
            Axis("forward_solves", "forward solves"),
            Axis("adjoint_solves", "linearized and adjoint solves"),
            Axis("seconds", "time", "s"),
        ),
        y=(
            Axis("misfit", "misfit ½|Su − d|²", "unit of J", scale="log"),
            Axis("objective", "J", "unit of J", scale="log"),
            Axis("gradient_norm", "|dJ/dp|", "unit of J / p", scale="log"),
            Axis("distance", "distance to the truth, relative", scale="log"),
            Axis("discrepancy", "misfit against noise |Su − d| / (σ√m)", scale="log"),
        ),
        series=each(rows, "run"),
        panels=each(rows, "problem"),
        routes=True,
        guides=(Guide("y", 1.0, "noise", column="discrepancy"),),
        note="chosen",
    )
