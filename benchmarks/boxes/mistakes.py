"""Smooth mistakes in derivations: a term, a factor, a transpose, a chain rule; large ones and small ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.boxes.bases import base, separable
from benchmarks.boxes.box import OPEN, WRONG, Box, Faulty, Model, family, right, wrong
from benchmarks.boxes.fits import kl_divergence
from benchmarks.boxes.physics import conduction, laplacian, steady_heat
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "smooth mistakes"


def mistaken(
    J: Callable[[Array], Any], g: Callable[[Array], Array], bad: Callable[[Array], Array], p: Array
) -> Iterator[Box]:
    """The right gradient and the mistaken one."""
    model = Model(J, g, p)
    yield right(model)
    yield wrong(model, Faulty("mistaken", bad))


@family(KIND)
def missing_term(rng: Rng) -> Iterator[Box]:
    """J depends on p through u and directly; dJ/dp at fixed u is dropped."""
    heat = steady_heat(rng)
    c = 2.0 * float(np.linalg.norm(heat.g(heat.p)))
    yield from mistaken(
        lambda p: heat.J(p) + c * np.sum(np.cos(p)), lambda p: heat.g(p) - c * np.sin(p), heat.g, heat.p
    )


@family(KIND)
def missing_regularization(rng: Rng) -> Iterator[Box]:
    """From large to 0.3 %, where one point more does not tell it from a loose solve."""
    for size, expect in ((1.0, WRONG), (0.1, WRONG), (0.003, WRONG | OPEN)):
        fit = base(rng)
        lam = size * float(np.linalg.norm(fit.g(fit.p)) / np.linalg.norm(fit.p))
        model = Model(
            lambda p, m=fit, lam=lam: m.J(p) + 0.5 * lam * p @ p, lambda p, m=fit, lam=lam: m.g(p) + lam * p, fit.p
        )
        yield right(model, name=f"right-{size:g}")
        yield wrong(model, Faulty(f"mistaken-{size:g}", fit.g), expect, error=1e-3)


@family(KIND)
def sign_of_regularization(rng: Rng) -> Iterator[Box]:
    fit = base(rng)
    lam = 0.5 * float(np.linalg.norm(fit.g(fit.p)) / np.linalg.norm(fit.p))
    yield from mistaken(
        lambda p: fit.J(p) + 0.5 * lam * p @ p, lambda p: fit.g(p) + lam * p, lambda p: fit.g(p) - lam * p, fit.p
    )


@family(KIND)
def another_functional(rng: Rng) -> Iterator[Box]:
    """J is a sum over nodes; the gradient is that of the integral by Simpson's rule."""
    n = 2 * int(rng.integers(2, 15)) + 1
    w = np.where(np.arange(n) % 2, 4.0, 2.0) / 3.0
    w[[0, -1]] = 1 / 3
    data = rng.uniform(1.0, 2.0, n)
    p = rng.uniform(0.2, 0.9, n)
    yield from mistaken(
        lambda q: np.sum((np.sin(q) - data) ** 2),
        lambda q: 2 * (np.sin(q) - data) * np.cos(q),
        lambda q: 2 * w * (np.sin(q) - data) * np.cos(q),
        p,
    )


@family(KIND)
def weights_forgotten(rng: Rng) -> Iterator[Box]:
    """Of a quadrature: Gauss points of an interval."""
    n = int(rng.integers(3, 12))
    x, w = np.polynomial.legendre.leggauss(n)
    V = np.vander(x, n)
    p, data = rng.uniform(0.5, 1.5, n), np.exp(x)
    yield from mistaken(
        lambda q: 0.5 * np.sum(w * (V @ q - data) ** 2),
        lambda q: V.T @ (w * (V @ q - data)),
        lambda q: V.T @ (V @ q - data),
        p,
    )


@family(KIND)
def covariance_forgotten(rng: Rng) -> Iterator[Box]:
    n = int(rng.integers(2, 20))
    A, b, c = rng.standard_normal((30, n)), rng.standard_normal(30), 10.0 ** rng.uniform(-1, 1, 30)
    yield from mistaken(
        lambda p: 0.5 * (c * (A @ p - b)) @ (A @ p - b),
        lambda p: A.T @ (c * (A @ p - b)),
        lambda p: A.T @ (A @ p - b),
        rng.uniform(1, 3, n),
    )


@family(KIND)
def half_forgotten(rng: Rng) -> Iterator[Box]:
    """J = 1/2 |r|^2 + penalty, the misfit's gradient doubled."""
    fit, c = base(rng), rng.uniform(0.5, 1.0)
    size = float(np.linalg.norm(fit.g(fit.p)))
    yield from mistaken(
        lambda p: fit.J(p) + c * size * np.sum(np.sin(p)),
        lambda p: fit.g(p) + c * size * np.cos(p),
        lambda p: 2 * fit.g(p) + c * size * np.cos(p),
        fit.p,
    )


@family(KIND)
def chain_rule_of_the_logarithm(rng: Rng) -> Iterator[Box]:
    """p = log k, and dJ/dk is returned: alike only where k = 1."""
    heat = steady_heat(rng)
    yield right(heat)
    yield wrong(heat, Faulty("mistaken", lambda p: heat.g(p) * np.exp(-p)))


