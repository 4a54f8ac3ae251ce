"""Jumps and corners of J at the point itself, and beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.boxes.bases import base, separable
from benchmarks.boxes.box import KINK, NOISE, OPEN, RIGHT, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import one_scaled, sign
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "jumps and corners"


def plus(model: Model, extra: Callable[[Array], Any], slope: Callable[[Array], Array] | None = None) -> Model:
    """J + extra(p), and g + slope(p); no slope where extra is piecewise constant."""
    g = model.g if slope is None else lambda p: model.g(p) + slope(p)
    return Model(lambda p: model.J(p) + extra(p), g, model.p, model.options)


def first(value: Callable[[Array], Any]) -> Callable[[Array], Array]:
    """A gradient that is value(p) in the first component and 0 elsewhere."""

    def slope(p: Array) -> Array:
        out = np.zeros(len(p))
        out[0] = value(p)
        return out

    return slope


def kinked(model: Model, rng: Rng, name: str = "", expect: frozenset[str] = KINK) -> Iterator[Box]:
    """With its own gradient, one of the one-sided ones, and wrong in sign."""
    yield right(model, expect, f"right{name}", kinked=True)
    fault = sign(model, rng)
    yield wrong(model, fault, WRONG | expect, "combined", name=f"sign{name}", kinked=True)


@family(KIND)
def jump(rng: Rng) -> Iterator[Box]:
    """J is larger by a constant for p_1 > its start: 1e-6 to 1e3."""
    for size in (1e-6, 1e-3, 1.0, 1e3):
        model = separable(rng)
        yield from kinked(plus(model, lambda p, m=model, s=size: s * (p[0].real > m.p[0])), rng, f"-{size:g}")


@family(KIND)
def jump_closed(rng: Rng) -> Iterator[Box]:
    """The point belongs to the upper side, or to neither."""
    model = separable(rng)
    yield from kinked(plus(model, lambda p: 0.2 * (p[0].real >= model.p[0])), rng, "-upper")
    other = separable(rng)
    yield from kinked(plus(other, lambda p: 0.2 * np.sign(p[0].real - other.p[0])), rng, "-between")


@family(KIND)
def jump_of_a_sum(rng: Rng) -> Iterator[Box]:
    """A face through p that is parallel to no axis: an event, a count, a mesh that is made anew."""
    for size in (1e-5, 0.1):
        model = base(rng)
        c = rng.standard_normal(len(model.p))
        yield from kinked(plus(model, lambda p, m=model, c=c, s=size: s * (c @ (p.real - m.p) > 0)), rng, f"-{size:g}")


@family(KIND)
def jump_with_slope(rng: Rng) -> Iterator[Box]:
    """Beyond the jump J rises faster: first contact in a physics engine's step."""
    model = separable(rng)

    def beyond(p: Array) -> bool:
        return bool(p[0].real > model.p[0])

    hit = plus(
        model, lambda p: beyond(p) * (0.01 + 2.0 * (p[0] - model.p[0])), first(lambda p: 2.0 if beyond(p) else 0.0)
    )
    yield from kinked(hit, rng)


@family(KIND)
def jump_nearby(rng: Rng) -> Iterator[Box]:
    """Steps beyond 1e-2 of p meet it, smaller ones do not: the gradient is that of J at p."""
    for size in (1e-3, 1.0):
        model = separable(rng)
        near = plus(model, lambda p, m=model, s=size: s * (p[0].real > m.p[0] * 1.01))
        yield right(near, RIGHT | KINK, f"right-{size:g}")
        yield wrong(near, sign(near, rng), name=f"sign-{size:g}")


@family(KIND)
def wall(rng: Rng) -> Iterator[Box]:
    """Beyond p_1 the solver fails: a large number, or none."""
    for name, value in (("1e20", 1e20), ("inf", np.inf), ("nan", np.nan)):
        model = separable(rng)

        def J(p: Array, model: Model = model, value: float = value) -> Array:
            return model.J(p) if p[0].real <= model.p[0] else model.J(p) + value

        behind = Model(J, model.g, model.p)
        yield right(behind, KINK if name == "1e20" else RIGHT | KINK | OPEN, f"right-{name}", smooth=model.J)
        fault = sign(behind, rng)
        yield wrong(behind, fault, WRONG | KINK | OPEN, "combined", name=f"sign-{name}", smooth=model.J)


@family(KIND)
def one_point_only(rng: Rng) -> Iterator[Box]:
    """J(p) itself has another value than everything around it."""
    model = separable(rng)
    special = plus(model, lambda p: 0.1 * bool((p.real == model.p).all()))
    yield from kinked(special, rng, expect=KINK | OPEN)


@family(KIND)
def absolute_value(rng: Rng) -> Iterator[Box]:
    for size in (1e-3, 1.0):
        model = separable(rng)
        model = Model(model.J, model.g, np.where(np.arange(len(model.p)) == 0, 0.0, model.p))

        def value(p: Array, s: float = size) -> Array:
            return s * p[0] * np.sign(p[0].real)

        slope = first(lambda p, s=size: s * np.sign(p[0]))
        yield from kinked(plus(model, value, slope), rng, f"-{size:g}")


@family(KIND)
def sparse_penalty(rng: Rng) -> Iterator[Box]:
    """Several zeros under an L1 norm."""
    model = base(rng)
    p = model.p * (rng.uniform(size=len(model.p)) < 0.6)
    p[0] = 0.0
    model = Model(model.J, model.g, p)
    scale = {"scale": 1.0}
    with_l1 = plus(model, lambda q: 0.1 * np.sum(q * np.sign(q.real)), lambda q: 0.1 * np.sign(q))
    yield from kinked(Model(with_l1.J, with_l1.g, p, scale), rng)


