"""Single parameters, stationary points, objectives that do not depend on something, and bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.bases import base, separable
from benchmarks.boxes.box import OPEN, RIGHT, WRONG, Box, Faulty, Model, family, right, wrong
from benchmarks.boxes.faults import component, factor, one_scaled, scaled, sign, zero
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "points and bounds"


@family(KIND)
def one_parameter(rng: Rng) -> Iterator[Box]:
    laws: tuple[tuple[str, Callable[[Array], Array], Callable[[Array], Array]], ...] = (
        ("square", lambda p: p[0] ** 2, lambda p: 2 * p),
        ("exponential", lambda p: np.exp(-p[0]), lambda p: -np.exp(-p)),
        ("sine", lambda p: np.sin(3 * p[0]) + p[0], lambda p: 3 * np.cos(3 * p) + 1),
        ("inverse", lambda p: 1 / p[0], lambda p: -1 / p**2),
    )
    for name, J, g in laws:
        model = Model(J, g, rng.uniform(0.5, 1.5, 1))
        yield right(model, name=f"right-{name}")
        for factor_ in (-1.0, 0.0, 1.1, 1.01, 1.001, 2.0):
            fault = scaled(model, factor_, f"{factor_:g}-{name}")
            yield wrong(model, fault, error=5e-4)


@family(KIND)
def one_parameter_generic(rng: Rng) -> Iterator[Box]:
    """Errors that are no factor: of 10 %, and of 0.3 %, which one point more cannot tell from a loose solve."""
    c = rng.uniform(0.5, 1.5)
    model = Model(lambda p: np.exp(c * p[0]), lambda p: c * np.exp(c * p), rng.uniform(0.5, 1.5, 1))
    yield wrong(model, Faulty("offset", lambda p: model.g(p) + 0.2))
    for name, size, expect in (("gross", 0.3, WRONG), ("small", 0.003, WRONG | OPEN)):
        fault = Faulty(name, lambda p, s=size: model.g(p) * (1 + s * np.cos(5 * (p - model.p))))
        yield wrong(model, fault, expect, error=1e-3)


def bowl(rng: Rng, saddle: bool = False) -> tuple[Model, Array]:
    """A quadratic form about c; its minimum or saddle is c."""
    n = int(rng.integers(1 + saddle, 20))
    c, k = rng.uniform(0.5, 3.0, n), rng.uniform(0.5, 2.0, n)
    if saddle:
        k[0] *= -1.0
    return Model(lambda p: np.sum(k * (p - c) ** 2) + 0.7, lambda p: 2 * k * (p - c), c.copy()), c


def at_rest(model: Model, rng: Rng) -> Iterator[Box]:
    """The gradient is 0 there whatever its mistake; a point beside it tells."""
    yield right(model, RIGHT | OPEN)
    for fault in (zero(model, rng), sign(model, rng), scaled(model, 3.0, "tripled")):
        yield wrong(model, fault, WRONG | OPEN, error=1e-2)


@family(KIND)
def at_a_minimum(rng: Rng) -> Iterator[Box]:
    yield from at_rest(bowl(rng)[0], rng)


@family(KIND)
def at_a_saddle(rng: Rng) -> Iterator[Box]:
    yield from at_rest(bowl(rng, saddle=True)[0], rng)


@family(KIND)
def at_a_flat_minimum(rng: Rng) -> Iterator[Box]:
    """Of order four."""
    c = rng.uniform(0.5, 3.0, int(rng.integers(1, 12)))
    yield from at_rest(Model(lambda p: np.sum((p - c) ** 4), lambda p: 4 * (p - c) ** 3, c.copy()), rng)


@family(KIND)
def at_a_perfect_fit(rng: Rng) -> Iterator[Box]:
    """J = 0 and dJ/dp = 0: synthetic data of the start itself."""
    n = int(rng.integers(1, 12))
    A = rng.standard_normal((n + 5, n))
    p = rng.uniform(0.5, 1.5, n)
    data = np.tanh(A @ p)

    def g(q: Array) -> Array:
        t = np.tanh(A @ q)
        return A.T @ ((t - data) * (1 - t * t))

    yield from at_rest(Model(lambda q: 0.5 * np.sum((np.tanh(A @ q) - data) ** 2), g, p), rng)


@family(KIND)
def wrong_at_a_minimum(rng: Rng) -> Iterator[Box]:
    """A gradient that is not 0 where J is stationary."""
    model, c = bowl(rng)
    yield wrong(model, Faulty("offset", lambda p: model.g(p) + 0.1 * c), error=1e-2)


@family(KIND)
def near_a_minimum(rng: Rng) -> Iterator[Box]:
    """1e-4 away: slopes are small beside what J changes by."""
    model, c = bowl(rng)
    near = Model(model.J, model.g, c * (1 + 1e-4 * rng.choice([-1, 1], len(c))))
    yield right(near)
    for fault in (zero(near, rng), sign(near, rng), scaled(near, 3.0, "tripled")):
        yield wrong(near, fault, WRONG | OPEN)


@family(KIND)
def stationary_in_one(rng: Rng) -> Iterator[Box]:
    """One component is 0 at p; the others tell."""
    model = separable(rng)
    J, g, c = model.J, model.g, 1.3
    p = np.append(model.p, c)

    def slope(q: Array) -> Array:
        return np.append(g(q[:-1]), 2 * (q[-1] - c))

    whole = Model(lambda q: J(q[:-1]) + (q[-1] - c) ** 2, slope, p)
    yield right(whole)
    yield wrong(whole, sign(whole, rng))
    yield wrong(whole, one_scaled(whole, len(p) - 1, -1.0, "the-stationary"), WRONG | OPEN)


@family(KIND)
def nothing_moves(rng: Rng) -> Iterator[Box]:
    """J is constant: a solver that stopped before it began."""
    n, value = int(rng.integers(1, 12)), float(rng.choice([0.0, 4.25, 1e6]))
    model = Model(lambda p: value + 0 * p[0], lambda p: 0 * p, rng.uniform(0.5, 2.0, n))
    yield right(model, OPEN)
    yield wrong(model, Faulty("not-zero", lambda p: np.ones(n)), error=0.5)


@family(KIND)
def absolute_tolerance(rng: Rng) -> Iterator[Box]:
    """A right side of 1e-7 under a tolerance of 1e-6: the solver returns 0, J is the data's norm, g is 0."""
    n = int(rng.integers(1, 12))
    p, data = rng.uniform(0.5, 2.0, n), 1e-7 * rng.uniform(0.5, 1.5, n)

    def u(q: Array) -> Array:
        f = np.full(n, 1e-7)
        return f / q if np.abs(f).max() > 1e-6 else 0 * q

    def J(q: Array) -> float:
        return float(0.5 * np.sum((u(q) - data) ** 2))

    exact = Model(lambda q: 0.5 * np.sum((1e-7 / q - data) ** 2), lambda q: -(1e-7 / q - data) * 1e-7 / q**2, p)
    yield wrong(exact, Faulty("zero", lambda q: 0 * q), OPEN | WRONG, "combined", objective=J)


