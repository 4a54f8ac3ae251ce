"""Load cases of a measured file: a column `load`, or load_x, load_y.. where directions differ, and `case` where loads
alone do not tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.problems.data.table import Group, Table
from gradient_routes.problems.data.units import Kind, kind_of
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

MAX_CASES = 200  # each is a forward solve
SHOWN = 8
LOAD = Group(("load",), "ratio", need="none", marked=False, others=("force", "stress", "length"))
CASE = Group(("case",), "word", need="none")


def vector_group(axes: str) -> Group:
    """The columns of the components of a load along the axes."""
    return replace(LOAD, names=tuple(f"load_{axis}" for axis in axes))


@dataclass(frozen=True)
class LoadCases:
    """rows (m,): the case of every row, counted from 0; values (cases,), the load of each case, or (cases, d), its
    components; kind of the values: a ratio is a factor of the problem's own load, others are in SI.
    """

    rows: Array
    values: Array
    kind: Kind

    @classmethod
    def of(cls, table: Table, axes: str) -> LoadCases | None:
        """In the order of the file; None for a file without such columns. A component without a column is 0.

        Raises InputError for cases without a load, with several, or too many, and for a load that is told twice.
        """
        names = [name for name in (*LOAD.names, *vector_group(axes).names) if name in table.columns]
        label = table.columns.get("case")
        if not names:
            if label is None:
                return None
            raise InputError(
                f"{table.path}: column case tells cases apart, but not the load of each - add a column load [N], or one"
                " of factors of the load"
            )
        if names[0] == "load" and len(names) > 1:
            raise InputError(f"{table.path}: columns load and {names[1]} both state the load - keep one or the other")
        load = np.nan_to_num(table.stack(LOAD.names if names[0] == "load" else vector_group(axes).names))
        keys = np.squeeze(load, axis=1) if load.shape[1] == 1 else load
        keys, axis = (keys, None if keys.ndim == 1 else 0) if label is None else (label, None)
        _, first, rows = np.unique(keys, axis=axis, return_index=True, return_inverse=True)
        order = np.argsort(first)
        rows = np.argsort(order)[np.ravel(rows)]
        values = load[first[order]]
        several = np.flatnonzero((load != values[rows]).any(axis=1))
        if label is not None and several.size:
            i = several[0]
            raise InputError(
                f"{table.path}: line {table.lines[i]}: case {label[i]} has the loads {_named(values[rows[i]])} and"
                f" {_named(load[i])} - give each case one"
            )
        if len(values) > MAX_CASES:
            raise InputError(
                f"{table.path}: {len(values)} load cases, each a forward solve, at most {MAX_CASES} - round the"
                " loads, or average rows"
            )
        kinds = {name: _kind(table, name) for name in names}
        other = next((name for name, kind in kinds.items() if kind != kinds[names[0]]), None)
        if other is not None:
            both = f"{names[0]} is a {kinds[names[0]]}, {other} a {kinds[other]}"
            raise InputError(f"{table.path}: {both} - state the unit of each, as in units={names[0]}:N,{other}:N")
        return cls(rows, values[:, 0] if names[0] == "load" else values, kinds[names[0]])

    def named(self, case: int) -> str:
        """Its load, for a message."""
        return _named(self.values[case])

    def said(self, kept: Array) -> str:
        """A note; kept are the rows that are read."""
        unit = {"ratio": "factors", "force": "N", "stress": "Pa", "length": "m"}[self.kind]
        counts = np.bincount(self.rows[kept], minlength=len(self.values)).tolist()
        shown = [f"{self.named(case)} ({n} rows)" for case, n in enumerate(counts[:SHOWN])]
        more = f", and {len(counts) - SHOWN} more" if len(counts) > SHOWN else ""
        column = "column load" if self.values.ndim == 1 else "columns load_x, load_y.."
        return f"load cases by {column}, {unit}: {', '.join(shown)}{more}"

    def amplitudes(self, load: str, amplitude: float, area: float, who: str) -> Array:
        """(cases,) or (cases, d) of a load whose own amplitude [Pa] or [m] and area are given.

        Raises InputError for another kind.
        """
        if self.kind == "ratio":
            return amplitude * self.values
        fits = {"force": ("traction",), "stress": ("traction", "follower"), "length": ("displacement",)}[self.kind]
        if load not in fits:
            raise InputError(
                f"{who}: the file's column load is a {self.kind}, which does not go with load={load} - give"
                f" load={fits[0]}, or a column of factors"
            )
        return self.values / area if self.kind == "force" else self.values


def _kind(table: Table, name: str) -> Kind:
    unit = table.units.get(name)
    return "ratio" if unit is None else kind_of(unit, str(table.path))


def _named(load: Array) -> str:
    """A number, or components."""
    words = [f"{c:.4g}" for c in np.atleast_1d(load)]
    return words[0] if len(words) == 1 else f"({', '.join(words)})"
