"""Parameters of very different magnitude, zeros among them, and objectives that are tiny or huge."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.boxes.box import NOISE, OPEN, RIGHT, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import one_scaled, scaled, sign, some, zero
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "scales"


def rod(rng: Rng, scale: float | None = None) -> Model:
    """u = u_0 + F f / E against a measurement: E [Pa], a fraction f, an offset u_0 [m] that starts at 0."""
    F, data = rng.uniform(1e8, 4e8), rng.uniform(1.5e-3, 3e-3)

    def r(p: Array) -> Array:
        return p[2] + F * p[1] / p[0] - data

    def g(p: Array) -> Array:
        return r(p) * np.array([-F * p[1] / p[0] ** 2, F / p[0], 1.0])

    start = np.array([2.1e11 * rng.uniform(0.5, 2.0), rng.uniform(0.3, 0.9), 0.0])
    return Model(lambda p: 0.5 * r(p) ** 2, g, start, {} if scale is None else {"scale": [1e10, 0.1, scale]})


@family(KIND)
def zero_offset(rng: Rng) -> Iterator[Box]:
    model = rod(rng)
    yield right(model, RIGHT | OPEN)
    yield wrong(model, one_scaled(model, 0, -1.0, "modulus"))
    yield wrong(model, one_scaled(model, 1, 2.0, "fraction"))
    yield wrong(model, one_scaled(model, 2, -1.0, "the-zero"), WRONG | OPEN)
    yield wrong(model, sign(model, rng))
    yield wrong(model, zero(model, rng))


@family(KIND)
def zero_offset_with_scale(rng: Rng) -> Iterator[Box]:
    model = rod(rng, 1e-3)
    yield right(model)
    yield wrong(model, one_scaled(model, 0, -1.0, "modulus"))
    yield wrong(model, one_scaled(model, 2, 2.0, "the-zero"))
    yield wrong(model, sign(model, rng))


def mounted(rng: Rng) -> Model:
    """Several moduli of 1e11 Pa, several offsets that start at 0."""
    m, n = int(rng.integers(1, 6)), int(rng.integers(1, 6))
    F, data, C = rng.uniform(1e8, 3e8, m), rng.uniform(1e-3, 3e-3, 8), rng.uniform(0.5, 1.5, (8, m + n))

    def r(p: Array) -> Array:
        return C @ np.concatenate([F / p[:m], p[m:]]) - data

    def g(p: Array) -> Array:
        return (C.T @ r(p)) * np.concatenate([-F / p[:m] ** 2, np.ones(n)])

    return Model(lambda p: 0.5 * r(p) @ r(p), g, np.concatenate([rng.uniform(0.5, 2.5, m) * 1e11, np.zeros(n)]))


@family(KIND)
def zeros_beside_moduli(rng: Rng) -> Iterator[Box]:
    model = mounted(rng)
    m = int(np.count_nonzero(model.p))
    yield right(model, RIGHT | OPEN)
    yield wrong(model, one_scaled(model, int(rng.integers(m)), -1.0, "modulus"))
    yield wrong(model, one_scaled(model, int(rng.integers(m, len(model.p))), 2.0, "a-zero"), WRONG | OPEN)
    yield wrong(model, sign(model, rng))
    yield wrong(model, scaled(model, 3.0, "tripled"))


def thin(rng: Rng) -> Model:
    """Lengths of 1e-9 beside an angle that starts at 0; J is a phase."""
    n = int(rng.integers(1, 6))
    k = 2e9 * rng.uniform(0.5, 1.5, n)

    def J(p: Array) -> Array:
        return np.sum(np.cos(k * p[:n] + p[n])) + np.sin(2 * p[n])

    def g(p: Array) -> Array:
        s = np.sin(k * p[:n] + p[n])
        return np.concatenate([-k * s, [2 * np.cos(2 * p[n]) - s.sum()]])

    return Model(J, g, np.concatenate([rng.uniform(0.5, 1.5, n) * 1e-9, [0.0]]))


@family(KIND)
def zero_beside_lengths(rng: Rng) -> Iterator[Box]:
    model = thin(rng)
    yield right(model, RIGHT | OPEN)
    yield wrong(model, one_scaled(model, 0, -1.0, "length"))
    yield wrong(model, one_scaled(model, len(model.p) - 1, 2.0, "the-zero"), WRONG | OPEN)
    yield wrong(model, sign(model, rng))


@family(KIND)
def zero_of_fine_scale(rng: Rng) -> Iterator[Box]:
    """Zeros whose natural change is 1e-6 or 1e-8 beside numbers of order 1."""
    n, fine = int(rng.integers(2, 8)), 10.0 ** rng.integers(-8, -5)
    w = np.concatenate([[fine], np.ones(n)])
    model = Model(
        lambda p: np.sum(np.sin(p / w + 0.3)),
        lambda p: np.cos(p / w + 0.3) / w,
        np.concatenate([[0.0], rng.uniform(0.2, 0.9, n)]),
    )
    yield right(model, RIGHT | OPEN)
    yield wrong(model, one_scaled(model, 0, -1.0, "the-zero"), WRONG | OPEN)
    yield wrong(model, scaled(model, 2.0, "doubled"), WRONG | OPEN)
    known = Model(model.J, model.g, model.p, {"scale": w})
    yield right(known, name="right-scaled")
    yield wrong(known, one_scaled(known, 0, -1.0, "the-zero"), name="the-zero-scaled")
    yield wrong(known, one_scaled(known, 1, -1.0, "other"), name="other-scaled")


@family(KIND)
def all_zero(rng: Rng) -> Iterator[Box]:
    """Every parameter starts at 0; the natural change is 1, or 1e-5."""
    for name, w in (("", 1.0), ("-fine", 1e-5)):
        c = rng.uniform(0.5, 1.5, int(rng.integers(1, 20)))
        model = Model(
            lambda p, c=c, w=w: np.sum(np.arctan(c * p / w + 1.0)),
            lambda p, c=c, w=w: c / w / (1.0 + (c * p / w + 1.0) ** 2),
            np.zeros(len(c)),
        )
        or_open = OPEN if name else frozenset()
        yield right(model, RIGHT | or_open, name=f"right{name}")
        yield wrong(model, sign(model, rng), WRONG | or_open, name=f"sign{name}")
        yield wrong(model, zero(model, rng), WRONG | or_open, name=f"zero{name}")


@family(KIND)
def pascals_and_nanometres(rng: Rng) -> Iterator[Box]:
    """Displacements of a beam of stiffness p_1 [Pa] and thicknesses p_2, ... [m]."""
    n = int(rng.integers(1, 10))
    data = rng.uniform(0.5, 1.5, n)

    def r(p: Array) -> Array:
        return 2e2 / (p[0] * p[1:]) - data

    def g(p: Array) -> Array:
        d = -2e2 / (p[0] * p[1:]) * r(p)
        return np.concatenate([[d.sum() / p[0]], d / p[1:]])

    start = np.concatenate([[2.1e11], 1e-9 * np.ones(n)]) * rng.uniform(0.7, 1.4, n + 1)
    model = Model(lambda p: 0.5 * r(p) @ r(p), g, start)
    yield right(model)
    for fault in (
        zero(model, rng),
        sign(model, rng),
        scaled(model, 2.0, "doubled"),
        one_scaled(model, 0, -1.0, "modulus"),
    ):
        yield wrong(model, fault)


def probe(rng: Rng, size: float) -> Model:
    n = int(rng.integers(1, 20))
    a = rng.uniform(0.5, 1.5, n)
    return Model(
        lambda p: np.sum(a * np.log(p / size) + (p / size) ** 2),
        lambda p: a / p + 2 * p / size**2,
        size * rng.uniform(0.5, 2.0, n),
    )


@family(KIND)
def parameters_of_one_size(rng: Rng) -> Iterator[Box]:
    """The six probes of moduli in Pa and lengths in nm, and more extreme ones."""
    for size in (1e11, 1e-9, 1e-30, 1e30):
        model = probe(rng, size)
        yield right(model, name=f"right-{size:g}")
        for fault in (zero(model, rng), sign(model, rng), scaled(model, 2.0, "doubled"), *some(model, rng, 1)):
            yield wrong(model, fault, name=f"{fault.name}-{size:g}")


@family(KIND)
def objective_of_any_size(rng: Rng) -> Iterator[Box]:
    for size in (1e-30, 1e-12, 1e9, 1e30):
        plain = probe(rng, 1.0)
        model = Model(lambda p, m=plain, s=size: s * m.J(p), lambda p, m=plain, s=size: s * m.g(p), plain.p)
        yield right(model, name=f"right-{size:g}")
        for fault in (zero(model, rng), sign(model, rng), *some(model, rng, 1)):
            yield wrong(model, fault, name=f"{fault.name}-{size:g}")


@family(KIND)
def twenty_decades(rng: Rng) -> Iterator[Box]:
    """Parameters from 1e-10 to 1e10, all of equal weight."""
    n = int(rng.integers(3, 20))
    w = 10.0 ** rng.uniform(-10, 10, n)
    c = rng.uniform(0.5, 1.5, n)
    model = Model(lambda p: np.sum(c * np.sin(p / w)), lambda p: c * np.cos(p / w) / w, w * rng.uniform(0.3, 1.1, n))
    yield right(model)
    for fault in (sign(model, rng), *some(model, rng, 2)):
        yield wrong(model, fault)


@family(KIND)
def beside_a_large_constant(rng: Rng) -> Iterator[Box]:
    """What p moves is 1e-6 of J, or 1e-9: differences know few digits."""
    for size in (1e6, 1e9):
        plain = probe(rng, 1.0)
        model = Model(lambda p, m=plain, s=size: s + m.J(p), plain.g, plain.p)
        yield right(model, RIGHT | NOISE, name=f"right-{size:g}")
        for fault in (zero(model, rng), sign(model, rng)):
            yield wrong(model, fault, name=f"{fault.name}-{size:g}")
