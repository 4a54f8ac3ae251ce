"""Smooth, cheap models on which kinks, noise and states are put."""

from __future__ import annotations

import numpy as np

from benchmarks.boxes.box import Model
from benchmarks.boxes.fits import exponential_fit, logistic_regression, poisson_regression, tanh_network, trigonometric
from benchmarks.boxes.physics import laplacian, steady_heat
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
BASES = (trigonometric, logistic_regression, poisson_regression, tanh_network, exponential_fit, steady_heat)


def base(rng: Rng) -> Model:
    """Any of them."""
    return BASES[int(rng.integers(len(BASES)))](rng)


def separable(rng: Rng, n: int = 0) -> Model:
    """J = sum c_i sin p_i + p_i^2, of n parameters or 2 to 12."""
    n = n or int(rng.integers(2, 13))
    c = rng.uniform(0.5, 1.5, n)
    return Model(lambda p: np.sum(c * np.sin(p) + p * p), lambda p: c * np.cos(p) + 2 * p, rng.uniform(0.3, 1.2, n))


def cubic(rng: Rng) -> Model:
    """J = sum sin x, x^3 + x = p solved until Newton's method stands still."""

    def x(p: Array) -> Array:
        x = 1.0 + 0 * p
        for _ in range(60):
            x = x - (x**3 + x - p) / (3 * x * x + 1)
        return x

    def g(p: Array) -> Array:
        return np.cos(x(p)) / (3 * x(p) ** 2 + 1)

    return Model(lambda p: np.sum(np.sin(x(p))), g, rng.uniform(2.0, 9.0, int(rng.integers(1, 12))))


def elliptic(rng: Rng, n: int = 20) -> tuple[Model, Array, Array]:
    """A(p) u = b with A = tridiagonal + diag(exp p), and 1/2 |u - data|^2; the model, b and data."""
    b, data, p = rng.standard_normal((3, n))

    def J(p: Array) -> Array:
        return 0.5 * np.sum((np.linalg.solve(stiffness(p), b) - data) ** 2)

    def g(p: Array) -> Array:
        u = np.linalg.solve(stiffness(p), b)
        return np.linalg.solve(stiffness(p), data - u) * np.exp(p) * u

    return Model(J, g, 0.5 * p), b, data


def stiffness(p: Array) -> Array:
    return laplacian(len(p)) + 0.2 * np.eye(len(p)) + np.diag(np.exp(p))
