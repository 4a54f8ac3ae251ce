"""A fin: a rod of constant section, where it starts and ends, and what its closed form tells of measured temperatures.

theta = T - T_inf = theta_0 cosh m(L - x) / cosh mL of an insulated tip, m^2 = h P / (k A); q = k m theta_0 tanh mL
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.data.units import Kind, quantity
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

DEFAULTS: Mapping[str, Any] = {
    "length": 0.3,
    "diameter": 0.01,
    "ambient": 293.15,
    "base": 373.15,
    "film": 10.0,
    "conductivity": 50.0,
    "flux": 2e4,
}
KINDS: Mapping[str, Kind] = {
    "length": "length",
    "diameter": "length",
    "perimeter": "length",
    "ambient": "temperature",
    "base": "temperature",
}
UNSEEN = 14.0  # m x from which on theta < 1e-6 theta_0
DECAYS = np.geomspace(1e-2, 1e2, 401)  # m L to choose from: beyond, the rod is isothermal or cold


@dataclass(frozen=True, eq=False)
class Fin:
    """L [m], A [m^2], P [m], T_inf [K]; theta [K] at x = 0 and at x = L, (1,) where it is prescribed, else (0,).

    convective: whether heat is lost through the tip, too.
    """

    L: float
    A: float
    P: float
    T_inf: float
    before: Array
    behind: Array
    convective: bool

    @classmethod
    def of(cls, given: Mapping[str, Any], heated: bool) -> Fin:
        """From the options of the rod; `heated`: a flux enters at x = 0. Raises InputError."""
        D, tip, T_inf = value("diameter", given), given["tip"], value("ambient", given)
        A = math.pi * D**2 / 4.0 if given["area"] is None else value("area", given)
        P = math.pi * D if given["perimeter"] is None else value("perimeter", given)
        before = [] if heated else [value("base", given) - T_inf]
        free = tip in ("insulated", "convective")
        behind = [] if free else [quantity(tip, "temperature", f"rod: tip={tip}") - T_inf]
        if not (heated or any(before) or any(behind)):
            raise InputError(f"rod: base and ambient are {T_inf:g} K, no heat flows - give different temperatures")
        return cls(value("length", given), A, P, T_inf, np.array(before), np.array(behind), tip == "convective")

    def fitted(self, x: Array, d: Array) -> tuple[float, float]:
        """m [1/m] and theta_0 [K] of the closed form with the least |theta - d|^2, theta_0 where it is not given."""
        y = 1.0 - x / self.L
        shapes = [np.exp(-mL * (1.0 - y)) * (1.0 + np.exp(-2.0 * mL * y)) / (1.0 + np.exp(-2.0 * mL)) for mL in DECAYS]
        sizes = [self.before[0] if self.before.size else (f @ d) / (f @ f) for f in shapes]
        best = int(np.argmin([np.sum((c * f - d) ** 2) for c, f in zip(sizes, shapes, strict=True)]))
        return float(DECAYS[best]) / self.L, float(sizes[best])

    def sizes(self, names: list[str], known: dict[str, float], x: Array, d: Array) -> dict[str, float]:
        """film, conductivity and flux of the fitted closed form, the known ones of them as they are."""
        m, theta_0 = self.fitted(x, d)
        by_flux = m * theta_0 * math.tanh(m * self.L)  # q/k
        ratio = m**2 * self.A / self.P  # h/k
        k = known["conductivity"]
        if "conductivity" in names:
            k = abs(known["flux"] / by_flux) if "film" in names and not self.before.size else known["film"] / ratio
        fitted = {"film": k * ratio, "conductivity": k, "flux": k * by_flux}
        return known | {name: fitted[name] for name in names}

    def reaches(self, sizes: Mapping[str, float], x: float) -> bool:
        """Whether a thermocouple at x sees more than the surroundings: if none does, the gradient is 0."""
        h, k = sizes["film"], sizes["conductivity"]
        return bool(self.behind.size) or x * math.sqrt(h * self.P / (k * self.A)) <= UNSEEN


def value(name: str, given: Mapping[str, Any]) -> float:
    """An option in SI, or its default. Raises InputError unless it is > 0, a flux not 0."""
    stated = DEFAULTS[name] if given[name] is None else given[name]
    size = quantity(stated, KINDS.get(name, "number"), f"rod: {name}={stated}")
    if not 1e-30 <= (abs(size) if name == "flux" else size) <= 1e30:
        raise InputError(f"rod: {name}={stated} - choose one from 1e-30 to 1e30")
    return size


def check_given(given: Mapping[str, Any], names: list[str], heated: bool) -> None:
    """Raises InputError where a measured rod is not told as a whole: no defaults beside data."""
    section = ("area",) if given["area"] is not None else ("diameter",)
    known = [name for name in ("film", "conductivity") if name not in names]
    missing = [name for name in ("length", *section, "ambient", *known) if given[name] is None]
    missing += ["base or flux"] if not heated and given["base"] is None else []
    if missing:
        raise InputError(f"rod: data={given['data']} do not tell {', '.join(missing)} - state what was measured")
