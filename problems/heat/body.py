"""What a body that conducts heat is made of, how large it is and what surrounds it, from the options of `heat`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.data.units import Kind, quantity
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.heat.conducting import AROUND
from gradient_routes.problems.problem import Array

DEFAULTS: Mapping[str, Any] = {
    "size": 0.1,
    "conductivity": 50.0,
    "density": 7800.0,
    "heat_capacity": 470.0,
    "film": 100.0,
    "source": 0.0,
    "base": 373.15,
    "ambient": 293.15,
}
START = {"source": 1e5}  # where it is unknown
CELLS_MAX = 10**6
BEYOND = 0.05  # of the range of temperatures, that noise may add to it
KEPT = 0.6  # of an oscillation in a step, from which on a note tells it


@dataclass(frozen=True)
class Body:
    """Cells along x and y, size [m], rho c [J/m3/K], k [W/m/K], h [W/m2/K] of the sides `exposed`, f [W/m3], T_inf and
    T_0 [K], and T at x = 0 [K], None where it is not given.
    """

    cells: tuple[int, int]
    size: tuple[float, float]
    rho_c: float
    k: float
    h: float
    f: float
    T_inf: float
    T_0: float
    base: float | None
    exposed: tuple[str, ...]

    @property
    def excess(self) -> float:
        """T - T_inf at x = 0 [K], 0 where it is not given."""
        return 0.0 if self.base is None else self.base - self.T_inf

    def sizes(self, given: Mapping[str, Any], names: list[str], t: Array | None, T: Array | None) -> dict[str, float]:
        """a [m2/s], h, f and T_0, known or of the start.

        What is unknown and has no start of its own starts from data T (q,) at times t (q,): heat crosses the body until
        the last of them, h L/k = 1, f warms the body by as much as was measured, and T_0 is the first datum.
        """
        found = {"diffusivity": self.k / self.rho_c, "film": self.h, "source": self.f, "initial": self.T_0}
        if t is None or T is None:
            return found
        started = [name for name in names if given["conductivity" if name == "diffusivity" else name] is None]
        end = float(t.max())
        if "diffusivity" in started:
            found["diffusivity"] = self.size[0] ** 2 / end
        if "film" in started:
            found["film"] = found["diffusivity"] * self.rho_c / self.size[0]
        if "source" in started:
            found["source"] = self.rho_c * max(float(np.ptp(T)), 1.0) / end
        if "initial" in started:
            found["initial"] = float(T[t.argmin()])
        return found

    def doubts(self, sizes: Mapping[str, float], h: float, trapezoidal: bool, T: Array | None) -> list[str]:
        """That the trapezoidal rule keeps the shortest waves of a sudden start, with alternating sign; and data T that
        are warmer or colder than all that heats the body, where that is known.
        """
        said = []
        dx = np.array(self.size) / self.cells
        z = 2.0 * sizes["diffusivity"] * h * float((dx[: 1 + (self.cells[1] > 1)] ** -2.0).sum())
        kept, sudden = (z - 1.0) / (1.0 + z), self.base not in (None, self.T_0)
        if trapezoidal and sudden and kept > KEPT:
            said.append(
                f"crank-nicolson: the shortest waves of the sudden start alternate and keep {kept:.0%} in a step -"
                f" dt={h / z:.2g} damps them at once, as backward-euler does"
            )
        if T is not None and self.f == 0.0:
            ends = [self.T_inf, self.T_0, *([] if self.base is None else [self.base])]
            low, high, margin = min(ends), max(ends), BEYOND * (max(ends) - min(ends))
            beyond = (T < low - margin) | (T > high + margin)
            if beyond.any():
                where = f"{low:g} to {high:g} K"
                said.append(f"{beyond.sum()} of {len(T)} data lie beyond {where}, which no body does - check units")
        return said

    @classmethod
    def of(cls, given: Mapping[str, Any], names: list[str]) -> Body:
        """`names` of what is unknown. Raises InputError."""
        n, parts = given["n"], given["parts"]
        ny = n if given["ny"] is None else given["ny"]
        if n < 1 or ny < 1 or n * ny > CELLS_MAX:
            raise InputError(f"heat: n={n},ny={ny} - choose cells along x and y >= 1, at most {CELLS_MAX:g} in all")
        if parts < 1 or n % parts or (ny > 1 and ny % parts):
            raise InputError(f"heat: parts={parts} with {n} x {ny} cells - choose parts that divide both")
        prescribed = given["base"] != "free"
        exposed = _exposed(str(given["exposed"]), prescribed)
        if given["data"] is not None:
            _check_stated(given, names, bool(exposed))
        start = {name: START.get(name, DEFAULTS[name]) if name in names else DEFAULTS[name] for name in DEFAULTS}
        number = {name: start[name] if given[name] is None else given[name] for name in start}
        for name in ("conductivity", "density", "heat_capacity", "film", "source"):
            size = abs(number[name]) if name == "source" else number[name]
            known = name in ("film", "source") and name not in names
            if not ((known and size == 0.0) or 1e-30 <= size <= 1e30):
                raise InputError(f"heat: {name}={number[name]:g} - choose one from 1e-30 to 1e30{', or 0' * known}")
        if "film" in names and not exposed:
            raise InputError("heat: unknown=film, and no side loses heat - name some: exposed=right,top")
        T_inf = temperature("ambient", number["ambient"])
        base = temperature("base", number["base"]) if prescribed else None
        T_0 = T_inf if given["initial"] is None else temperature("initial", given["initial"])
        if base in (None, T_inf) and T_0 == T_inf and not number["source"] and "initial" not in names:
            raise InputError(
                f"heat: base, initial and ambient are {T_inf:g} K, no heat flows - give one of them another temperature"
            )
        rho_c = number["density"] * number["heat_capacity"]
        k, h, f = (float(number[name]) for name in ("conductivity", "film", "source"))
        return cls((n, ny), _size(str(number["size"])), rho_c, k, h, f, T_inf, T_0, base, exposed)


def temperature(name: str, stated: float | str) -> float:
    """[K]. Raises InputError where it is below absolute zero."""
    kind: Kind = "temperature"
    T = quantity(stated, kind, f"heat: {name}={stated}")
    if not 0.0 < T <= 1e6:
        raise InputError(f"heat: {name}={stated} is {T:g} K - choose a temperature > 0 K and <= 1e6 K")
    return T


def _size(text: str) -> tuple[float, float]:
    lengths = [quantity(part, "length", f"heat: size={text}") for part in text.split(",")]
    if len(lengths) > 2 or not all(1e-9 <= length <= 1e9 for length in lengths):
        raise InputError(f"heat: size={text} - give one length or two, such as 100mm,20mm, from 1e-9 to 1e9 m")
    return lengths[0], lengths[-1]


def _exposed(text: str, prescribed: bool) -> tuple[str, ...]:
    """The sides of `text`; all of them are those where T is not prescribed."""
    sides = [] if text == "none" else [*AROUND] if text == "all" else [side.strip() for side in text.split(",")]
    unknown = [side for side in sides if side not in AROUND]
    if unknown:
        raise InputError(f"heat: exposed={text}: no side '{unknown[0]}' - choose {', '.join(AROUND)}, all or none")
    if prescribed and text != "all" and "left" in sides:
        raise InputError(f"heat: exposed={text}, and T is given at x=0 - leave left out, or take base=free")
    return tuple(side for side in AROUND if side in sides and not (prescribed and side == "left"))


def _check_stated(given: Mapping[str, Any], names: list[str], exposed: bool) -> None:
    """Raises InputError where a measured body is not told as a whole: no defaults beside data."""
    wanted = ["size", "density", "heat_capacity", "ambient", "base", "conductivity"]
    wanted += ["film"] if exposed and "film" not in names else []
    wanted += [] if "initial" in names else ["initial"]
    if "diffusivity" in names:
        wanted.remove("conductivity")
    missing = [name for name in wanted if given[name] is None]
    if missing:
        raise InputError(f"heat: data={given['data']} do not tell {', '.join(missing)} - state what was measured")
