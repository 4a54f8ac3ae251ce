"""Objectives whose solver stops early, with exact gradients or wrong ones; with `tighten`, without, and in vain."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.bases import cubic, elliptic, stiffness
from benchmarks.boxes.box import LOOSE, NOISE, OPEN, RIGHT, WRONG, Box, Expect, Faulty, Model, add
from benchmarks.boxes.box import right as right_box
from benchmarks.boxes.box import wrong as wrong_box
from benchmarks.boxes.faults import one_scaled, scaled, weighty
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "loose solves"
Objective = Callable[[Array], float]
MOST = 10_000  # iterations


def newton_tol(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    model, tol = cubic(rng), 10.0 ** rng.uniform(-3, -0.7)

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            x = np.ones_like(p)
            for _ in range(MOST):
                r = x**3 + x - p
                if np.abs(r).max() <= max(tol * k, 1e-14 * np.abs(p).max()):
                    break
                x = x - r / (3 * x * x + 1)
            return float(np.sin(x).sum())

        return J

    return model, loosely


def newton_fixed(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    """A fixed number of iterations, one more for each decade of k."""
    model, count = cubic(rng), int(rng.integers(4, 6))

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            x = np.ones_like(p)
            for _ in range(count + int(0.1 - np.log10(k))):
                x = x - (x**3 + x - p) / (3 * x * x + 1)
            return float(np.sin(x).sum())

        return J

    return model, loosely


def iterated(rng: Rng, tol: float, sweep: Callable[[Array], Array]) -> tuple[Model, Callable[[float], Objective]]:
    """Sweeps u <- u + M^-1 (b - A u) until the residual has fallen by tol; sweep(A) gives M^-1."""
    model, b, data = elliptic(rng, 12)

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            A, u = stiffness(p), 0 * b
            M = sweep(A)
            for _ in range(MOST):
                r = b - A @ u
                if r @ r <= (tol * k) ** 2 * (b @ b) or np.abs(r).max() < 1e-15 * np.abs(b).max():
                    break
                u = u + M @ r
            return float(0.5 * np.sum((u - data) ** 2))

        return J

    return model, loosely


def jacobi(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    return iterated(rng, 10.0 ** rng.uniform(-4, -2), lambda A: np.diag(1 / np.diag(A)))


def gauss_seidel(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    return iterated(rng, 10.0 ** rng.uniform(-5, -2), lambda A: np.linalg.inv(np.tril(A)))


def jacobi_fixed(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    """Unrolled: 8 sweeps, 16 more for each decade of k; J is smooth."""
    model, b, data = elliptic(rng, 12)

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            A, u = stiffness(p), 0 * b
            d = 1 / np.diag(A)
            for _ in range(8 + int(16.0 * -np.log10(k))):
                u = u + d * (b - A @ u)
            return float(0.5 * np.sum((u - data) ** 2))

        return J

    return model, loosely


def gradients(rng: Rng, tol: float) -> tuple[Model, Callable[[float], Objective]]:
    """Conjugate gradients."""
    model, b, data = elliptic(rng)

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            A, u, r = stiffness(p), 0 * b, b.copy()
            q, rr = r.copy(), b @ b
            stop = max((tol * k) ** 2, 1e-30) * rr
            for _ in range(200):
                if rr <= stop:
                    break
                w = A @ q
                a = rr / (q @ w)
                u, r = u + a * q, r - a * w
                q, rr = r + (r @ r) / rr * q, r @ r
            return float(0.5 * np.sum((u - data) ** 2))

        return J

    return model, loosely


def cg_loose(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    return gradients(rng, 1e-3)


def cg_fair(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    return gradients(rng, 1e-5)


def cg_tight(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    return gradients(rng, 1e-7)


def fixed_point(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    """x = cos(x) p / 2, iterated until it stands still within a tolerance."""
    n, tol = int(rng.integers(1, 12)), 10.0 ** rng.uniform(-5, -2)

    def exact(p: Array) -> Array:
        x = 0.4 * p
        for _ in range(30):
            x = x - (x - 0.5 * p * np.cos(x)) / (1 + 0.5 * p * np.sin(x))
        return x

    def g(p: Array) -> Array:
        x = exact(p)
        return 2 * x * 0.5 * np.cos(x) / (1 + 0.5 * p * np.sin(x))

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            x = 0 * p
            for _ in range(MOST):
                new = 0.5 * p * np.cos(x)
                moved, x = np.abs(new - x).max(), new
                if moved <= max(tol * k, 1e-16):
                    break
            return float(x @ x)

        return J

    return Model(lambda p: np.sum(exact(p) ** 2), g, rng.uniform(0.5, 1.5, n)), loosely


def bisection(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    """Roots of x^3 + x = p halved until the interval is short: a staircase whose treads shrink with k."""
    model, tol = cubic(rng), 10.0 ** rng.uniform(-9, -7)

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            low, high = np.zeros(len(p)), np.full(len(p), 4.0)
            for _ in range(min(54, int(np.ceil(np.log2(4.0 / (tol * k)))))):
                middle = 0.5 * (low + high)
                below = middle**3 + middle < p
                low, high = np.where(below, middle, low), np.where(below, high, middle)
            return float(np.sin(0.5 * (low + high)).sum())

        return J

    return model, loosely


def adaptive(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    """x' = -p x, x(0) = 1, by a Taylor method of order 4 with steps chosen for a tolerance; J = sum of x(1)^2."""
    n, tol = int(rng.integers(1, 5)), 10.0 ** rng.uniform(-4, -2)

    def loosely(k: float) -> Objective:
        def J(p: Array) -> float:
            t, dt, x = 0.0, 0.5, np.ones(len(p))
            while t < 1.0:
                dt = min(dt, 1.0 - t)
                z = -p * dt
                off = float(np.abs(x * z**5).max()) / 120.0 / max(tol * k, 1e-12)
                if off <= 1.0:
                    t, x = t + dt, x * (1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4))))
                dt *= min(2.0, max(0.3, 0.9 * (off + 1e-12) ** -0.2))
            return float(x @ x)

        return J

    return Model(lambda p: np.sum(np.exp(-2 * p)), lambda p: -2 * np.exp(-2 * p), rng.uniform(0.5, 3.0, n)), loosely