@family(KIND)
def rectifier(rng: Rng) -> Iterator[Box]:
    """max(0, p_1 - its start)."""
    model = separable(rng)

    def over(p: Array) -> bool:
        return bool(p[0].real > model.p[0])

    yield from kinked(plus(model, lambda p: over(p) * (p[0] - model.p[0]), first(lambda p: float(over(p)))), rng)


@family(KIND)
def clamp(rng: Rng) -> Iterator[Box]:
    """p_1 clamped at an edge it starts on, the slope taken inside or outside."""
    for name, inside in (("inside", True), ("outside", False)):
        rest = separable(rng)
        edge = rest.p[0]

        def clamped(p: Array, edge: float = edge) -> Array:
            return 3.0 * (p[0] if p[0].real < edge else edge)

        def free(p: Array, edge: float = edge, inside: bool = inside) -> float:
            return 3.0 * float(p[0] < edge or (inside and p[0] == edge))

        yield from kinked(plus(rest, clamped, first(free)), rng, f"-{name}")


@family(KIND)
def largest_of(rng: Rng) -> Iterator[Box]:
    """max(p) with two equal largest."""
    n = int(rng.integers(2, 20))
    p = rng.uniform(0.2, 1.0, n)
    p[-1] = p[0] = 1.3

    def g(q: Array) -> Array:
        return (np.arange(n) == int(np.argmax(q))) + 0.2 * q

    yield from kinked(Model(lambda q: q[np.argmax(q.real)] + 0.1 * q @ q, g, p), rng)


@family(KIND)
def distance_at_zero(rng: Rng) -> Iterator[Box]:
    """|p - q| at q: a norm without a square."""
    n = int(rng.integers(1, 12))
    q = rng.uniform(0.5, 1.5, n)

    def g(p: Array) -> Array:
        d = p - q
        return d / (np.sqrt(d @ d) or 1.0) + 0.3

    yield from kinked(Model(lambda p: np.sqrt((p - q) @ (p - q)) + 0.3 * np.sum(p), g, q.copy()), rng)


@family(KIND)
def double_eigenvalue(rng: Rng) -> Iterator[Box]:
    """The larger eigenvalue of [[a, b], [b, c]] where both are equal."""
    a, s = rng.uniform(0.5, 1.5), rng.uniform(0.5, 1.5)

    def J(p: Array) -> Array:
        return 0.5 * (p[0] + p[2]) + np.sqrt(0.25 * (p[0] - p[2]) ** 2 + p[1] ** 2) + s * p[3]

    def g(p: Array) -> Array:
        root = np.sqrt(0.25 * (p[0] - p[2]) ** 2 + p[1] ** 2) or 1.0
        half = 0.25 * (p[0] - p[2]) / root
        return np.array([0.5 + half, p[1] / root, 0.5 - half, s])

    yield from kinked(Model(J, g, np.array([a, 0.0, a, 1.0])), rng)


@family(KIND)
def infinite_slope(rng: Rng) -> Iterator[Box]:
    """|p|^a at 0, a < 1: no number is its slope."""
    for name, power in (("root", 0.5), ("cube-root", 1 / 3), ("steep", 0.8)):
        rest = separable(rng)
        p = rest.p.copy()
        p[0] = 0.0
        steep = plus(Model(rest.J, rest.g, p), lambda q, a=power: (q[0] * np.sign(q[0].real)) ** a)
        yield Box(name, p, steep.J, rest.g, "combined", KINK | OPEN, wrong=frozenset({0}), knowable=False)


@family(KIND)
def slow_power(rng: Rng) -> Iterator[Box]:
    """|p|^1.5 at 0 has a slope, though differences approach it slowly."""
    rest = separable(rng)
    p = rest.p.copy()
    p[0] = 0.0
    soft = plus(
        Model(rest.J, rest.g, p),
        lambda q: (q[0] * np.sign(q[0].real)) ** 1.5,
        first(lambda q: 1.5 * np.sqrt(abs(q[0])) * np.sign(q[0])),
    )
    yield right(soft, RIGHT | KINK | OPEN | NOISE, kinked=True)
    yield wrong(soft, one_scaled(soft, 1, -1.0, "component"), WRONG | KINK | OPEN, "combined")


@family(KIND)
def corner_nearby(rng: Rng) -> Iterator[Box]:
    """A corner 1 % away from p: smaller steps do not see it."""
    model = separable(rng)
    edge = 1.01 * model.p[0]
    near = plus(
        model,
        lambda p: 2.0 * (p[0] - edge) * (p[0].real > edge),
        first(lambda p: 2.0 * (p[0] > edge)),
    )
    yield right(near)
    yield wrong(near, sign(near, rng))


@family(KIND)
def hinge(rng: Rng) -> Iterator[Box]:
    """A support vector machine with one sample exactly on its margin."""
    n = int(rng.integers(2, 12))
    p = rng.uniform(0.3, 1.0, n)
    X = rng.standard_normal((20, n))
    p[0], X[0] = 0.5, np.where(np.arange(n) == 0, 2.0, 0.0)

    def g(q: Array) -> Array:
        return q - X.T @ (X @ q < 1)

    def J(q: Array) -> Array:
        gap = 1 - X @ q
        return 0.5 * q @ q + np.sum(np.where(gap.real > 0, gap, 0))

    yield from kinked(Model(J, g, p), rng)
