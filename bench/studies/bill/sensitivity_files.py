"""--sensitivities FILE: columns of du/dp or d(S u)/dp, in the format that the suffix names."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from gradient_routes.bench.cases.outcome import Sensitivities
from gradient_routes.bench.cases.settings import Columns
from gradient_routes.bench.store.output_files import Output
from gradient_routes.bench.studies.bill.files import SUFFIXES
from gradient_routes.problems.errors import InputError


def wanted(path: Path | None, of: str, columns: str | None, vtu: bool) -> Columns | None:
    """What --sensitivities, --sensitivities-of, --columns and --vtu ask for together. Raises InputError."""
    chosen = None if columns is None else numbers(columns)
    if path is None:
        return None if chosen is None else Columns("state", chosen, table=False, on_mesh=vtu)
    on_mesh = path.suffix == ".vtu"
    if path.suffix not in SUFFIXES:
        raise InputError(f"--sensitivities {path}: suffix '{path.suffix}' - name a file {', '.join(SUFFIXES)}")
    if on_mesh and of == "data":
        raise InputError(f"--sensitivities {path}: data are not fields on a mesh - name a .csv or .npz file")
    return Columns("data" if of == "data" else "state", chosen, not on_mesh, on_mesh or (vtu and chosen is not None))


def numbers(text: str) -> tuple[int, ...]:
    """Numbers from 0 of `1,5-8`, each once, in the order given. Raises InputError."""
    found: list[int] = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        if not first.strip().isdigit() or not (last or first).strip().isdigit() or int(first) < 1:
            raise InputError(f"--columns {text}: '{part}' is not a number or a range - write 1,5-8")
        found += range(int(first) - 1, int(last or first))
    if not found:
        raise InputError(f"--columns {text}: no parameter - write 1,5-8")
    return tuple(dict.fromkeys(found))


def write(output: Output, columns: Sensitivities) -> None:
    """As CSV, a row an unknown or a datum, or as NPZ. Raises RoutesError."""
    if output.path.suffix == ".npz":
        with output.open() as file:
            names = {"rows": columns.rows, "parameters": columns.parameters, "units": columns.units}
            np.savez(file, allow_pickle=False, **{columns.name: columns.values}, **names)
        return
    with output.text() as text:
        out = csv.writer(text, lineterminator="\n")
        out.writerow([columns.name, *columns.parameters])
        out.writerows([name, *row] for name, row in zip(columns.rows, columns.values.tolist(), strict=True))