def euler(rng: Rng) -> tuple[Model, Callable[[float], Objective]]:
    """The same by the implicit midpoint rule, 40 fixed steps, 10 times as many for a decade of k; J is smooth."""
    n = int(rng.integers(1, 12))

    def loosely(k: float) -> Objective:
        m = 40.0 * k ** (-0.5)
        return lambda p: float(np.sum(((1 - 0.5 * p / m) / (1 + 0.5 * p / m)) ** (2 * m)))

    return Model(lambda p: np.sum(np.exp(-2 * p)), lambda p: -2 * np.exp(-2 * p), rng.uniform(0.5, 3.0, n)), loosely


SOLVERS = {
    "newton-tol": newton_tol,
    "newton-fixed": newton_fixed,
    "jacobi": jacobi,
    "jacobi-fixed": jacobi_fixed,
    "gauss-seidel": gauss_seidel,
    "cg-loose": cg_loose,
    "cg-fair": cg_fair,
    "cg-tight": cg_tight,
    "fixed-point": fixed_point,
    "bisection": bisection,
    "adaptive-steps": adaptive,
    "midpoint-steps": euler,
}
ALONE = 0.3  # times its tolerance, a solver that cannot be tightened: an error of 10 % is nobody's to excuse
HONEST = RIGHT | LOOSE | NOISE  # of a sound gradient whose solver can be tightened
UNSURE = HONEST | OPEN  # where it cannot


def wrongs(model: Model, rng: Rng) -> Iterator[tuple[Faulty, bool]]:
    """Mistakes, and whether a loose solve cannot be the cause."""
    yield scaled(model, -1.0, "sign"), True
    yield scaled(model, 2.0, "doubled"), True
    yield one_scaled(model, weighty(model, rng), float(rng.choice([-1.0, 2.0])), "component"), True
    yield one_scaled(model, weighty(model, rng), 1.05, "component-5%"), False
    yield scaled(model, 1.02, "factor-2%"), False


def family_of(
    solver: Callable[[Rng], tuple[Model, Callable[[float], Objective]]], help_: str
) -> Callable[[Rng], Iterator[Box]]:
    """Boxes of a solver; help_: tighten, none, or vain (it moves nothing)."""
    given = 1.0 if help_ == "tighten" else ALONE

    def boxes(rng: Rng) -> Iterator[Box]:
        for k in range(2):
            model, loosely = solver(rng)
            box = model if help_ == "none" else _helped(model, model.g, loosely, help_)
            yield right_box(box, HONEST if help_ == "tighten" else UNSURE, f"right-{k + 1}", objective=loosely(given))
        model, loosely = solver(rng)
        for fault, gross in wrongs(model, rng):
            expect: Expect = WRONG if gross or help_ == "tighten" else WRONG | OPEN | NOISE
            box = model if help_ == "none" else _helped(model, fault.g, loosely, help_)
            alone = {} if help_ == "tighten" else {"wrong": None}  # nobody can tell that the others are right
            yield wrong_box(box, fault, expect, "combined", objective=loosely(given), **alone)

    return boxes


def _helped(model: Model, g: Callable[[Array], Array], loosely: Callable[[float], Objective], help_: str) -> Model:
    def tighten(k: float) -> tuple[Objective, Callable[[Array], Array]]:
        return loosely(k if help_ == "tighten" else ALONE), g

    return Model(model.J, model.g, model.p, {"tighten": tighten})


for name, solver in SOLVERS.items():
    add(f"{name}-with-tighten", KIND, family_of(solver, "tighten"))
    add(name, KIND, family_of(solver, "none"))
for name in ("newton-tol", "cg-loose", "midpoint-steps"):
    add(f"{name}-tightened-in-vain", KIND, family_of(SOLVERS[name], "vain"))
