"""J that explodes, or has no value, at a natural step: its largest change says nothing of errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.box import Box, Model, add, right, wrong
from benchmarks.boxes.faults import sign, some, zero
from gradient_routes.problems.problem import Array

Rng = np.random.Generator


def lennard_jones(rng: Rng) -> Model:
    n = int(rng.integers(1, 30))
    return Model(lambda q: np.sum(q**-12 - q**-6), lambda q: -12 * q**-13 + 6 * q**-7, rng.uniform(0.9, 1.4, n))


def morse(rng: Rng) -> Model:
    n, a = int(rng.integers(1, 20)), rng.uniform(20, 60)

    def g(q: Array) -> Array:
        e = np.exp(-a * (q - 1))
        return 2 * a * (1 - e) * e

    return Model(lambda q: np.sum((1 - np.exp(-a * (q - 1))) ** 2), g, 1 + rng.uniform(-0.5, 2.0, n) / a)


def diode(rng: Rng) -> Model:
    n, V_T, measured = int(rng.integers(1, 10)), 0.02585, rng.uniform(0.01, 0.2)

    def r(V: Array) -> Array:
        return 1e-12 * np.expm1(V / V_T) - measured

    return Model(
        lambda V: 0.5 * np.sum(r(V) ** 2),
        lambda V: r(V) * 1e-12 * np.exp(V / V_T) / V_T,
        rng.uniform(0.6, 0.75, n),
    )


def butler_volmer(rng: Rng) -> Model:
    n, V_T, i = int(rng.integers(1, 10)), 0.05, rng.uniform(0.5, 3.0)
    return Model(
        lambda V: 0.5 * np.sum((np.sinh(V / V_T) - i) ** 2),
        lambda V: (np.sinh(V / V_T) - i) * np.cosh(V / V_T) / V_T,
        rng.uniform(0.8, 1.2, n),
    )


def arrhenius(rng: Rng) -> Model:
    """p = (log A, E [J/mol]), rates at several temperatures."""
    RT = 8.314 * np.linspace(300.0, 400.0, 8)
    k = np.exp(25.0 - 60e3 / RT) * rng.uniform(0.8, 1.25, 8)

    def rates(p: Array) -> Array:
        return np.exp(p[0] - p[1] / RT)

    def g(p: Array) -> Array:
        d = (rates(p) - k) * rates(p)
        return np.array([d.sum(), -np.sum(d / RT)])

    return Model(lambda p: 0.5 * np.sum((rates(p) - k) ** 2), g, np.array([25.0, 60e3]) * rng.uniform(0.98, 1.02, 2))


def fung_tissue(rng: Rng) -> Model:
    n = int(rng.integers(1, 12))
    b = rng.uniform(10, 40, n)

    def W(E: Array) -> Array:
        return 0.5 * np.expm1(np.sum(b * E * E))

    return Model(
        lambda E: W(E) - 2.0 * E.sum(), lambda E: (2 * W(E) + 1) * b * E - 2.0, rng.uniform(0.4, 1.0, n) / n**0.5
    )


def ogden_rubber(rng: Rng) -> Model:
    n, a = int(rng.integers(1, 10)), rng.uniform(40, 60)
    return Model(
        lambda s: np.sum(s**a + 2 * s ** (-a / 2) - 3),
        lambda s: a * s ** (a - 1) - a * s ** (-a / 2 - 1),
        rng.uniform(1.1, 1.3, n),
    )


def power_50(rng: Rng) -> Model:
    n = int(rng.integers(1, 20))
    return Model(lambda p: np.sum(p**50), lambda p: 50 * p**49, rng.uniform(0.95, 1.05, n))


def stiff_exponential(rng: Rng) -> Model:
    n, a = int(rng.integers(1, 20)), rng.uniform(20, 40)
    return Model(lambda p: np.sum(np.exp(a * p)), lambda p: a * np.exp(a * p), rng.uniform(0.8, 1.2, n))


def log_parameters(rng: Rng) -> Model:
    n, scale = int(rng.integers(1, 20)), rng.uniform(0.5, 2.0)
    c = rng.uniform(0.5, 1.5, n)
    return Model(lambda m: c @ np.exp(m), lambda m: c * np.exp(m), rng.uniform(20, 28, n), {"scale": scale})


def log_moduli(rng: Rng) -> Model:
    """Springs in series of moduli exp(m), m = 25 or so, and measured displacements."""
    n = int(rng.integers(1, 20))
    data = rng.uniform(0.5, 1.5, n)

    def r(m: Array) -> Array:
        return np.cumsum(np.exp(25.0 - m)) - data

    def g(m: Array) -> Array:
        return -np.exp(25.0 - m) * np.cumsum(r(m)[::-1])[::-1]

    return Model(lambda m: 0.5 * r(m) @ r(m), g, rng.uniform(24, 26, n))


def growth(rng: Rng) -> Model:
    """x' = a x until t = 30, from x(0): p = (a, x(0))."""
    data = rng.uniform(5.0, 20.0)

    def g(p: Array) -> Array:
        e = np.exp(30 * p[0])
        return (p[1] * e - data) * np.array([30 * p[1] * e, e])

    return Model(lambda p: 0.5 * (p[1] * np.exp(30 * p[0]) - data) ** 2, g, rng.uniform(0.9, 1.1, 2))


