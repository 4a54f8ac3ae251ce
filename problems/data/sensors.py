"""Sensors S at nodes, their data d, and the misfit 1/2 |S u - d|^2."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.csv import read_columns
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

Nodes = str | int | Sequence[int]


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


def read_sensors(path: str | Path, n: int, nodes: Nodes | None, who: str) -> Sensors:
    """Read measured data (columns `node,displacement`); `nodes` picks some of the rows, None takes all.

    Raises InputError for a node that does not exist, is given twice, or is asked for and not in the file.
    """
    columns = read_columns(path, ("node", "displacement"))
    node, d = columns["node"], columns["displacement"]
    if not node.size:
        raise InputError(f"{path}: has a header and no rows - add one row a sensor")
    for line, value in enumerate(node, start=2):
        if value != int(value) or not 1 <= value <= n:
            raise InputError(
                f"{path}: data row {line - 1} is of node {value:g}, {who} has nodes 1..{n} - correct the row"
            )
    at = {int(value): k for k, value in enumerate(node)}
    if len(at) < len(node):
        twice = next(int(v) for k, v in enumerate(node) if at[int(v)] != k)
        raise InputError(f"{path}: node {twice} is given twice - keep one row a node")
    if nodes is None:
        return Sensors(node.astype(np.int64), d)
    chosen = parse_nodes(nodes, n, who)
    absent = [int(k) for k in chosen if int(k) not in at]
    if absent:
        raise InputError(f"{path}: no row for node {absent[0]}, which sensors= asks for - add it or choose other nodes")
    return Sensors(chosen, d[[at[int(k)] for k in chosen]])
