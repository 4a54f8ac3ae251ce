"""Sensors S at nodes, their data d, and the misfit 1/2 |S u - d|^2."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.repeats import without_repeats
from gradient_routes.problems.data.table import Group, Table, read_table
from gradient_routes.problems.data.units import doubt
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

Nodes = str | int | Sequence[int]
NODE = Group(("node",), "number", marked=False)
DISPLACEMENT = Group(("displacement",), "length")
NOISE = Group(("sigma",), "length", need="none")


@dataclass(frozen=True)
class Sensors:
    """nodes (m,), distinct, counted from 1; d (m,) the measured displacements [m]."""

    nodes: Array
    d: Array

    def misfit(self, xp: Any, u: Any) -> Any:
        """1/2 |S u - d|^2, holomorphic in u. xp: numpy or jax.numpy."""
        return 0.5 * xp.sum((u[self.nodes - 1] - self.d) ** 2)

    def misfit_gradient(self, u: Array) -> Array:
        """S^T (S u - d), (n_u,)."""
        J_u = np.zeros_like(u)
        J_u[self.nodes - 1] = u[self.nodes - 1] - self.d
        return J_u

    def integral(self, u: Array) -> tuple[float, Array] | None:
        """1/2 of the integral of (u - d)^2 along the line of nodes, over the mean distance of sensors; and by u (n_u,).

        u - d is linear between neighbouring sensors: h (r_i^2 + r_i r_j + r_j^2) / 3 each. None for less than two.
        """
        if len(self.nodes) < 2:
            return None
        order = np.argsort(self.nodes)
        at = self.nodes[order] - 1
        r = u[at] - self.d[order]
        h = np.diff(at) * (len(at) - 1) / (at[-1] - at[0])  # 1 where the distances are equal
        left, right = r[:-1], r[1:]
        by_u = np.zeros_like(u)
        by_u[at[:-1]] += h * (2.0 * left + right) / 6.0
        by_u[at[1:]] += h * (left + 2.0 * right) / 6.0
        return float((h * (left**2 + left * right + right**2)).sum() / 6.0), by_u


def parse_nodes(nodes: Nodes, n: int, who: str) -> Array:
    """Node numbers (m,) out of 1..n.

    An int M, or text holding one, means nodes 1..M; 0 means none. Any other set is a sequence of node numbers,
    or text such as `1,3,5`, `1+3+5` or `2..6`. Raises InputError for nodes outside 1..n or given twice.
    """
    if isinstance(nodes, str):
        nodes = _nodes_from_text(nodes, n, who)
    if isinstance(nodes, int | np.integer):
        if not 0 <= nodes <= n:
            raise InputError(f"{who}: sensors={nodes} asks for nodes 1..{nodes}, there are {n} - choose 0 to {n}")
        return np.arange(1, nodes + 1)
    try:
        array = np.array([operator.index(node) for node in nodes], dtype=np.int64)
    except TypeError:
        raise InputError(f"{who}: sensors={nodes} - node numbers are whole") from None
    outside = array[(array < 1) | (array > n)]
    if outside.size:
        raise InputError(f"{who}: sensor at node {outside[0]}, the nodes are 1..{n} - choose one of them")
    values, counts = np.unique(array, return_counts=True)
    if (counts > 1).any():
        twice = values[counts > 1][0]
        raise InputError(f"{who}: sensor at node {twice} given {counts.max()} times - give each node once")
    return array


def _nodes_from_text(text: str, n: int, who: str) -> int | list[int]:
    if text.strip().isdecimal() and len(text) < 19:
        return int(text)
    nodes: list[int] = []
    for item in text.replace("+", ",").split(","):
        first, dots, last = (part.strip() for part in item.partition(".."))
        if not all(part.isdecimal() and len(part) < 19 for part in ([first, last] if dots else [first])):
            raise InputError(
                f"{who}: sensors={text}: {item.strip()!r} is no node - write 5 (the first 5), 1,3,5 or 2..6"
            )
        stop = int(last) if dots else int(first)
        if int(first) > stop:
            raise InputError(f"{who}: sensors={text}: {item.strip()} runs backwards - write {stop}..{first}")
        if stop > n or int(first) < 1:
            raise InputError(f"{who}: sensors={text}: {item.strip()} leaves the nodes 1..{n} - choose nodes among them")
        nodes.extend(range(int(first), stop + 1))
    return nodes


@dataclass(frozen=True)
class Measured:
    """What a file holds: sensors, their noise sigma [m], 0 if unknown, and notes on how it was read."""

    sensors: Sensors
    sigma: float
    notes: tuple[str, ...]


def read_sensors(
    path: str | Path,
    n: int,
    nodes: Nodes | None,
    who: str,
    columns: str | None = None,
    units: str | None = None,
    noise: float = 0.0,
) -> Measured:
    """Read measured data (columns `node,displacement`, see `read_table`); `nodes` picks some of the rows, None all.

    The noise is `noise` [m], or that of a column sigma.
    Raises InputError for a node that does not exist, is given twice, or is asked for and not in the file.
    """
    table = read_table(path, (NODE, DISPLACEMENT, NOISE), columns, units)
    node, d = table.columns["node"], table.columns["displacement"]
    odd = np.flatnonzero((node != np.floor(node)) | (node < 1) | (node > n))
    if odd.size:
        row, value = odd[0] + 1, node[odd[0]]
        raise InputError(f"{path}: data row {row} is of node {value:g}, {who} has nodes 1..{n} - correct the row")
    keep, repeated = without_repeats(path, node[:, None], d[:, None], table.lines, what="node")
    sigma = level(table, noise, who)
    notes = tuple(filter(None, (table.said, repeated, doubt(sigma, float(np.abs(d).max())))))
    node, d = node[keep].astype(np.int64), d[keep]
    if nodes is None:
        return Measured(Sensors(node, d), sigma, notes)
    at = {int(value): k for k, value in enumerate(node)}
    chosen = parse_nodes(nodes, n, who)
    absent = [int(k) for k in chosen if int(k) not in at]
    if absent:
        raise InputError(f"{path}: no row for node {absent[0]}, which sensors= asks for - add it or choose other nodes")
    return Measured(Sensors(chosen, d[[at[int(k)] for k in chosen]]), sigma, notes)


def level(table: Table, noise: float, who: str, unit: str = "m") -> float:
    """The noise of all data, 0 if unknown: `noise`, or the column sigma. Raises InputError."""
    sigma = table.columns.get("sigma")
    if sigma is None:
        return noise
    if noise:
        raise InputError(f"{table.path}: noise={noise:g} and column sigma both state the noise - keep one")
    if not sigma.min() > 0.0:
        bad = int(sigma.argmin())
        raise InputError(
            f"{table.path}: line {table.lines[bad]}: sigma is {sigma[bad]:g} {unit} - give a standard deviation > 0"
        )
    if np.ptp(sigma) > 1e-9 * sigma.max():
        raise InputError(
            f"{table.path}: sigma from {sigma.min():g} to {sigma.max():g} {unit} - {who} weighs all data alike, set one"
        )
    return float(sigma[0])
