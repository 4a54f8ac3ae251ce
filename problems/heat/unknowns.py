"""Film coefficients h, conductivities k and a flux q as the parameters of a rod."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array, Parameters

THETA_MAX = 100.0  # bound of |log h| and |log k|
UNIT = {"film": "W/m2/K", "conductivity": "W/m/K", "flux": "W/m2"}
SYMBOL = {"film": "h", "conductivity": "k", "flux": "q"}
TRUE = {"film": 1.3, "conductivity": 0.8, "flux": 1.2}  # of synthetic data, in units of the start
WAVE = 0.3  # its relative amplitude along x, where the rod has parts


@dataclass(frozen=True, eq=False)
class Coefficient:
    """h, k or q: the components `at` of p, or the exponentials of them.

    size is that of the start; x (m,) are the middles of its parts, in lengths of the rod.
    """

    name: str
    size: float
    x: Array
    at: slice
    log: bool

    def value(self, p: Any, xp: Any = np) -> Any:
        return xp.exp(p[self.at]) if self.log else p[self.at]

    def slope(self, p: Array) -> Array:
        """d value/dp, (m,)."""
        return np.exp(p[self.at]) if self.log else np.ones_like(p[self.at])

    def theta(self, p: Any, xp: Any = np) -> Any:
        """What Phi is of: log h and log k."""
        return xp.log(p[self.at]) if self.positive and not self.log else p[self.at]

    def theta_slope(self, p: Array) -> Array:
        return 1.0 / p[self.at] if self.positive and not self.log else np.ones_like(p[self.at])

    @property
    def positive(self) -> bool:
        return self.name != "flux"

    @property
    def truth(self) -> Array:
        wave = WAVE * np.sin(2.0 * np.pi * self.x) * (len(self.x) > 1)
        value = self.size * TRUE[self.name] * (1.0 + wave)
        return np.log(value) if self.log else value

    def label(self, i: int) -> str:
        return f"{'log ' * self.log}{SYMBOL[self.name]}{f'_{i + 1}' * (len(self.x) > 1)}"


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The coefficients that p is made of, one after the other."""

    each: tuple[Coefficient, ...]

    @classmethod
    def of(cls, names: list[str], sizes: dict[str, float], parts: int, log: bool) -> Unknowns:
        """`sizes` of the start by name; h and k have one value for each of `parts` of equal length."""
        each: list[Coefficient] = []
        for name in names:
            field, first = name != "flux", each[-1].at.stop if each else 0
            x = (np.arange(parts) + 0.5) / parts if field else np.zeros(1)
            each.append(Coefficient(name, sizes[name], x, slice(first, first + len(x)), log and field))
        return cls(tuple(each))

    def parameters(self, length: float) -> Parameters:
        names = [(c, i) for c in self.each for i in range(len(c.x))]
        log, size = np.array([c.log for c, _ in names]), np.array([c.size for c, _ in names])
        return Parameters(
            start=np.where(log, np.log(np.abs(size)), size),
            scale=np.where(log, 1.0, np.abs(size)),
            lower=np.array([-THETA_MAX if c.log else 0.0 if c.positive else -np.inf for c, _ in names]),
            upper=np.where(log, THETA_MAX, np.inf),
            unit=tuple(f"{'log ' * c.log}{UNIT[c.name]}" for c, _ in names),
            label=lambda j: names[j][0].label(names[j][1]),
            position=np.array([[length * c.x[i]] for c, i in names]),
        )

    def values(self, p: Any, xp: Any = np) -> dict[str, Any]:
        return {c.name: c.value(p, xp) for c in self.each}

    def theta(self, p: Any, xp: Any = np) -> Any:
        return xp.concatenate([c.theta(p, xp) for c in self.each])

    def theta_slope(self, p: Array) -> Array:
        """d theta_i/dp_i, (n_p,)."""
        return np.concatenate([c.theta_slope(p) for c in self.each])

    @property
    def truth(self) -> Array:
        """The p of synthetic data."""
        return np.concatenate([c.truth for c in self.each])

    @property
    def neighbours(self) -> Array:
        """Pairs (m, 2) of components whose parts of the rod touch."""
        upper = np.concatenate([np.arange(c.at.start + 1, c.at.stop) for c in self.each])
        return np.stack([upper, upper - 1], axis=1)
