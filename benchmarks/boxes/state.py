"""Gradients that keep a state between calls, or change that of the objective."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.boxes.bases import base
from benchmarks.boxes.box import OPEN, STATE, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import sign
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "gradients with a state"
UNSTEADY = WRONG | STATE


def stateful(name: str, model: Model, kept: Any, **more: Any) -> Box:
    """A wrong gradient whose faults depend on the calls made before."""
    given = {"expect": UNSTEADY, "truth": "wrong", "smooth": model.J, "error": 1e-5, "options": model.options} | more
    return Box(name, model.p, kept.objective, kept.gradient, **given)


class LastCall:
    """The gradient is that of the point where the objective was called last."""

    def __init__(self, model: Model) -> None:
        self.model, self.q = model, model.p

    def objective(self, p: Array) -> float:
        self.q = p.copy()
        return float(self.model.J(p))

    def gradient(self, p: Array) -> Array:
        return self.model.g(self.q)


class LastFactor(LastCall):
    """Part of it is: the other half is computed anew."""

    def gradient(self, p: Array) -> Array:
        return 0.5 * (self.model.g(self.q) + self.model.g(p))


@family(KIND)
def last_call(rng: Rng) -> Iterator[Box]:
    for k in range(3):
        model = base(rng)
        yield stateful(f"whole-{k + 1}", model, LastCall(model))
    model = base(rng)
    yield stateful("half", model, LastFactor(model))


class Counting:
    """Call number k of the gradient at p returns altered(g, k)."""

    def __init__(self, model: Model, altered: Callable[[Array, int], Array]) -> None:
        self.model, self.altered, self.calls = model, altered, 0

    def objective(self, p: Array) -> float:
        return float(self.model.J(p))

    def gradient(self, p: Array) -> Array:
        self.calls += 1
        return self.altered(np.array(self.model.g(p)), self.calls)


@family(KIND)
def accumulates(rng: Rng) -> Iterator[Box]:
    """Nobody sets the gradient to zero before the next one is added."""
    for k in range(3):
        model, total = base(rng), [0.0]

        def altered(g: Array, calls: int, total: list[Any] = total) -> Array:
            total[0] = total[0] + g
            return total[0].copy()

        yield stateful(f"all-{k + 1}", model, Counting(model, altered))
    model = base(rng)
    yield stateful("slowly", model, Counting(model, lambda g, calls: g * (1 + 0.1 * (calls - 1))))


@family(KIND)
def races(rng: Rng) -> Iterator[Box]:
    """Some calls lose a contribution."""
    for every in (2, 3):
        model = base(rng)
        i = int(np.argmax(np.abs(model.g(model.p))))

        def altered(g: Array, calls: int, i: int = i, every: int = every) -> Array:
            g[i] *= 0.5 if calls % every == 0 else 1.0
            return g

        yield stateful(f"every-{every}", model, Counting(model, altered), wrong=frozenset({i}))
    model, dice = base(rng), np.random.default_rng(int(rng.integers(2**32)))
    yield stateful("scattered", model, Counting(model, lambda g, calls: g * (1 + 0.1 * dice.standard_normal(len(g)))))


class Alters:
    """Each gradient multiplies J by a factor, and follows it."""

    def __init__(self, model: Model, factor: float) -> None:
        self.model, self.factor, self.k = model, factor, 1.0

    def objective(self, p: Array) -> float:
        return self.k * float(self.model.J(p))

    def gradient(self, p: Array) -> Array:
        g = self.k * self.model.g(p)
        self.k *= self.factor
        return g


@family(KIND)
def alters_the_objective(rng: Rng) -> Iterator[Box]:
    for size in (1.5, 1.05, 0.5):
        model = base(rng)
        yield stateful(f"by-{size:g}", model, Alters(model, size), expect=UNSTEADY | OPEN)


@family(KIND)
def training_mode(rng: Rng) -> Iterator[Box]:
    """The first gradient switches a layer that drops a part of J on, and nobody switches it off."""

    class Mode(Counting):
        def objective(self, p: Array) -> float:
            return float(self.model.J(p)) + (0.3 * float(np.sum(p * p)) if self.calls else 0.0)

    for k in range(2):
        model = base(rng)
        yield stateful(f"{k + 1}", model, Mode(model, lambda g, calls: g), expect=UNSTEADY | OPEN)


class Recorded:
    """The gradient was recorded once, at p, and is replayed everywhere."""

    def __init__(self, model: Model, at: Array | None) -> None:
        self.model = model
        self.g = None if at is None else model.g(at)

    def objective(self, p: Array) -> float:
        return float(self.model.J(p))

    def gradient(self, p: Array) -> Array:
        self.g = self.model.g(p) if self.g is None else self.g
        return self.g.copy()


@family(KIND)
def recorded_at_the_start(rng: Rng) -> Iterator[Box]:
    for k in range(3):
        model = base(rng)
        yield stateful(f"{k + 1}", model, Recorded(model, model.p))


@family(KIND)
def recorded_at_the_first_call(rng: Rng) -> Iterator[Box]:
    for k in range(3):
        model = base(rng)
        yield stateful(f"{k + 1}", model, Recorded(model, None))


@family(KIND)
def recorded_elsewhere(rng: Rng) -> Iterator[Box]:
    """At a default that is not the start."""
    for k in range(2):
        model = base(rng)
        yield stateful(f"{k + 1}", model, Recorded(model, 1.3 * model.p + 0.1), expect=UNSTEADY)


@family(KIND)
def recorded_in_part(rng: Rng) -> Iterator[Box]:
    """A branch of the tape is replayed: one factor of the product rule stays at the start."""
    for k in range(2):
        n = int(rng.integers(2, 20))
        c, p = rng.uniform(0.5, 1.5, n), rng.uniform(0.5, 1.5, n)
        model = Model(lambda q, c=c: np.sum(c * np.exp(q)), lambda q, c=c: c * np.exp(q), p)
        kept = Counting(Model(model.J, lambda q, c=c, p=p: 0.5 * c * (np.exp(q) + np.exp(p)), p), lambda g, calls: g)
        yield stateful(f"{k + 1}", model, kept)


class Late:
    """The gradient of the point before, a stale buffer; `depth` buffers are used in turn."""

    def __init__(self, model: Model, depth: int) -> None:
        self.model, self.kept = model, [model.p.copy()] * depth

    def objective(self, p: Array) -> float:
        return float(self.model.J(p))

    def gradient(self, p: Array) -> Array:
        self.kept.append(p.copy())
        return self.model.g(self.kept.pop(0))


@family(KIND)
def late_by_calls(rng: Rng) -> Iterator[Box]:
    for depth in (1, 2):
        model = base(rng)
        yield stateful(f"by-{depth}", model, Late(model, depth))


class OneBuffer:
    """The gradient is written into one array, which the next call of either function overwrites."""

    def __init__(self, model: Model) -> None:
        self.model, self.buffer = model, np.empty(len(model.p))

    def objective(self, p: Array) -> float:
        self.buffer[:] = p
        return float(self.model.J(p))

    def gradient(self, p: Array) -> Array:
        self.buffer[:] = self.model.g(p)
        return self.buffer


@family(KIND)
def one_buffer(rng: Rng) -> Iterator[Box]:
    """Right for who copies what was returned."""
    for k in range(2):
        model = base(rng)
        kept = OneBuffer(model)
        yield right(model, name=f"right-{k + 1}", objective=kept.objective, gradient=kept.gradient)
    model = base(rng)
    fault = sign(model, rng)
    kept = OneBuffer(Model(model.J, fault.g, model.p))
    yield wrong(model, fault, objective=kept.objective, gradient=kept.gradient)


@family(KIND)
def changes_p_in_place(rng: Rng) -> Iterator[Box]:
    """The functions work on the array that they are given."""
    for name, fault in (("right", None), ("sign", sign)):
        model = base(rng)
        made = None if fault is None else fault(model, rng)

        def J(p: Array, model: Model = model) -> float:
            value = float(model.J(p))
            p *= 2.0
            return value

        def g(p: Array, of: Callable[[Array], Array] = model.g if made is None else made.g) -> Array:
            value = of(p.copy())
            p += 1.0
            return value

        if made is None:
            yield right(model, name=name, objective=J, gradient=g)
        else:
            yield wrong(model, made, objective=J, gradient=g)
