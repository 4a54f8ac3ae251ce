"""Temperatures measured along a rod, between the nodes of its mesh."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.repeats import without_repeats
from gradient_routes.problems.data.sensors import level
from gradient_routes.problems.data.table import Group, read_table
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

X = Group(("x",), "length")
T = Group(("T",), "temperature")
NOISE = Group(("sigma",), "temperature change", need="none")


@dataclass(frozen=True, eq=False)
class Line:
    """Linear interpolation between n + 1 nodes at equal distances: at x (m,), in `cell` (m,), with weight w (m,)."""

    x: Array
    n: int
    cell: Array
    w: Array

    @classmethod
    def through(cls, x: Array, length: float, n: int) -> Line:
        s = np.clip(x / length, 0.0, 1.0) * n
        cell = np.minimum(s.astype(int), n - 1)
        return cls(x, n, cell, s - cell)

    def read(self, nodal: Any) -> Any:
        """(m,) from nodal values (n + 1,) of NumPy or jax.numpy."""
        return (1.0 - self.w) * nodal[self.cell] + self.w * nodal[self.cell + 1]

    def matrix(self) -> Any:
        """The same as a sparse matrix (m, n + 1)."""
        from scipy import sparse

        m = len(self.x)
        at = np.concatenate([np.arange(m)] * 2), np.concatenate([self.cell, self.cell + 1])
        return sparse.csr_array((np.concatenate([1.0 - self.w, self.w]), at), shape=(m, self.n + 1))


@dataclass(frozen=True)
class Readings:
    """x (m,) [m], T (m,) [K], their noise sigma [K], 0 if unknown, and notes on how they were read.

    celsius  whether T states degrees Celsius
    """

    x: Array
    T: Array
    sigma: float
    notes: tuple[str, ...]
    celsius: bool


def check_celsius(who: str, given: Mapping[str, Any], names: Sequence[str], path: str) -> None:
    """Raises InputError for temperatures without a unit beside a file in degrees Celsius."""
    for name in names:
        value = str(given[name])
        if re.fullmatch(r"[-+.\de]+", value):
            raise InputError(f"{who}: {name}={value} has no unit, T of {path} is in degC - write {value}degC")


def read_thermocouples(
    path: str | Path, length: float, columns: str | None, units: str | None, noise: float
) -> Readings:
    """Read a file of columns x,T, and sigma where there is one, with units as in `read_table`.

    Raises InputError for what cannot be read, and for a point that is not on the rod or has two temperatures.
    """
    table = read_table(path, (X, T, NOISE), columns, units)
    x, temperature = table.columns["x"], table.columns["T"]
    off = np.flatnonzero((x < -1e-9 * length) | (x > (1.0 + 1e-9) * length))
    if off.size:
        line, where = table.lines[off[0]], x[off[0]]
        raise InputError(
            f"{path}: line {line}: x = {where:g} m is not on the rod, from 0 to {length:g} m, nor are {off.size - 1}"
            f" others - state the unit of x, or length="
        )
    sigma = level(table, noise, "rod", "K")
    keep, repeated = without_repeats(path, x[:, None], temperature[:, None], table.lines, sigma, "x =")
    notes = tuple(filter(None, (table.said, repeated)))
    return Readings(x[keep], temperature[keep], sigma, notes, table.units.get("T") in ("degC", "°C", "C"))
