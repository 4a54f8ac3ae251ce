"""Six gradients of one J, whatever its units: moduli in Pa, lengths of some nm, both at once."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes import check
from gradient_routes.problems.problem import Array

SIZES = {
    "moduli": np.full(5, 2.1e11),
    "lengths": np.full(5, 3e-9),
    "both": np.array([2.1e11, 7e10, 3e-9, 5e-9, 1.0]),
}
X = np.array([1.0, 0.6, 1.4, 0.8, 1.2])  # p in units of its size
A = np.array([1.0, -0.7, 0.5, 1.3, -0.4])


def doubled(g: Array, i: int) -> Array:
    return np.where(np.arange(len(g)) == i, 2.0 * g, g)


PROBES = {
    "right": lambda g: g,
    "zero": lambda g: 0.0 * g,
    "sign": lambda g: -g,
    "doubled": lambda g: 2.0 * g,
    "component": lambda g: doubled(g, 3),
    "one per cent": lambda g: 1.01 * g,
}


@pytest.mark.parametrize("unit", [1.0, 1e9, 1e-9], ids="J in {:g}".format)
@pytest.mark.parametrize("sizes", SIZES)
@pytest.mark.parametrize("probe", PROBES)
def test_a_probe_is_told_in_any_units(probe: str, sizes: str, unit: float) -> None:
    size = SIZES[sizes]

    def J(p: Array) -> float:
        x = p / size
        return unit * float(A @ np.sin(x) + 0.2 * np.sum(x[1:] * x[:-1]))

    def dJ(p: Array) -> Array:
        x = p / size
        beside = np.pad(x, 1)
        return PROBES[probe](unit * (A * np.cos(x) + 0.2 * (beside[2:] + beside[:-2])) / size)

    found = check(J, dJ, X * size)
    assert found.verdict == ("agrees" if probe == "right" else "wrong-gradient")
    if probe == "component":
        assert found.culprit == "component p_4, off by the factor 2"


@pytest.mark.parametrize("size", [2.1e11, 3e-9])
@pytest.mark.parametrize("probe", [name for name in PROBES if name != "component"])
def test_a_single_parameter_is_told_too(probe: str, size: float) -> None:
    found = check(lambda p: float(np.exp(p[0] / size)), lambda p: PROBES[probe](np.exp(p / size) / size), [0.7 * size])
    assert found.verdict == ("agrees" if probe == "right" else "wrong-gradient")
