"""What is sought of the vibrating bar: moduli of elements, coefficients of damping, velocities of nodes at first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.bar import THETA_MAX, true_modulus
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Parameters

KINDS = ("moduli", "damping", "velocity")


@dataclass(frozen=True)
class BarUnknowns:
    """p of the kinds that are unknown, in this order; what is not unknown is what the options say.

    moduli    (N,) E or log E of every element, E in Pa
    damping   its coefficients (c,) or their logarithms: c_M [1/s] and c_K [s], or c_G [1/s]
    velocity  (N,) of nodes 1..N before the first step [m/s]

    x         (N,) middles of elements [m], node (N,) positions of nodes
    c         coefficients of the start, by name
    speed     a natural change of velocities [m/s]
    """

    kinds: tuple[str, ...]
    log: bool
    E: float
    c: dict[str, float]
    x: Array
    node: Array
    speed: float

    @classmethod
    def parse(cls, text: str, who: str, c: dict[str, float], **others: Any) -> BarUnknowns:
        """From `moduli,damping`. Raises InputError."""
        names = [name.strip() for name in text.split(",")]
        if not set(names) <= set(KINDS) or len(set(names)) < len(names):
            raise InputError(f"{who}: unknown={text} - choose among {', '.join(KINDS)}, each once")
        if "damping" in names and (not c or min(c.values()) <= 0.0):
            raise InputError(f"{who}: unknown={text}: there is no damping - choose damping=rayleigh or skew, c > 0")
        return cls(tuple(kind for kind in KINDS if kind in names), c=c, **others)

    @cached_property
    def sizes(self) -> dict[str, int]:
        return {kind: len(self.c) if kind == "damping" else len(self.x) for kind in self.kinds}

    def slice(self, kind: str) -> slice:
        """Where in p a kind is; empty for one that is not unknown."""
        first = sum(self.sizes[k] for k in KINDS[: KINDS.index(kind)] if k in self.kinds)
        return slice(first, first + self.sizes.get(kind, 0))

    def _value(self, q: Any, xp: Any) -> Any:
        return xp.exp(q) if self.log else q

    def moduli(self, p: Any, xp: Any = np) -> Any:
        """E (N,) [Pa]."""
        if "moduli" in self.kinds:
            return self._value(p[self.slice("moduli")], xp)
        return xp.full(len(self.x), self.E) + 0.0 * p[0]

    def damping(self, p: Any, xp: Any = np) -> dict[str, Any]:
        """Coefficients by name, those of p where they are unknown."""
        if "damping" not in self.kinds:
            return dict(self.c)
        return dict(zip(self.c, self._value(p[self.slice("damping")], xp), strict=True))

    def velocity(self, p: Any, xp: Any = np) -> Any:
        """(N,) [m/s] before the first step."""
        return p[self.slice("velocity")] if "velocity" in self.kinds else xp.zeros(len(self.x), dtype=p.dtype)

    def by_p(self, p: Array) -> Array:
        """d(E, c, v)/dp (n_p,), component by component."""
        by = np.ones_like(p)
        for kind in ("moduli", "damping"):
            if self.log:
                by[self.slice(kind)] = np.exp(p[self.slice(kind)])
        return by

    def truth(self) -> Array:
        """Of synthetic data: the bar's moduli, 1.5 times the damping, a quarter of a wave of velocities."""
        length = self.node[-1]
        parts = {
            "moduli": self.E * true_modulus(self.x / length),
            "damping": 1.5 * np.array([*self.c.values()]),
            "velocity": 0.1 * self.speed * np.sin(0.5 * np.pi * self.node / length),
        }
        q = {
            kind: np.log(part) if self.log and kind != "velocity" else part for kind, part in parts.items() if len(part)
        }
        return np.concatenate([q[kind] for kind in self.kinds])

    def parameters(self) -> Parameters:
        units = {"moduli": ["Pa"] * len(self.x), "damping": [UNIT_OF[name] for name in self.c]}
        start = {"moduli": np.full(len(self.x), self.E), "damping": np.array([*self.c.values()])}
        velocity = np.zeros(len(self.x))
        columns: dict[str, list[Any]] = {name: [] for name in ("start", "scale", "lower", "upper", "unit")}
        for kind in self.kinds:
            if kind == "velocity":
                rows = (velocity, velocity + self.speed, velocity - np.inf, velocity + np.inf, ["m/s"] * len(velocity))
            elif self.log:
                one = np.ones(self.sizes[kind])
                rows = (np.log(start[kind]), one, -THETA_MAX * one, THETA_MAX * one, [f"log {u}" for u in units[kind]])
            else:
                q = start[kind]
                rows = (q, q, 0.0 * q, math.exp(THETA_MAX) + 0.0 * q, units[kind])
            for column, part in zip(columns.values(), rows, strict=True):
                column.append(part)
        start_, scale, lower, upper = (np.concatenate(columns[name]) for name in ("start", "scale", "lower", "upper"))
        unit = tuple(u for part in columns["unit"] for u in part)
        labels = self.labels()
        return Parameters(start_, scale, lower, upper, unit, labels.__getitem__, self._positions())

    def labels(self) -> Sequence[str]:
        log = "log " if self.log else ""
        of = {
            "moduli": [f"{log}E_{e + 1}" for e in range(len(self.x))],
            "damping": [f"{log}{name}" for name in self.c],
            "velocity": [f"v_{i + 1}" for i in range(len(self.x))],
        }
        return [label for kind in self.kinds for label in of[kind]]

    def _positions(self) -> Array | None:
        """Of moduli and velocities, along the bar; a coefficient of damping has none."""
        of = {"moduli": self.x, "velocity": self.node}
        return None if "damping" in self.kinds else np.concatenate([of[kind] for kind in self.kinds])[:, None]


UNIT_OF = {"c_M": "1/s", "c_K": "s", "c_G": "1/s"}
