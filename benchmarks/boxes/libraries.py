"""What solvers and libraries get wrong: loops, indices, branches and tolerances of the adjoint."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.box import OPEN, WRONG, Box, Faulty, Model, family, right, wrong
from benchmarks.boxes.physics import laplacian
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "libraries"


def recursion(rng: Rng, m: int) -> tuple[Callable[[Array], Array], Callable[[Array, int, int], Array], Array]:
    """x_k = x_(k-1) + dt (sin(x_(k-1)) + p_1 - p_2 x_(k-1)), J = x_m^2; the adjoint of its last `last` steps, which
    takes x from `shift` steps later.
    """
    dt = 2.0 / m

    def path(p: Array) -> list[Array]:
        x = [0.3 + 0 * p[0]]
        for _ in range(m):
            x.append(x[-1] + dt * (np.sin(x[-1]) + p[0] - p[1] * x[-1]))
        return x

    def g(p: Array, last: int, shift: int) -> Array:
        x, out = path(p), np.zeros(2)
        lam = 2 * x[-1]
        for k in range(m - 1, m - 1 - last, -1):
            y = x[min(k + shift, m)]
            out += lam * dt * np.array([1.0, -y])
            lam = lam * (1 + dt * (np.cos(y) - p[1]))
        return out

    return lambda p: path(p)[-1] ** 2, g, rng.uniform(0.5, 1.5, 2)


@family(KIND)
def truncated_in_time(rng: Rng) -> Iterator[Box]:
    """The adjoint stops after a third of the steps."""
    J, g, p = recursion(rng, 30)
    model = Model(J, lambda q: g(q, 30, 0), p)
    yield right(model)
    yield wrong(model, Faulty("mistaken", lambda q: g(q, 10, 0)))


@family(KIND)
def one_trip_less(rng: Rng) -> Iterator[Box]:
    """A loop of 17 trips whose adjoint runs 16."""
    J, g, p = recursion(rng, 17)
    model = Model(J, lambda q: g(q, 17, 0), p)
    yield right(model)
    yield wrong(model, Faulty("sixteen", lambda q: g(q, 16, 0)), WRONG | OPEN, error=1e-4)


@family(KIND)
def index_past_the_end(rng: Rng) -> Iterator[Box]:
    """A difference at the last node takes the last value again; its derivative falls out of the array."""
    n = int(rng.integers(4, 30))
    p = rng.uniform(0.5, 1.5, n)
    after = np.minimum(np.arange(n) + 1, n - 1)

    def slopes(q: Array, kept: Array) -> Array:
        d = np.cos(q) * q[after]
        out = d.copy()
        np.add.at(out, after[kept], np.sin(q)[kept])
        return out

    model = Model(lambda q: np.sum(np.sin(q) * q[after]), lambda q: slopes(q, np.arange(n)), p)
    yield right(model)
    yield wrong(model, Faulty("dropped", lambda q: slopes(q, np.arange(n - 1)), frozenset({n - 1})))


@family(KIND)
def flat_element(rng: Rng) -> Iterator[Box]:
    """Volumes of tetrahedra whose derivative divides by a determinant, and is left out where that is small."""
    n = int(rng.integers(2, 8))
    E = rng.standard_normal((n, 3, 3))
    k = int(rng.integers(n))
    E[k, 2] = E[k, 0] + E[k, 1] + 0.02 * E[k, 2]
    p = rng.uniform(0.8, 1.2, 3 * n)

    def edges(q: Array) -> Array:
        return E * q.reshape(n, 3, 1)

    def g(q: Array, least: float) -> Array:
        F = edges(q)
        det = np.linalg.det(F)
        slope = np.cos(3 * det) * 3 * det
        return np.where((np.abs(det) > least)[:, None], slope[:, None] / q.reshape(n, 3), 0.0).ravel()

    size = float(np.abs(np.linalg.det(edges(p))[k]))
    model = Model(lambda q: np.sum(np.sin(3 * np.linalg.det(edges(q)))), lambda q: g(q, 0.0), p)
    yield right(model)
    few = WRONG | OPEN if size < 1e-2 else WRONG
    yield wrong(model, Faulty("left-out", lambda q: g(q, 1.5 * size)), few, error=1e-4)


@family(KIND)
def loose_adjoint(rng: Rng) -> Iterator[Box]:
    """J is solved exactly, its adjoint by sweeps, to an absolute tolerance: it may not even begin."""
    n = int(rng.integers(4, 20))
    A, b, data = laplacian(n) + 0.5 * np.eye(n), rng.uniform(0.5, 1.5, n), rng.standard_normal(n)
    p = rng.uniform(0.5, 1.5, n)

    def r(q: Array) -> Array:
        return np.linalg.solve(A + np.diag(q), b) - data

    def g(q: Array, tol: float, size: float) -> Array:
        K, lam = A + np.diag(q), np.zeros(n)
        for _ in range(500):
            rest = size * r(q) - K @ lam
            if np.abs(rest).max() <= tol:
                break
            lam = lam + rest / np.diag(K)
        return -lam * (r(q) + data)

    for name, size, tol, expect in (
        ("not-begun", 1e-7, 1e-6, WRONG),
        ("stopped-early", 1.0, 1e-2, WRONG | OPEN),
        ("stopped-late", 1.0, 1e-4, WRONG | OPEN),
    ):
        model = Model(lambda q, s=size: 0.5 * s * np.sum(r(q) ** 2), lambda q, s=size: g(q, 0.0, s), p)
        yield right(model, name=f"right-{name}")
        yield wrong(model, Faulty(name, lambda q, s=size, t=tol: g(q, t, s)), expect, error=1e-6)


@family(KIND)
def adjoint_of_another_scheme(rng: Rng) -> Iterator[Box]:
    """Optimize then discretize: the adjoint takes the state one step late, an error of order dt."""
    for m, expect in ((8, WRONG | OPEN), (40, WRONG | OPEN)):
        J, g, p = recursion(rng, m)
        model = Model(J, lambda q, g=g, m=m: g(q, m, 0), p)
        yield right(model, name=f"right-{m}")
        yield wrong(model, Faulty(f"late-{m}", lambda q, g=g, m=m: g(q, m, 1)), expect, error=1e-4)
