"""Film coefficients, conductivities, diffusivities, sources, fluxes and initial temperatures as parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array, Parameters

THETA_MAX = 100.0  # bound of logarithms


@dataclass(frozen=True)
class Quantity:
    """What a coefficient is; `true` and the relative amplitude `wave` of its parts are of synthetic data, in units of
    the start. Phi is of logarithms of what is positive.
    """

    symbol: str
    unit: str
    true: float
    wave: float = 0.3
    positive: bool = True


QUANTITIES = {
    "film": Quantity("h", "W/m2/K", 1.3),
    "conductivity": Quantity("k", "W/m/K", 0.8),
    "diffusivity": Quantity("a", "m2/s", 0.8),
    "flux": Quantity("q", "W/m2", 1.2, positive=False),
    "source": Quantity("f", "W/m3", 1.2, positive=False),
    "initial": Quantity("T_0", "K", 1.05, wave=0.02, positive=False),
}


@dataclass(frozen=True, eq=False)
class Parts:
    """Where a coefficient has values of its own: the middles x (m, d) of its parts, in lengths of the body, and pairs
    (k, 2) of parts that touch.
    """

    x: Array
    pairs: Array

    @classmethod
    def line(cls, m: int) -> Parts:
        """m equal lengths of a line."""
        upper = np.arange(1, m)
        return cls(((np.arange(m) + 0.5) / m)[:, None], np.stack([upper, upper - 1], axis=1))

    @classmethod
    def point(cls) -> Parts:
        return cls(np.zeros((1, 1)), np.zeros((0, 2), dtype=int))

    @classmethod
    def grid(cls, shape: tuple[int, int]) -> Parts:
        """shape[0] x shape[1] equal parts of a rectangle, along y first."""
        number = np.arange(shape[0] * shape[1]).reshape(shape)
        along_x = np.stack([number[1:], number[:-1]], axis=-1).reshape(-1, 2)
        along_y = np.stack([number[:, 1:], number[:, :-1]], axis=-1).reshape(-1, 2)
        x, y = np.meshgrid(*((np.arange(m) + 0.5) / m for m in shape), indexing="ij")
        return cls(np.stack([x.ravel(), y.ravel()], axis=1), np.concatenate([along_x, along_y]))


@dataclass(frozen=True, eq=False)
class Coefficient:
    """h, k, .. : the components `at` of p, or the exponentials of them; size is that of the start."""

    name: str
    size: float
    parts: Parts
    at: slice
    log: bool

    @property
    def of(self) -> Quantity:
        return QUANTITIES[self.name]

    def value(self, p: Any, xp: Any = np) -> Any:
        return xp.exp(p[self.at]) if self.log else p[self.at]

    def slope(self, p: Array) -> Array:
        """d value/dp, (m,)."""
        return np.exp(p[self.at]) if self.log else np.ones_like(p[self.at])

    def theta(self, p: Any, xp: Any = np) -> Any:
        """What Phi is of: log h and log k."""
        return xp.log(p[self.at]) if self.of.positive and not self.log else p[self.at]

    def theta_slope(self, p: Array) -> Array:
        return 1.0 / p[self.at] if self.of.positive and not self.log else np.ones_like(p[self.at])

    @property
    def truth(self) -> Array:
        x = self.parts.x
        wave = self.of.wave * np.sin(2.0 * np.pi * x[:, 0] + np.pi * x[:, 1:].sum(axis=1)) * (len(x) > 1)
        value = self.size * self.of.true * (1.0 + wave)
        return np.asarray(np.log(value) if self.log else value)

    def label(self, i: int) -> str:
        return f"{'log ' * self.log}{self.of.symbol}{f'_{i + 1}' * (len(self.parts.x) > 1)}"


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The coefficients that p is made of, one after the other."""

    each: tuple[Coefficient, ...]

    @classmethod
    def of(cls, names: list[str], sizes: Mapping[str, float], parts: Mapping[str, Parts], log: bool) -> Unknowns:
        """`sizes` of the start by name, and `parts`; `log`: the logarithms of what is positive."""
        each: list[Coefficient] = []
        for name in names:
            first, m = each[-1].at.stop if each else 0, len(parts[name].x)
            transformed = log and QUANTITIES[name].positive
            each.append(Coefficient(name, sizes[name], parts[name], slice(first, first + m), transformed))
        return cls(tuple(each))

    def parameters(self, length: Array | float) -> Parameters:
        names = [(c, i) for c in self.each for i in range(len(c.parts.x))]
        log, size = np.array([c.log for c, _ in names]), np.array([c.size for c, _ in names])
        nonnegative = [c.of.positive or c.name == "initial" for c, _ in names]
        return Parameters(
            start=np.where(log, np.log(np.abs(size)), size),
            scale=np.where(log, 1.0, np.abs(size)),
            lower=np.where(log, -THETA_MAX, np.where(nonnegative, 0.0, -np.inf)),
            upper=np.where(log, THETA_MAX, np.inf),
            unit=tuple(f"{'log ' * c.log}{c.of.unit}" for c, _ in names),
            label=lambda j: names[j][0].label(names[j][1]),
            position=np.array([length * c.parts.x[i] for c, i in names]),
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
        """Pairs (m, 2) of components whose parts touch."""
        return np.concatenate([c.at.start + c.parts.pairs for c in self.each])
