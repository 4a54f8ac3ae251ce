"""-o FILE.csv and FILE.vtu: what was found, parameter by parameter and on the mesh."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

from gradient_routes.bench.inversion.residual_cloud import residual_cloud
from gradient_routes.bench.inversion.result import Inversion
from gradient_routes.bench.store.output_files import Output
from gradient_routes.bench.studies.bill import vtu
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

COLUMNS = ("parameter", "unit", "x", "y", "z", "start", "estimate", "sd", "truth", "gradient", "blind")


SUFFIXES = (".csv", ".vtu")


def outputs(paths: Sequence[Path], taken: Iterable[Path]) -> list[Output]:
    """One file of each kind. Raises InputError for others, and for what may not be replaced."""
    found: dict[str, Output] = {}
    for path in paths:
        kind = path.suffix.lower()
        if kind not in SUFFIXES or kind in found:
            what = (
                "a second one" if kind in found else "a map, .npz, is of --linear" if kind == ".npz" else "none of them"
            )
            raise InputError(f"-o {path}: {what} - estimates are one .csv, fields one .vtu")
        found[kind] = Output("-o", path, (kind,))
        found[kind].check([*taken, *(other.path for other in found.values() if other.path != path)])
    return [*found.values()]


def write(output: Output, inversions: Sequence[Inversion], solver: Solver) -> str:
    """Sentence for what was written. Raises RoutesError."""
    if output.path.suffix.lower() == ".csv":
        _estimates(output, inversions)
        return f"estimates in {output.path}"
    last = inversions[-1]
    fields = last.made.fields(last.p, Model(last.made, solver).solve(last.p).u, None, last.gradient)
    if fields is None:
        raise InputError(f"{output}: {last.problem} has no mesh - take a .csv")
    cloud = residual_cloud(last.fit)
    vtu.write(output, fields, cloud)
    return f"fields in {output.path}" + ("" if cloud is None else f", residuals at {len(cloud[0])} points of the data")


def _estimates(output: Output, inversions: Sequence[Inversion]) -> None:
    """Write a line per parameter of every inversion; `--at` reads it again. Raises RoutesError."""
    with output.text() as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["problem", "route", *COLUMNS])
        for found in inversions:
            problem, _, route = found.label.rpartition(" by ")
            for i, row in enumerate(found.tables["estimates"]):
                row = row | {"unit": found.made.parameters.unit_of(i)}
                out.writerow([problem, route, *("" if row[name] is None else row[name] for name in COLUMNS)])
