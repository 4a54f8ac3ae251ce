"""--gradient FILE.csv: gradients component by component."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from typing import Any

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.outcome import View
from gradient_routes.bench.render.terminal.tables import named
from gradient_routes.bench.store.output_files import Output

AXES = ("x", "y", "z")


def write(output: Output, views: Sequence[tuple[Row, View]]) -> None:
    """Write a line per parameter: problem, route, parameter, unit, its position (x, y, z as far as known), p, dJ_dp,
    reference. Raises RoutesError.
    """
    d = max((v.position.shape[1] for _, v in views if v.position is not None), default=0)
    with output.text() as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["problem", "route", "parameter", "unit", *AXES[:d], "p", "dJ_dp", "reference"])
        for row, view in views:
            names = [named("problem", row), named("route", row)]
            out.writerows([*names, *line] for line in _lines(view, d))


def _lines(view: View, d: int) -> Iterator[list[Any]]:
    reference, nowhere = view.reference, [""] * d
    for i, numbers in enumerate(zip(view.p.tolist(), view.gradient.tolist(), strict=True)):
        at = nowhere if view.position is None else (view.position[i].tolist() + nowhere)[:d]
        yield [view.labels[i], view.units[i], *at, *numbers, "" if reference is None else float(reference.gradient[i])]
