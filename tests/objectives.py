"""Objectives that tests of `check` share, and gradients of them, right and wrong."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array

N = 1000
A = np.random.default_rng(0).uniform(0.5, 2.0, N)
P = np.random.default_rng(1).uniform(0.2, 1.0, N)


def J(p: Array) -> float:
    return float(np.sum(A * np.sin(p) + 0.1 * p**3))


def dJ(p: Array) -> Array:
    return A * np.cos(p) + 0.3 * p**2


def wrong(index: object, factor: float):
    """dJ, components `index` of it off by a factor."""

    def gradient(p: Array) -> Array:
        g = dJ(p)
        g[index] *= factor
        return g

    return gradient


X = np.linspace(0.1, 1.0, 10)


def sines(p: Array) -> float:
    return float(np.sin(p).sum())


def boom(p: Array) -> float:
    raise ValueError("the mesh\nis gone")


class Model:
    """An object that brings its own start and names."""

    start = np.array([0.3, 0.7])
    names = ("stiffness", "damping")

    def value_and_gradient(self, p: Array) -> tuple[float, Array]:
        return float(p[0] ** 2 * p[1]), np.array([2.0 * p[0] * p[1], p[0] ** 2])
