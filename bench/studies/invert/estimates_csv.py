"""-o FILE.csv: what was found, parameter by parameter."""

from __future__ import annotations

import csv
from collections.abc import Sequence

from gradient_routes.bench.inversion.invert import Inversion
from gradient_routes.bench.store.output_files import Output

COLUMNS = ("parameter", "unit", "x", "y", "z", "start", "estimate", "sd", "truth", "gradient", "blind")


def write(output: Output, inversions: Sequence[Inversion]) -> None:
    """Write a line per parameter of every inversion; `--at` reads it again. Raises RoutesError."""
    with output.text() as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["problem", "route", *COLUMNS])
        for found in inversions:
            problem, _, route = found.label.rpartition(" by ")
            for i, row in enumerate(found.tables["estimates"]):
                row = row | {"unit": found.made.parameters.unit_of(i)}
                out.writerow([problem, route, *("" if row[name] is None else row[name] for name in COLUMNS)])
