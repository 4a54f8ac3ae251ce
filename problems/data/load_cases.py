"""Load cases of a measured file: a column `load`, and `case` where loads alone do not tell them apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.data.table import Group, Table
from gradient_routes.problems.data.units import Kind, kind_of
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

MAX_CASES = 200  # each is a forward solve
SHOWN = 8
LOAD = Group(("load",), "ratio", need="none", marked=False, others=("force", "stress", "length"))
CASE = Group(("case",), "word", need="none")


@dataclass(frozen=True)
class LoadCases:
    """rows (m,): the case of every row, counted from 0; values (cases,), the load of each case; kind of the values: a
    ratio is a factor of the problem's own load, others are in SI.
    """

    rows: Array
    values: Array
    kind: Kind

    @classmethod
    def of(cls, table: Table) -> LoadCases | None:
        """In the order of the file; None for a file without such columns.

        Raises InputError for cases without a load, with several, or too many.
        """
        load, label = table.columns.get("load"), table.columns.get("case")
        if load is None:
            if label is None:
                return None
            raise InputError(
                f"{table.path}: column case tells cases apart, but not the load of each - add a column load [N], or one"
                " of factors of the load"
            )
        _, first, rows = np.unique(load if label is None else label, return_index=True, return_inverse=True)
        order = np.argsort(first)
        rows = np.argsort(order)[rows]
        values = load[first[order]]
        several = np.flatnonzero(load != values[rows])
        if label is not None and several.size:
            i = several[0]
            raise InputError(
                f"{table.path}: line {table.lines[i]}: case {label[i]} has the loads {values[rows[i]]:g} and"
                f" {load[i]:g} - give each case one"
            )
        if len(values) > MAX_CASES:
            raise InputError(
                f"{table.path}: {len(values)} load cases, each a forward solve, at most {MAX_CASES} - round the"
                " loads, or average rows"
            )
        unit = table.units.get("load")
        return cls(rows, values, "ratio" if unit is None else kind_of(unit, str(table.path)))

    def said(self, kept: Array) -> str:
        """A note; kept are the rows that are read."""
        unit = {"ratio": "factors", "force": "N", "stress": "Pa", "length": "m"}[self.kind]
        counts = np.bincount(self.rows[kept], minlength=len(self.values)).tolist()
        shown = [f"{value:.4g} ({n} rows)" for value, n in zip(self.values[:SHOWN], counts[:SHOWN], strict=True)]
        more = f", and {len(counts) - SHOWN} more" if len(counts) > SHOWN else ""
        return f"load cases by column load, {unit}: {', '.join(shown)}{more}"

    def amplitudes(self, load: str, amplitude: float, area: float, who: str) -> Array:
        """(cases,) of a load whose own amplitude [Pa] or [m] and area are given. Raises InputError for another kind."""
        if self.kind == "ratio":
            return amplitude * self.values
        fits = {"force": ("traction",), "stress": ("traction", "follower"), "length": ("displacement",)}[self.kind]
        if load not in fits:
            raise InputError(
                f"{who}: the file's column load is a {self.kind}, which does not go with load={load} - give"
                f" load={fits[0]}, or a column of factors"
            )
        return self.values / area if self.kind == "force" else self.values