def pole(rng: Rng) -> Model:
    n = int(rng.integers(1, 10))
    return Model(lambda p: np.sum((1.0 - p) ** -8.0), lambda p: 8 * (1.0 - p) ** -9.0, rng.uniform(0.45, 0.55, n))


T = np.linspace(0, 2, 9)


def decay(rng: Rng, otherwise: Callable[[], float]) -> Model:
    """A fit whose solver fails for rates below one half; `otherwise` says how."""
    data = 1.2 * np.exp(-0.8 * T) * rng.uniform(0.9, 1.1, 9)

    def J(p: Array) -> Array:
        return otherwise() if p[0].real <= 0.5 else 0.5 * np.sum((p[1] * np.exp(-p[0] * T) - data) ** 2)

    def g(p: Array) -> Array:
        e = np.exp(-p[0] * T)
        r = p[1] * e - data
        return np.array([-np.sum(r * T * p[1] * e), np.sum(r * e)])

    return Model(J, g, rng.uniform(0.8, 1.3, 2))


def _raises() -> float:
    raise RuntimeError("the solver failed: residual 1e+30 after 50 iterations")


def returns_1e20(rng: Rng) -> Model:
    return decay(rng, lambda: 1e20)


def returns_1e300(rng: Rng) -> Model:
    return decay(rng, lambda: 1e300)


def returns_inf(rng: Rng) -> Model:
    return decay(rng, lambda: float("inf"))


def returns_nan(rng: Rng) -> Model:
    return decay(rng, lambda: float("nan"))


def raises(rng: Rng) -> Model:
    return decay(rng, _raises)


EXPLODING = (
    *(lennard_jones, morse, diode, butler_volmer, arrhenius, fung_tissue, ogden_rubber, power_50, stiff_exponential),
    *(log_parameters, log_moduli, growth, pole, returns_1e20, returns_1e300, returns_inf, returns_nan, raises),
)


def faulted(build: Callable[[Rng], Model]) -> Callable[[Rng], Iterator[Box]]:
    """Right, wrong in sign, zero, and two more mistakes."""

    def boxes(rng: Rng) -> Iterator[Box]:
        yield right(build(rng))
        model = build(rng)
        for fault in (sign(model, rng), zero(model, rng), *some(model, rng, 2)):
            yield wrong(model, fault)

    return boxes


for build in EXPLODING:
    add(build.__name__.replace("_", "-"), "J explodes", faulted(build))
