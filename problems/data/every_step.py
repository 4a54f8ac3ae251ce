"""Histories: some unknowns of the state, read after every step, and their data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.sensors import level
from gradient_routes.problems.data.table import Group, read_table
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

Label = Callable[[int], str]
TIME = Group(("t",), "time", marked=False)
NODE = Group(("node",), "number", marked=False)
DISPLACEMENT = Group(("displacement",), "length")
NOISE = Group(("sigma",), "length", need="none")
NEAR = 1e-6  # of a step, within which a time is that of a step: files have some six digits


@dataclass(frozen=True, eq=False)
class EveryStep:
    """S and d of J = 1/2 sum_t |S u_t - d_t|^2, in `steps` of h [s] whose states have n unknowns each.

    at (m,)    the unknowns that are read
    name       of an unknown, for tables
    d (T, m)   None for synthetic data that are not computed yet
    w (T, m)   1 where something was measured, 0 where not; None: everywhere
    noise      standard deviation of the noise on d
    """

    who: str
    steps: int
    n: int
    h: float
    at: Array
    name: Label
    noise: float = 0.0
    d: Array | None = None
    w: Array | None = None

    @property
    def data(self) -> Array:
        """d. Raises InputError for synthetic data that are not computed yet."""
        if self.d is None:
            raise InputError(
                f"{self.who}: synthetic data are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(problem)"
            )
        return self.d

    def zeros(self) -> EveryStep:
        """With d = 0, to solve for the state that synthetic data are read from."""
        return replace(self, d=np.zeros((self.steps, len(self.at))))

    def halved(self) -> EveryStep:
        """The same data in steps half as long."""

        def spread(a: Array | None) -> Array:
            fine = np.zeros((2 * self.steps, len(self.at)))
            fine[1::2] = 1.0 if a is None else a
            return fine

        return replace(self, steps=2 * self.steps, h=self.h / 2.0, d=spread(self.d), w=spread(self.w))

    def synthesized(self, u: Array, seed: int) -> EveryStep:
        """With the data read from the states of all steps, plus noise."""
        d = self.read(u)
        return replace(self, d=d + self.noise * np.random.default_rng(seed).standard_normal(d.shape))

    def read(self, u: Any, xp: Any = np) -> Any:
        """S u_t of every step, (T, m)."""
        return xp.reshape(u, (self.steps, self.n))[:, self.at]

    def misfit(self, u: Any, xp: Any = np) -> Any:
        return 0.5 * xp.sum(self._off(self.read(u, xp), slice(None), xp) ** 2)

    def step_misfit(self, t: Any, u: Any, xp: Any = np) -> Any:
        """That of the state u (n,) after step t, which is traced where xp is jax.numpy."""
        return 0.5 * xp.sum(self._off(u[self.at], t - 1, xp) ** 2)

    def step_misfits(self, t_0: int, u: Array) -> tuple[Array, Array]:
        """Those of the states u (k, n) after steps t_0 + 1..t_0 + k, (k,), and S^T (S u - d), (k, n)."""
        off, by_u = self._off(u[:, self.at], slice(t_0, t_0 + len(u))), np.zeros_like(u)
        by_u[:, self.at] = off
        return 0.5 * (off**2).sum(axis=1), by_u

    def _off(self, read: Any, rows: Any, xp: Any = np) -> Any:
        """S u - d of steps `rows`, counted from 0; 0 where nothing was measured."""
        off = read - xp.asarray(self.data)[rows]
        return off if self.w is None else xp.asarray(self.w)[rows] * off

    def observation(self, u: Array) -> Observation:
        from scipy import sparse

        kept = np.flatnonzero(np.ones(self.data.size) if self.w is None else self.w.ravel())
        at = self._of_all_steps(self.at)[kept]
        S = sparse.csr_array((np.ones(len(at)), (np.arange(len(at)), at)), shape=(len(at), self.steps * self.n))
        read, d = self.read(u).ravel()[kept], self.data.ravel()[kept]
        return Observation(read, d, S, sigma=self.noise, label=self._label(at))

    def candidates(self, at: Array, position: Array) -> Candidates:
        """The unknowns `at` (m,) at positions (m, d) in every step."""
        every = self._of_all_steps(at)
        return Candidates(every, self._label(every), np.tile(position, (self.steps, 1)))

    def _of_all_steps(self, at: Array) -> Array:
        return np.asarray((self.n * np.arange(self.steps)[:, None] + at).ravel())

    def _label(self, at: Array) -> Label:
        return lambda k: f"{self.name(int(at[k] % self.n))} at {(at[k] // self.n + 1) * self.h:.3g} s"


def read_histories_of_nodes(
    path: str | Path, readings: EveryStep, n: int, columns: str | None, units: str | None
) -> tuple[EveryStep, tuple[str, ...]]:
    """Data of nodes 1..n after some steps, from columns t,node,displacement, and sigma where there is one.

    Raises InputError for what cannot be read, nodes that do not exist, times that are no steps, and times of one node
    that do not increase.
    """
    table = read_table(path, (TIME, NODE, DISPLACEMENT, NOISE), columns, units)
    t, node, h, steps = table.columns["t"], table.columns["node"], readings.h, readings.steps
    step = np.rint(t / h).astype(int)
    whats = {
        f"there is no such node, they are 1..{n}": (node < 1) | (node > n) | (node != np.rint(node)),
        f"this is no step, they are {h:g} s apart - choose dt": np.abs(t / h - step) > NEAR,
        f"this is none of the {steps} steps of {h:g} s - take more, or leave the row out": (step < 1) | (step > steps),
    }
    for what, wrong in whats.items():
        if wrong.any():
            k = int(np.argmax(wrong))
            raise InputError(f"{path}: line {table.lines[k]}: node {node[k]:g}, t = {t[k]:g} s: {what}")
    nodes, sensor = np.unique(node.astype(int), return_inverse=True)
    order = np.argsort(sensor, kind="stable")
    back = np.flatnonzero((np.diff(sensor[order]) == 0) & (np.diff(step[order]) <= 0))
    if back.size:
        before, k = order[back[0]], order[back[0] + 1]
        raise InputError(
            f"{path}: line {table.lines[k]}: t = {t[k]:g} s of node {node[k]:g} follows {t[before]:g} s in line"
            f" {table.lines[before]} - sort the rows of each node by time, each once"
        )
    d, w = np.zeros((steps, len(nodes))), np.zeros((steps, len(nodes)))
    d[step - 1, sensor], w[step - 1, sensor] = table.columns["displacement"], 1.0
    noise = level(table, readings.noise, readings.who)
    full = None if w.all() else w
    return replace(readings, at=nodes - 1, d=d, w=full, noise=noise), tuple(filter(None, (table.said,)))
