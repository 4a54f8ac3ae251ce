"""Noise on J: random at every call, or a deterministic hash of p."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.bases import base, separable
from benchmarks.boxes.box import KINK, NOISE, OPEN, RIGHT, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import component, factor, one_scaled, scaled, sign, weighty, zero
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "noise"
Noise = Callable[[Array], float]


def of_calls(rng: Rng) -> Noise:
    """Another number at every call."""
    dice = np.random.default_rng(int(rng.integers(2**32)))
    return lambda p: float(dice.standard_normal())


def of_bits(rng: Rng) -> Noise:
    """A number of unit variance that is drawn by the bits of p."""
    c = rng.uniform(1e8, 9e8)

    def noise(p: Array) -> float:
        return float(np.sqrt(12) * (np.mod(np.sum(np.sin(c * p)) * 43758.5453, 1.0) - 0.5))

    return noise


def with_noise(model: Model, noise: Noise, size: float) -> Callable[[Array], float]:
    return lambda p: float(model.J(p)) + size * noise(p)


def relative_to_J(model: Model, size: float) -> float:
    """So large a part of what J changes by, at natural steps."""
    return size * float(np.linalg.norm(model.g(model.p) * model.p))


def boxes(rng: Rng, source: Callable[[Rng], Noise], size: float, also: frozenset[str]) -> Iterator[Box]:
    """Sound gradients, and errors that stand above the noise."""
    ok = RIGHT | NOISE | also | (OPEN if size >= 1e-4 else frozenset())
    for k in range(2):
        model = base(rng)
        s = relative_to_J(model, size)
        yield right(model, ok, f"right-{k + 1}", objective=with_noise(model, source(rng), s))
    for fault in (sign, zero, factor, component):
        model = base(rng)
        s, made = relative_to_J(model, size), fault(model, rng)
        unclear = frozenset() if size < 1e-5 else NOISE | OPEN
        J = with_noise(model, source(rng), s)
        yield wrong(model, made, WRONG | unclear, "combined", objective=J, name=made.name)


@family(KIND)
def random_1e_12(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_calls, 1e-12, frozenset())


@family(KIND)
def random_1e_8(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_calls, 1e-8, frozenset())


@family(KIND)
def random_1e_4(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_calls, 1e-4, frozenset())


@family(KIND)
def random_1e_2(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_calls, 1e-2, frozenset())


@family(KIND)
def hashed_1e_12(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_bits, 1e-12, frozenset())


@family(KIND)
def hashed_1e_8(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_bits, 1e-8, frozenset())


@family(KIND)
def hashed_1e_4(rng: Rng) -> Iterator[Box]:
    return boxes(rng, of_bits, 1e-4, KINK)


@family(KIND)
def hidden_below_noise(rng: Rng) -> Iterator[Box]:
    """Errors of 1 % to 5 % that noise of 1 % to 10 % hides, or almost."""
    for source in (of_calls, of_bits):
        for size in (1e-2, 1e-1):
            model = separable(rng)
            name = f"{source.__name__}-{size:g}".replace("_", "-")
            made = scaled(model, 1 + float(rng.choice([0.02, 0.05])), f"factor-{name}")
            J = with_noise(model, source(rng), relative_to_J(model, size))
            yield wrong(model, made, WRONG | NOISE | OPEN, "combined", objective=J)
            one = one_scaled(model, weighty(model, rng), 1.2, f"component-{name}")
            yield wrong(model, one, WRONG | NOISE | OPEN, "combined", objective=J)


@family(KIND)
def smooth_ripple(rng: Rng) -> Iterator[Box]:
    """A fine ripple that belongs to J, though nobody means it: its slope is part of dJ/dp."""
    model = separable(rng)

    def J(p: Array) -> Array:
        return model.J(p) + 1e-7 * np.sum(np.sin(1e3 * p))

    rippled = Model(J, lambda p: model.g(p) + 1e-4 * np.cos(1e3 * p), model.p)
    yield right(rippled)
    yield wrong(rippled, sign(rippled, rng))


@family(KIND)
def multiplied(rng: Rng) -> Iterator[Box]:
    """Noise in proportion to J, as of a solver's relative tolerance."""
    for size in (1e-10, 1e-6):
        model, noise = base(rng), of_calls(rng)
        J = lambda p, m=model, n=noise, s=size: float(m.J(p)) * (1 + s * n(p))  # noqa: E731
        yield right(model, RIGHT | NOISE | OPEN, f"right-{size:g}", objective=J)
        made = sign(model, rng)
        yield wrong(model, made, WRONG | NOISE, "combined", objective=J, name=f"sign-{size:g}")
