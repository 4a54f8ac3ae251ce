"""Errors of every size: of a factor, a component, an offset, digits, finite differences; and generic ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.bases import base, separable
from benchmarks.boxes.box import OPEN, RIGHT, WRONG, Box, Expect, Faulty, Model, family, right, wrong
from benchmarks.boxes.faults import natural, one_scaled, scaled, weighty
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "errors of every size"


def tiny(name: str, make: Callable[[Model, Rng, float], Faulty], sizes: tuple[float, ...], expect: Expect) -> None:
    """A family of errors that are small, of several sizes."""

    def boxes(rng: Rng) -> Iterator[Box]:
        for size in sizes:
            model = base(rng)
            while len(model.p) < 6:
                model = base(rng)
            fault = make(model, rng, size)
            gross = frozenset() if size >= 0.1 else expect
            yield wrong(model, fault, WRONG | gross, name=f"{fault.name}-{size:g}", error=0.1 * size)

    family(KIND)(_named(boxes, name))


def _named(boxes: Callable[[Rng], Iterator[Box]], name: str) -> Callable[[Rng], Iterator[Box]]:
    boxes.__name__ = name
    return boxes


def offset_by(model: Model, rng: Rng, size: float) -> Faulty:
    w = natural(model)
    c = size * float(np.linalg.norm(model.g(model.p) * w)) / np.sqrt(len(w)) / w
    return Faulty("offset", lambda p: model.g(p) + c)


def wavy(model: Model, rng: Rng, size: float) -> Faulty:
    a, b = rng.uniform(1.0, 3.0, (2, len(model.p)))
    return Faulty("wavy", lambda p: model.g(p) * (1 + size * np.sin(a * p + b)))


def half_of_them(model: Model, rng: Rng, size: float) -> Faulty:
    group = np.arange(len(model.p)) % 2 == 0
    wrong_ones = frozenset(np.flatnonzero(group).tolist())
    return Faulty("group", lambda p: np.where(group, 1 + size, 1.0) * model.g(p), wrong_ones)


EXACT = frozenset[str]()  # nothing but wrong-gradient is right
tiny("common_factor", lambda m, rng, s: scaled(m, 1 + s, "factor"), (1e-4, 1e-3, 1e-2, 0.1), EXACT)
tiny("one_component", lambda m, rng, s: one_scaled(m, weighty(m, rng), 1 + s, "component"), (1e-3, 1e-2, 0.1), EXACT)
tiny("constant_offset", offset_by, (1e-3, 1e-2, 0.1), EXACT)
tiny("every_second_component", half_of_them, (1e-3, 1e-2, 0.1), EXACT)
tiny("generic_error", wavy, (1e-4, 1e-3, 1e-2, 0.2), OPEN)


@family(KIND)
def few_digits(rng: Rng) -> Iterator[Box]:
    """The gradient in float32 is right to its precision; rounded to two digits it is not."""
    for k in range(2):
        model = base(rng)
        single = lambda p, m=model: m.g(p).astype("f4")  # noqa: E731
        yield right(model, name=f"right-{k + 1}", gradient=single, error=1e-6)
    model = base(rng)
    yield wrong(model, Faulty("sign", lambda p, m=model: -m.g(p).astype("f4")))
    model = separable(rng)
    yield wrong(model, Faulty("two-digits", lambda p, m=model: np.round(m.g(p), 1)), WRONG | OPEN, error=1e-3)


@family(KIND)
def differences(rng: Rng) -> Iterator[Box]:
    """Gradients by finite differences: central ones are right, one-sided ones of a large step are not."""

    def by_differences(model: Model, h: float, central: bool) -> Callable[[Array], Array]:
        def g(p: Array) -> Array:
            E = h * np.eye(len(p))
            back = np.array([model.J(p - e) for e in E]) if central else model.J(p)
            return (np.array([model.J(p + e) for e in E]) - back) / (h * (1 + central))

        return g

    model = separable(rng)
    yield right(model, RIGHT, gradient=by_differences(model, 1e-5, True), error=1e-8)
    yield wrong(model, Faulty("one-sided-0.01", by_differences(model, 1e-2, False)), WRONG | OPEN, error=1e-4)
    yield wrong(model, Faulty("one-sided-0.5", by_differences(model, 0.5, False)), WRONG | OPEN, error=1e-2)
