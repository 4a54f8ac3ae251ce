"""Objectives that remember: branches that are kept, warm starts, counters."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.boxes.bases import base, cubic
from benchmarks.boxes.box import KINK, LOOSE, NOISE, OPEN, RIGHT, STATE, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import factor, sign
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "objectives with a state"
UNSTEADY = WRONG | STATE


class Branches:
    """u^3 - 3 u = c.p: a root is kept until its branch ends at a fold, as a warm-started Newton method does."""

    def __init__(self, c: Array, target: float) -> None:
        self.c, self.target, self.upper = c, target, True

    def u(self, p: Array) -> float:
        s = float(self.c @ p)
        self.upper = s >= -2.0 if self.upper else s > 2.0
        u = np.roots([1.0, 0.0, -3.0, -s])
        u = np.sort(u[np.abs(u.imag) < 1e-7].real)
        return float(u[-1] if self.upper else u[0])

    def objective(self, p: Array) -> float:
        return 0.5 * (self.u(p) - self.target) ** 2

    def gradient(self, p: Array) -> Array:
        u = self.u(p)
        return (u - self.target) / (3.0 * u**2 - 3.0) * self.c


@family(KIND)
def keeps_its_branch(rng: Rng) -> Iterator[Box]:
    """On the upper branch, near its end: natural steps leave it and never come back."""
    for k in range(3):
        c = rng.uniform(0.5, 1.5, int(rng.integers(2, 12)))
        p = np.full(len(c), -rng.uniform(1.88, 1.96) / c.sum())
        kept = Branches(c, rng.uniform(-0.5, 0.5))
        about = {"start": p, "truth": "right", "expect": STATE | OPEN, "wrong": frozenset()}
        yield Box(f"right-{k + 1}", objective=kept.objective, gradient=kept.gradient, **about)
    kept = Branches(c, 0.3)
    flipped = Box("sign", p, kept.objective, lambda q: -kept.gradient(q), "combined", UNSTEADY | OPEN)
    yield flipped


class Warm:
    """x^3 + x = p by Newton's method from the last x, to a tolerance: J depends a little on the calls before."""

    def __init__(self, p: Array, tol: float) -> None:
        self.x, self.tol = np.ones_like(p), tol

    def objective(self, p: Array) -> float:
        x = self.x
        while np.abs(x**3 + x - p).max() > self.tol:
            x = x - (x**3 + x - p) / (3 * x * x + 1)
        self.x = x
        return float(np.sum(np.sin(x)))


@family(KIND)
def warm_started(rng: Rng) -> Iterator[Box]:
    for tol in (1e-3, 1e-6, 1e-10):
        model = cubic(rng)
        loose = RIGHT | NOISE | OPEN | LOOSE | STATE
        yield right(model, loose, f"right-{tol:g}", objective=Warm(model.p, tol).objective)
        fault = sign(model, rng)
        more = {"objective": Warm(model.p, tol).objective, "name": f"sign-{tol:g}"}
        yield wrong(model, fault, UNSTEADY | (OPEN | NOISE if tol > 1e-4 else frozenset()), "combined", **more)


@family(KIND)
def drifts(rng: Rng) -> Iterator[Box]:
    """Every call of the objective adds to it, as a clock or a counter does."""
    for size in (1e-3, 1e-7):
        for fault in (None, sign, factor):
            model, count = base(rng), [0]

            def J(p: Array, model: Model = model, size: float = size, count: list[int] = count) -> float:
                count[0] += 1
                return float(model.J(p)) + size * count[0]

            if fault is None:
                yield right(
                    model, NOISE | STATE | OPEN | (RIGHT if size < 1e-5 else KINK), f"right-{size:g}", objective=J
                )
            else:
                made, unclear = fault(model, rng), UNSTEADY | OPEN | NOISE
                more = {"objective": J, "name": f"{made.name}-{size:g}"}
                yield wrong(model, made, unclear if size > 1e-5 else UNSTEADY, "combined", **more)
