"""Measured stress-stretch curves: stretch, nominal stress, and the mode of loading of every row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gradient_routes.problems.data.sensors import level
from gradient_routes.problems.data.table import Group, read_table
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

STRETCH = Group(("stretch",), "ratio")
STRESS = Group(("stress",), "stress")
NOISE = Group(("sigma",), "stress", need="none")
MODE = Group(("mode",), "word", need="none")


@dataclass(frozen=True)
class Curves:
    """modes (m words), stretch (m,) [1], stress (m,) [Pa], their noise sigma [Pa], 0 if unknown, and notes."""

    modes: tuple[str, ...]
    stretch: Array
    stress: Array
    sigma: float
    notes: tuple[str, ...]


def read_curves(
    path: str | Path,
    asked: Sequence[str],
    known: Sequence[str],
    columns: str | None = None,
    units: str | None = None,
    noise: float = 0.0,
) -> Curves:
    """Read columns stretch,stress, and mode where there are several; `asked` picks modes, none of them: all.

    Raises InputError for what cannot be read, a stretch <= 0, a mode that is not `known`, and one without data.
    """
    table = read_table(path, (STRETCH, STRESS, NOISE, MODE), columns, units)
    stretch, lines = table.columns["stretch"], table.lines
    bad = np.flatnonzero(stretch <= 0.0)
    if bad.size:
        raise InputError(
            f"{path}: line {lines[bad[0]]}: stretch {stretch[bad[0]]:g} is no length - stretch is length over initial"
            " length, 1 at rest"
        )
    if "mode" in table.columns:
        modes = table.columns["mode"]
    elif len(asked) == 1:
        modes = np.full(len(stretch), asked[0])
    else:
        raise InputError(f"{path}: no column mode tells which rows are of which mode - add it, or give one mode=")
    odd = [(line, mode) for line, mode in zip(lines, modes, strict=True) if mode not in known]
    if odd:
        raise InputError(f"{path}: line {odd[0][0]}: mode '{odd[0][1]}' is not known - write {', '.join(known)}")
    absent = [mode for mode in asked if mode not in modes]
    if absent:
        raise InputError(f"{path}: no row is of mode {absent[0]} - choose among {', '.join(dict.fromkeys(modes))}")
    keep = np.isin(modes, list(asked)) if asked else np.ones(len(modes), dtype=bool)
    left_out = f"{(~keep).sum()} rows of other modes are left out" if not keep.all() else ""
    notes = tuple(filter(None, (table.said, left_out)))
    return Curves(
        tuple(map(str, modes[keep])),
        stretch[keep],
        table.columns["stress"][keep],
        level(table, noise, "coupon", "Pa"),
        notes,
    )