@family(KIND)
def transpose_forgotten(rng: Rng) -> Iterator[Box]:
    n = int(rng.integers(4, 30))
    A = 0.3 * laplacian(n) + np.eye(n) - np.eye(n, k=-1)
    data, p = rng.standard_normal(n), rng.uniform(0.5, 1.5, n)

    def r(q: Array) -> Array:
        return np.linalg.solve(A, q * q) - data

    yield from mistaken(
        lambda q: 0.5 * np.sum(r(q) ** 2),
        lambda q: 2 * q * np.linalg.solve(A.T, r(q)),
        lambda q: 2 * q * np.linalg.solve(A, r(q)),
        p,
    )


@family(KIND)
def unsymmetric_form(rng: Rng) -> Iterator[Box]:
    """d(p.Q p) is (Q + Q^T) p, not 2 Q p."""
    n = int(rng.integers(2, 41))
    Q = rng.standard_normal((n, n))
    yield from mistaken(lambda p: p @ (Q @ p), lambda p: (Q + Q.T) @ p, lambda p: 2 * Q @ p, rng.uniform(0.5, 1.5, n))


@family(KIND)
def softmax_in_part(rng: Rng) -> Iterator[Box]:
    """The normalization is taken for a constant."""
    model = kl_divergence(rng)

    def bad(p: Array) -> Array:
        s = np.exp(p) / np.exp(p).sum()
        return model.g(p) + 0.5 * s

    yield right(model)
    yield wrong(model, Faulty("mistaken", bad))


@family(KIND)
def detached(rng: Rng) -> Iterator[Box]:
    """J of p over its mean, whose slope is cut off."""
    n = int(rng.integers(3, 25))
    c, p = rng.uniform(0.5, 1.5, n), rng.uniform(0.5, 1.5, n)

    def part(q: Array) -> Array:
        return c * np.cos(q / q.mean()) / q.mean()

    yield from mistaken(lambda q: c @ np.sin(q / q.mean()), lambda q: part(q) - part(q) @ q / q.mean() / n, part, p)


@family(KIND)
def picard_adjoint(rng: Rng) -> Iterator[Box]:
    """(A + diag(u^2)) u = p, its adjoint with the coefficient u^2 frozen."""
    n = int(rng.integers(2, 15))
    A, data, p = laplacian(n), rng.standard_normal(n), rng.uniform(0.5, 2.0, n)

    def u(q: Array) -> Array:
        x = 0.5 * q
        for _ in range(25):
            x = x - np.linalg.solve(A + np.diag(3 * x * x), A @ x + x**3 - q)
        return x

    yield from mistaken(
        lambda q: 0.5 * np.sum((u(q) - data) ** 2),
        lambda q: np.linalg.solve(A + np.diag(3 * u(q) ** 2), u(q) - data),
        lambda q: np.linalg.solve(A + np.diag(u(q) ** 2), u(q) - data),
        p,
    )


@family(KIND)
def load_that_follows(rng: Rng) -> Iterator[Box]:
    """f depends on p; only the stiffness is differentiated."""
    n = int(rng.integers(3, 20))
    B = rng.uniform(0.2, 1.0, (n - 1, n))
    p = rng.uniform(0.5, 1.5, n)

    def stiff(q: Array) -> Array:
        u = np.linalg.solve(conduction(q), B @ q)
        return -(np.diff(u, prepend=0, append=0) ** 2)

    def g(q: Array) -> Array:
        return stiff(q) + 2 * B.T @ np.linalg.solve(conduction(q), B @ q)

    yield from mistaken(lambda q: (B @ q) @ np.linalg.solve(conduction(q), B @ q), g, stiff, p)


@family(KIND)
def off_by_one(rng: Rng) -> Iterator[Box]:
    """Every component at its neighbour's place."""
    n = int(rng.integers(3, 41))
    c = np.linspace(0.5, 3.0, n) * rng.uniform(0.8, 1.25, n)
    yield from mistaken(
        lambda p: np.sum(np.exp(c * p)),
        lambda p: c * np.exp(c * p),
        lambda p: np.roll(c * np.exp(c * p), 1),
        rng.uniform(0.2, 0.9, n),
    )


@family(KIND)
def degrees(rng: Rng) -> Iterator[Box]:
    n = int(rng.integers(1, 20))
    d = np.pi / 180
    yield from mistaken(
        lambda p: np.sum(np.sin(d * p)), lambda p: d * np.cos(d * p), lambda p: np.cos(d * p), rng.uniform(10, 80, n)
    )


@family(KIND)
def units_of_a_group(rng: Rng) -> Iterator[Box]:
    """A third of the components is in other units."""
    model = separable(rng, 3 * int(rng.integers(1, 10)))
    group = np.arange(len(model.p)) % 3 == 0
    fault = Faulty(
        "mistaken", lambda p: np.where(group, 1e-3, 1.0) * model.g(p), frozenset(np.flatnonzero(group).tolist())
    )
    yield wrong(model, fault)


@family(KIND)
def made_for_an_optimizer(rng: Rng) -> Iterator[Box]:
    """Clipped, normalized, or preconditioned."""
    changes: dict[str, Callable[[Array, Array, float], Array]] = {
        "clipped": lambda g, p, size: g * min(1.0, 0.5 * size / float(np.linalg.norm(g))),
        "normalized": lambda g, p, size: 0.3 * size * g / np.linalg.norm(g),
        "preconditioned": lambda g, p, size: g / (1 + p * p),
    }
    for name, change in changes.items():
        model = separable(rng)
        size = float(np.linalg.norm(model.g(model.p)))
        yield wrong(model, Faulty(name, lambda p, m=model, c=change, s=size: c(m.g(p), p, s)))
