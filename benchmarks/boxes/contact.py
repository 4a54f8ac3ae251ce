"""Contact, plasticity and friction, with active sets: evidence of a kink, never a proof."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.boxes.box import KINK, OPEN, RIGHT, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import component, scaled, sign, zero
from benchmarks.boxes.physics import laplacian
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "active sets"


def with_sets(model: Model, sets: Any) -> Model:
    return Model(model.J, model.g, model.p, {**model.options, "active_set": sets})


def faulted(model: Model, rng: Rng, ok: frozenset[str], name: str, **more: Any) -> Iterator[Box]:
    """Right, and wrong in sign, factor, one component and altogether."""
    yield right(model, ok, f"right{name}", **more)
    for fault in (sign(model, rng), scaled(model, 2.0, "doubled"), component(model, rng), zero(model, rng)):
        yield wrong(model, fault, name=f"{fault.name}{name}", **more)


def springs(rng: Rng, at_the_edge: bool, power: float = 2.0) -> Model:
    """Springs pressed against stops at 0.5, whose penalty grows with a power of the penetration."""
    n, stop, k = int(rng.integers(1, 20)), 0.5, rng.uniform(2, 50)
    p = rng.uniform(0.1, 0.95, n)
    if at_the_edge:
        p[0] = stop

    def deep(p: Array) -> Array:
        return np.where(p.real > stop, p - stop, 0)

    return Model(
        lambda p: 0.5 * np.sum((p - 1) ** 2) + k * np.sum(deep(p) ** power),
        lambda p: p - 1 + power * k * deep(p) ** (power - 1.0),
        p,
        {"active_set": lambda p: tuple((p > stop).tolist())},
    )


@family(KIND)
def penalty_contact(rng: Rng) -> Iterator[Box]:
    """C1: the slope is continuous, at the edge and beside it."""
    yield from faulted(springs(rng, True), rng, RIGHT | KINK, "-at-the-edge")
    yield from faulted(springs(rng, False), rng, RIGHT | KINK, "")


@family(KIND)
def hertzian_contact(rng: Rng) -> Iterator[Box]:
    """Penetration to the power 5/2: C2."""
    yield from faulted(springs(rng, True, 2.5), rng, RIGHT | KINK, "-at-the-edge")


@family(KIND)
def penalty_without_sets(rng: Rng) -> Iterator[Box]:
    """The same J, but nobody tells the active set."""
    model = springs(rng, True)
    yield from faulted(Model(model.J, model.g, model.p), rng, RIGHT | KINK, "")


@family(KIND)
def exact_penalty(rng: Rng) -> Iterator[Box]:
    """C0: the slope jumps at the stop."""
    n, k = int(rng.integers(1, 12)), rng.uniform(1, 10)
    p = rng.uniform(0.1, 0.95, n)
    p[0] = 0.5

    def J(p: Array) -> Array:
        return 0.5 * np.sum((p - 1) ** 2) + k * np.sum(np.where(p.real > 0.5, p - 0.5, 0))

    model = Model(J, lambda p: p - 1 + k * (p > 0.5), p, {"active_set": lambda p: tuple((p > 0.5).tolist())})
    yield right(model, KINK, kinked=True)
    fault = sign(model, rng)
    yield wrong(model, fault, WRONG | KINK, "combined", kinked=True)
    away = Model(model.J, model.g, np.where(p == 0.5, 0.7, p), model.options)
    yield from faulted(away, rng, RIGHT | KINK, "-away")


def obstacle(rng: Rng) -> Model:
    """A string of n nodes under loads p above an obstacle; nodes on it are found one by one; J = work of a weight."""
    n = int(rng.integers(3, 10))
    K, w, floor = laplacian(n) + 0.1 * np.eye(n), rng.uniform(0.5, 1.5, n), -0.4

    def solved(p: Array) -> tuple[Array, Array]:
        held = np.zeros(n, dtype=bool)
        u = 0 * p
        for _ in range(3 * n):
            free = ~held
            u = np.where(held, floor, 0 * p)
            u[free] = np.linalg.solve(K[np.ix_(free, free)], -p[free] - K[np.ix_(free, held)] @ u[held])
            force = (K @ u + p).real
            new = (u.real < floor) | (held & (force > 0))
            if (new == held).all():
                break
            held = new
        return u, held

    def g(p: Array) -> Array:
        u, held = solved(p)
        out, free = np.zeros(n), ~held
        out[free] = -np.linalg.solve(K[np.ix_(free, free)], (w * u)[free])
        return out

    start = 0.3 * rng.uniform(0.5, 1.5, n)
    sets = {"active_set": lambda p: tuple(solved(p)[1].tolist())}
    return Model(lambda p: 0.5 * np.sum(w * solved(p)[0] ** 2), g, start, sets)


@family(KIND)
def obstacle_problem(rng: Rng) -> Iterator[Box]:
    """Away from changes of the contact zone J is smooth."""
    yield from faulted(obstacle(rng), rng, RIGHT | KINK, "")


@family(KIND)
def plastic_bar(rng: Rng) -> Iterator[Box]:
    """Return mapping: forces against strains p beyond yield; J is C1 there."""
    n, E, y, H = int(rng.integers(2, 20)), 10.0, 1.0, rng.uniform(0.5, 3.0)
    p = rng.uniform(0.02, 0.3, n)
    p[0] = y / E

    def energy(p: Array) -> Array:
        over = np.where(p.real > y / E, p - y / E, 0)
        return np.sum(0.5 * E * p * p - 0.5 * (E - H) * over**2 - 0.7 * p)

    def g(p: Array) -> Array:
        return E * p - (E - H) * np.maximum(p - y / E, 0) - 0.7

    model = Model(energy, g, p, {"active_set": lambda p: tuple((p > y / E).tolist())})
    yield from faulted(model, rng, RIGHT | KINK, "")


@family(KIND)
def stick_and_slip(rng: Rng) -> Iterator[Box]:
    """Friction forces: C0 where a slider just begins to move."""
    n, k, limit = int(rng.integers(1, 12)), 5.0, 1.0
    p = rng.uniform(0.05, 0.5, n)
    p[0] = limit / k
    c = rng.uniform(0.5, 1.5, n)

    def J(p: Array) -> Array:
        return c @ np.where(k * p.real < limit, k * p, limit) + p @ p

    model = Model(
        J, lambda p: c * k * (k * p < limit) + 2 * p, p, {"active_set": lambda p: tuple((k * p < limit).tolist())}
    )
    yield right(model, KINK, kinked=True)
    fault = sign(model, rng)
    yield wrong(model, fault, WRONG | KINK, "combined", kinked=True)


@family(KIND)
def active_sets_that_lie(rng: Rng) -> Iterator[Box]:
    """Another set at every call, one that depends on every digit, one that never changes, one that raises."""
    count = [0]

    def counter(p: Array) -> int:
        count[0] += 1
        return count[0]

    def fails(p: Array) -> int:
        raise ValueError("no contact search before the first step")

    for name, sets in (
        ("counter", counter),
        ("digits", lambda p: p.tobytes()),
        ("constant", lambda p: 0),
        ("raises", fails),
    ):
        plain = springs(rng, False)
        yield from faulted(with_sets(plain, sets), rng, RIGHT | KINK, f"-{name}")


@family(KIND)
def sets_that_cross_a_kink(rng: Rng) -> Iterator[Box]:
    """The active set is constant and J has a corner all the same."""
    n = int(rng.integers(2, 12))
    p = rng.uniform(0.5, 1.5, n)
    edge = p[0]

    def g(q: Array) -> Array:
        out = 2 * q
        out[0] += q[0] > edge
        return out

    model = Model(lambda q: q @ q + (q[0] - edge) * (q[0].real > edge), g, p, {"active_set": lambda q: "stuck"})
    yield right(model, KINK, kinked=True)
    yield wrong(model, sign(model, rng), WRONG | KINK | OPEN, "combined", kinked=True)
