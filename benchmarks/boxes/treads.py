"""Staircases: single precision, rounded inputs, printed results. Steps smaller than a tread say nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.boxes.bases import base, elliptic, separable, stiffness
from benchmarks.boxes.box import KINK, NOISE, OPEN, RIGHT, WRONG, Box, Model, family, right, wrong
from benchmarks.boxes.faults import component, factor, sign
from gradient_routes.problems.problem import Array

Rng = np.random.Generator
KIND = "staircases"


def stepped(
    model: Model, rng: Rng, J: Callable[[Array], Any], fine: bool, name: str, also: frozenset[str]
) -> Iterator[Box]:
    """Right and wrong gradients of a J that goes in steps; fine treads leave no doubt of gross errors."""
    yield right(model, RIGHT | NOISE | also, f"right{name}", objective=J)
    for fault in (sign(model, rng), factor(model, rng), component(model, rng)):
        unclear = frozenset() if fine and fault.name == "sign" else NOISE | OPEN
        yield wrong(model, fault, WRONG | unclear, "combined", name=f"{fault.name}{name}", objective=J)


@family(KIND)
def single_precision_term(rng: Rng) -> Iterator[Box]:
    """One term in float32, the rest in float64."""
    model = separable(rng)
    c = model.g(np.zeros(len(model.p))).astype("f4")

    def J(p: Array) -> float:
        return float((c * np.sin(p.astype("f4"))).sum(dtype="f4")) + float(p @ p)

    yield from stepped(model, rng, J, True, "", frozenset())


@family(KIND)
def single_precision_input(rng: Rng) -> Iterator[Box]:
    """p is rounded to float32, J is computed in float64."""
    for k in range(2):
        model = base(rng)
        J = lambda p, m=model: float(m.J(p.astype("f4").astype(float)))  # noqa: E731
        yield from stepped(model, rng, J, True, f"-{k + 1}", KINK)


@family(KIND)
def single_precision_result(rng: Rng) -> Iterator[Box]:
    for k in range(2):
        model = base(rng)
        J = lambda p, m=model: float(np.float32(m.J(p)))  # noqa: E731
        yield from stepped(model, rng, J, True, f"-{k + 1}", frozenset())


@family(KIND)
def single_precision_solve(rng: Rng) -> Iterator[Box]:
    """The linear solve inside is one in float32."""
    model, b, data = elliptic(rng)

    def J(p: Array) -> float:
        u = np.linalg.solve(stiffness(p).astype("f4"), b.astype("f4"))
        return float(0.5 * np.sum((u.astype(float) - data) ** 2))

    yield from stepped(model, rng, J, True, "", frozenset())


@family(KIND)
def half_precision_input(rng: Rng) -> Iterator[Box]:
    model = separable(rng)
    J = lambda p: float(model.J(p.astype("f2").astype(float)))  # noqa: E731
    yield from stepped(model, rng, J, False, "", KINK | OPEN)


@family(KIND)
def rounded_input(rng: Rng) -> Iterator[Box]:
    """p written to an input file with 12, 9, 6 or 3 decimals."""
    for digits in (12, 9, 6, 3):
        model = separable(rng)
        J = lambda p, m=model, d=digits: float(m.J(np.round(p, d)))  # noqa: E731
        yield from stepped(model, rng, J, digits > 3, f"-{digits}", KINK | (frozenset() if digits > 3 else OPEN))


@family(KIND)
def rounded_term(rng: Rng) -> Iterator[Box]:
    """Only one of two terms sees the rounded p."""
    for digits in (9, 6):
        model = separable(rng)
        c = model.g(np.zeros(len(model.p)))

        def J(p: Array, c: Array = c, digits: int = digits) -> float:
            return float(np.sum(c * np.sin(np.round(p, digits)))) + float(p @ p)

        yield from stepped(model, rng, J, True, f"-{digits}", KINK)


@family(KIND)
def printed_result(rng: Rng) -> Iterator[Box]:
    """J read from a solver's text."""
    for form in ("%.12g", "%.9g", "%.6g", "%.4g"):
        model = base(rng)
        J = lambda p, m=model, f=form: float(f % float(m.J(p)))  # noqa: E731
        few = form in ("%.6g", "%.4g")
        yield from stepped(model, rng, J, not few, f"-{form[2:]}", OPEN if few else frozenset())


@family(KIND)
def fixed_point_result(rng: Rng) -> Iterator[Box]:
    """A fixed number of decimals."""
    for digits in (10, 7):
        model = separable(rng)
        J = lambda p, m=model, d=digits: round(float(m.J(p)), d)  # noqa: E731
        yield from stepped(model, rng, J, True, f"-{digits}", frozenset())


@family(KIND)
def nearest_in_a_table(rng: Rng) -> Iterator[Box]:
    """A material law read from the nearest entry of a table of 10 000."""
    model = separable(rng)
    c = model.g(np.zeros(len(model.p)))
    x = np.linspace(-4.0, 4.0, 10_001)
    table = np.sin(x)

    def J(p: Array) -> float:
        return float(c @ table[np.clip(np.rint((p + 4.0) / 8e-4).astype(int), 0, 10_000)]) + float(p @ p)

    yield from stepped(model, rng, J, False, "", KINK | OPEN)