@family(KIND)
def one_that_does_nothing(rng: Rng) -> Iterator[Box]:
    """J does not depend on the last parameter."""
    model = separable(rng)
    n = len(model.p)
    c = rng.uniform(0.5, 1.5)

    def g(p: Array) -> Array:
        return np.append(model.g(p[:n]), 0.0)

    idle = Model(lambda p: model.J(p[:n]), g, np.append(model.p, c))
    yield right(idle)
    stray = Faulty("stray", lambda p: np.append(model.g(p[:n]), 0.7), frozenset({n}))
    yield wrong(idle, stray)
    yield wrong(idle, sign(idle, rng))


@family(KIND)
def at_a_bound(rng: Rng) -> Iterator[Box]:
    """Some parameters start on a bound, beyond which J is not asked for."""
    for name in ("lower", "upper", "both"):
        model = base(rng)
        p, n = model.p, len(model.p)
        held = rng.uniform(size=n) < 0.5
        held[0] = True
        lower = np.where(held & (name != "upper"), p, p - 2.0 * np.abs(p))
        upper = np.where(held & (name == "upper"), p, p + 2.0 * np.abs(p))
        if name == "both":
            upper = np.where(~held, p, upper)
        bounded = Model(model.J, model.g, p, {"bounds": (lower, upper)})
        yield right(bounded, name=f"right-{name}")
        for fault in (sign(bounded, rng), component(bounded, rng), factor(bounded, rng)):
            yield wrong(bounded, fault, name=f"{fault.name}-{name}")


