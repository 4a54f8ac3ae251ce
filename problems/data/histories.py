"""Temperatures in time at points of a body: when and where they were read, between the steps of a march, and a file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.problems.data.placing import Placed, place
from gradient_routes.problems.data.sensors import level
from gradient_routes.problems.data.table import Group, Table, read_table
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.problem import Array

TIME = Group(("t",), "time", marked=False)
X = Group(("x",), "length", marked=False)
Y = Group(("y",), "length", need="none", marked=False)
TEMPERATURE = Group(("T",), "temperature")
NOISE = Group(("sigma",), "temperature change", need="none")
ROUNDED = 1e-9  # of a step: distance from its end that is attributed to rounding


@dataclass(frozen=True, eq=False)
class Histories:
    """Data k = 1..q: d_k (q,) is (1 - w) y_{t-1} + w y_t, y being what `sensor` (q,) reads after step t = `step` (q,).

    w (q,), 0 < w <= 1 but for data of the start: where between the two steps it was read
    """

    sensor: Array
    step: Array
    w: Array
    d: Array
    steps: int

    @classmethod
    def of_every_step(cls, sensors: int, d: Array) -> Histories:
        """d (T, m) of m sensors after every step."""
        steps = len(d)
        step = np.repeat(np.arange(1, steps + 1), sensors)
        return cls(np.tile(np.arange(sensors), steps), step, np.ones(d.size), d.ravel(), steps)

    @classmethod
    def at_times(cls, sensor: Array, t: Array, d: Array, h: float, steps: int) -> Histories:
        """Of times t (q,) [s] in a march of steps of h [s]."""
        s = t / h
        near = np.abs(s - np.round(s)) < ROUNDED * np.maximum(1.0, s)
        s = np.where(near, np.round(s), s)
        step = np.clip(np.ceil(s), 1, steps).astype(int)
        return cls(sensor, step, s - (step - 1), d, steps)

    def with_data(self, d: Array) -> Histories:
        return replace(self, d=d)

    @property
    def between(self) -> bool:
        """Whether some data lie between two steps."""
        return bool((self.w != 1.0).any())

    @cached_property
    def _of_step(self) -> Array:
        """The data of every step, (T, most), q where a step has fewer."""
        order = np.argsort(self.step, kind="stable")
        first = np.searchsorted(self.step[order], np.arange(1, self.steps + 1))
        place = np.arange(len(order)) - first[self.step[order] - 1]
        rows = np.full((self.steps, 1 + int(place.max(initial=0))), len(order))
        rows[self.step[order] - 1, place] = order
        return rows

    def residual(self, t: Any, before: Any, now: Any, xp: Any = np) -> Any:
        """What the model reads less than was measured in step t, (most,), 0 where nothing was; `before` and `now` (m,)
        are what sensors read before and after it. t may be traced.
        """
        rows = xp.asarray(self._of_step)[t - 1]
        sensor, w, d = (xp.asarray(np.append(a, 0))[rows] for a in (self.sensor, self.w, self.d))
        read = (1.0 - w) * before[sensor] + w * now[sensor]
        return xp.where(rows < len(self.d), read - d, 0.0)

    def pulls(self, t: int, r: Array, sensors: int) -> tuple[Array, Array]:
        """Derivatives of 1/2 |r|^2 by what sensors read before and after step t, (m,) each; r is its residual."""
        rows = self._of_step[t - 1]
        used = rows < len(self.d)
        k, r = rows[used], r[used]
        weights = (1.0 - self.w[k], self.w[k])
        before, now = (np.bincount(self.sensor[k], w * r, minlength=sensors) for w in weights)
        return before, now


@dataclass(frozen=True)
class Recorded:
    """A file's readings: places of the m sensors, `sensor` (q,), t (q,) [s], T (q,) [K], their noise sigma [K], 0 if
    unknown, notes on how they were read; lines (q,) of the file; celsius: whether T states degrees Celsius.
    """

    placed: Placed
    sensor: Array
    t: Array
    T: Array
    sigma: float
    notes: tuple[str, ...]
    lines: Array
    celsius: bool


def read_histories(path: str | Path, mesh: Mesh, columns: str | None, units: str | None, noise: float) -> Recorded:
    """Read columns t,x,y,T, and sigma where there is one, as `read_table` does; rows of one point are one sensor.

    Without a column y all sensors are half way up. Raises InputError for what cannot be read, points outside the body,
    and times of one sensor that do not increase.
    """
    table = read_table(path, (TIME, X, Y, TEMPERATURE, NOISE), columns, units)
    middle = mesh.bounding_box[:, 1].mean()
    x = np.stack([table.columns["x"], table.columns.get("y", np.full(len(table.lines), middle))], axis=1)
    points, first, sensor = np.unique(x, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # as the file names them
    sensor, points = np.argsort(order)[sensor.ravel()], points[order]
    place(mesh, x, path)  # says which row is outside
    _check_times(table, sensor, x)
    sigma = level(table, noise, mesh.who, "K")
    where = "" if "y" in table.columns else f"no column y: sensors at y = {middle:g} m"
    notes = tuple(filter(None, (table.said, where)))
    celsius = table.units.get("T") in ("degC", "°C", "C")
    t, T = table.columns["t"], table.columns["T"]
    return Recorded(place(mesh, points, path), sensor, t, T, sigma, notes, table.lines, celsius)


def _check_times(table: Table, sensor: Array, x: Array) -> None:
    t, order = table.columns["t"], np.argsort(sensor, kind="stable")
    back = np.flatnonzero((np.diff(sensor[order]) == 0) & (np.diff(t[order]) <= 0.0))
    if back.size:
        before, row = order[back[0]], order[back[0] + 1]
        raise InputError(
            f"{table.path}: line {table.lines[row]}: t = {t[row]:g} s at ({x[row, 0]:g}, {x[row, 1]:g}) follows"
            f" {t[before]:g} s in line {table.lines[before]} - sort the rows of each sensor by time, each once"
        )


def check_within(path: str | Path, read: Recorded, end: float) -> None:
    """Raises InputError for times outside a march from 0 to `end` [s]."""
    off = np.flatnonzero((read.t < -ROUNDED * end) | (read.t > (1.0 + ROUNDED) * end))
    if off.size:
        k = off[0]
        raise InputError(
            f"{path}: line {read.lines[k]}: t = {read.t[k]:g} s is outside the march, from 0 to {end:g} s, as are"
            f" {off.size - 1} others - take more steps, a longer dt, or leave the rows out"
        )
