"""Units of measured data: a closed list, and their factors to SI."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from gradient_routes.problems.errors import InputError

Kind = Literal["length", "stress", "force", "ratio", "time", "temperature", "temperature change", "number", "word"]
UNITS: Mapping[Kind, Mapping[str, float]] = {
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6},
    "stress": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6},
    "force": {"N": 1.0, "kN": 1e3},
    "ratio": {"1": 1.0, "%": 1e-2, "microstrain": 1e-6},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "temperature": {"K": 1.0, "degC": 1.0},
    "temperature change": {"K": 1.0, "degC": 1.0},
    "number": {},
    "word": {},
}
ZEROS: Mapping[tuple[Kind, str], float] = {("temperature", "degC"): 273.15}  # in SI, of units that start elsewhere
PIXEL = "px"
SPELLINGS = {"µm": "um", "μm": "um", "N/mm²": "N/mm2", "N/mm^2": "N/mm2", "-": "1", "°C": "degC", "C": "degC"}
LISTED = "; ".join(dict.fromkeys(", ".join(factors) for factors in UNITS.values() if factors))
LISTED += "; px with a scale, px:0.02mm"
NO_SCALES: Mapping[str, float] = MappingProxyType({})


def kind_of(unit: str, who: str) -> Kind:
    """The quantity that a unit measures; a pixel is a length. Raises InputError for a unit that is not in the list."""
    name = SPELLINGS.get(unit.strip(), unit.strip())
    found = next((kind for kind, factors in UNITS.items() if name in factors), None)
    if found is None and name != PIXEL:
        raise InputError(f"{who}: unit '{name}' is not known - the units are {LISTED}")
    return found or "length"


def factor(unit: str, kind: Kind, who: str, scales: Mapping[str, float] = NO_SCALES) -> float:
    """The factor from a unit to SI. `scales` are the units that the user has defined, in SI.

    Raises InputError for a unit that is not in the list, or is of another quantity.
    """
    name = SPELLINGS.get(unit.strip(), unit.strip())
    if name == PIXEL and kind == "length":
        if PIXEL in scales:
            return scales[PIXEL]
        raise InputError(f"{who}: a px has no length of its own - give its scale, as in units=px:0.02mm")
    found = kind_of(name, who)
    if name not in UNITS[kind]:
        wanted = f"give a {kind} ({', '.join(UNITS[kind])})" if UNITS[kind] else "leave the unit out"
        raise InputError(f"{who}: '{name}' is a unit of {found}, not of {kind} - {wanted}")
    return UNITS[kind][name]


def zero(unit: str, kind: Kind) -> float:
    """The 0 of a unit, in SI."""
    name = unit.strip()
    return ZEROS.get((kind, SPELLINGS.get(name, name)), 0.0)


def standard_deviation(
    noise: float | str | None, of_file: bool, who: str, kind: Kind = "length", name: str = "noise"
) -> float:
    """The option `name` in SI, 0 where it is None.

    Raises InputError unless it is finite and >= 0, of a file's data > 0.
    """
    if noise is None:
        return 0.0
    sigma = quantity(noise, kind, f"{who}: {name}={noise}")
    if sigma < 0.0 or (of_file and sigma == 0.0):
        least = "> 0, or leave it out where it is not known" if of_file else ">= 0"
        raise InputError(f"{who}: {name}={noise} - give a standard deviation {least}")
    return sigma


def doubt(sigma: float, greatest: float) -> str:
    """A note on noise that exceeds all data [m], else empty."""
    if sigma <= greatest:
        return ""
    return f"noise of {sigma:.3g} m beside data up to {greatest:.3g} m: are the units right?"


def quantity(value: float | str, kind: Kind, who: str) -> float:
    """A number, which is in SI, or text of a number and a unit, such as `0.4um` or `0.4 um`, in SI.

    Raises InputError.
    """
    parts = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*", str(value))
    try:
        number = float(parts[1]) if parts else float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{who}: '{value}' is not a finite number with a unit - write one, like 4e-7 or 0.4um")
    return number * factor(parts[2], kind, who) + zero(parts[2], kind) if parts and parts[2] else number