@family(KIND)
def undefined_beyond(rng: Rng) -> Iterator[Box]:
    """J is NaN outside its bounds, on which half of the parameters start."""
    n = int(rng.integers(1, 12))
    p = np.where(np.arange(n) % 2, rng.uniform(0.5, 2.0, n), 1.0)

    def J_inside(q: Array) -> Array:
        return np.sum(np.sin(q) * q)

    def objective(q: Array) -> float:
        outside = (q < np.where(np.arange(n) % 2, 0.4, 1.0)).any()
        return float("nan") if outside else float(J_inside(q))

    lower = np.where(np.arange(n) % 2, 0.4, 1.0)
    model = Model(J_inside, lambda q: np.cos(q) * q + np.sin(q), p, {"bounds": (lower, np.full(n, np.inf))})
    yield right(model, objective=objective)
    for fault in (sign(model, rng), factor(model, rng)):
        yield wrong(model, fault, objective=objective)


@family(KIND)
def between_tight_bounds(rng: Rng) -> Iterator[Box]:
    """An interval of 1e-3 or 1e-5 of p."""
    for width in (1e-3, 1e-5):
        model = separable(rng)
        bounds = (model.p * (1 - width), model.p * (1 + width))
        tight = Model(model.J, model.g, model.p, {"bounds": bounds})
        yield right(tight, name=f"right-{width:g}")
        for fault in (sign(tight, rng), component(tight, rng)):
            yield wrong(tight, fault, name=f"{fault.name}-{width:g}")


@family(KIND)
def held_by_bounds(rng: Rng) -> Iterator[Box]:
    """Lower = upper: the parameter is fixed, and what its gradient says does not matter."""
    model = separable(rng, int(rng.integers(3, 12)))
    free = np.arange(len(model.p)) > 0
    bounds = (np.where(free, -np.inf, model.p), np.where(free, np.inf, model.p))
    held = Model(model.J, model.g, model.p, {"bounds": bounds})
    yield right(held)
    yield wrong(held, sign(held, rng))
    yield wrong(held, one_scaled(held, 1, 2.0, "component"))


@family(KIND)
def without_values(rng: Rng) -> Iterator[Box]:
    """J or its gradient has no value at p, or J has none anywhere else."""
    model = separable(rng)
    p, nan = model.p, float("nan")

    def fails(q: Array) -> float:
        raise ArithmeticError("the matrix is singular")

    def alone(q: Array) -> float:
        return float(model.J(q)) if (q == p).all() else nan

    about = {"start": p, "truth": "right", "expect": OPEN, "wrong": frozenset(), "gradient": model.g}
    yield Box("right-nan", objective=lambda q: nan, **about)
    yield Box("right-inf", objective=lambda q: float("inf"), **about)
    yield Box("right-raises", objective=fails, **about)
    yield Box("right-alone", objective=alone, **about)
    J = lambda q: float(model.J(q))  # noqa: E731
    yield Box("sign-alone", p, alone, lambda q: -model.g(q), "wrong", OPEN | WRONG, knowable=False)
    yield Box("gradient-nan", p, J, lambda q: np.where(np.arange(len(q)) == 0, nan, model.g(q)), "wrong", WRONG)
    yield Box("gradient-raises", p, J, fails, "wrong", OPEN | WRONG, knowable=False)
