"""A black box, the truth about its gradient, and the registry of families that make such boxes."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from gradient_routes.problems.problem import Array

Truth = Literal["right", "wrong", "combined"]
Expect = frozenset[str]
RIGHT, WRONG, KINK, LOOSE, NOISE, OPEN, STATE = (
    frozenset({verdict})
    for verdict in (
        *("agrees", "wrong-gradient", "non-smooth", "solver-limited", "noise-limited", "undetermined", "unrepeatable"),
    )
)
EXACT = 1e-9  # relative error of a gradient that is called right, unless the box says more
CLEAR = 1e-2  # relative error of one that is called wrong, unless the box says less


@dataclass(frozen=True)
class Model:
    """J and its gradient g (n_p,), both by formula, at p (n_p,).

    J accepts complex p, so that a complex step tells whether g is right. options are keywords of `check`.
    """

    J: Callable[[Array], Any]
    g: Callable[[Array], Array]
    p: Array
    options: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Faulty:
    """A wrong gradient of a model; `wrong` are the components that are, None where they all are."""

    name: str
    g: Callable[[Array], Array]
    wrong: frozenset[int] | None = None


@dataclass(frozen=True)
class Box:
    """What is handed to `check`, and what it may answer.

    truth     of the gradient: right, wrong, or wrong while J is also loose, noisy or kinked
    expect    all verdicts that are right
    wrong     the components that are; None where that cannot be told apart
    knowable  whether J and the gradient, called at one more point, tell
    smooth    the J that is meant, without noise, steps and loose solves, of complex p; None where there is none
    error     relative error of the gradient: at most, where it is right, at least, where it is wrong
    kinked    whether the gradient exists beside the start only
    """

    name: str
    start: Array
    objective: Callable[[Array], Any]
    gradient: Callable[[Array], Any]
    truth: Truth
    expect: Expect
    options: Mapping[str, Any] = field(default_factory=dict)
    wrong: frozenset[int] | None = None
    knowable: bool = True
    smooth: Callable[[Array], Any] | None = None
    error: float = EXACT
    kinked: bool = False


def right(model: Model, expect: Expect = RIGHT, name: str = "right", **more: Any) -> Box:
    """The model with its own gradient."""
    return Box(name, model.p, **_given(model, model.g, more), truth="right", expect=expect, wrong=frozenset(), **more)


def wrong(model: Model, fault: Faulty, expect: Expect = WRONG, truth: Truth = "wrong", **more: Any) -> Box:
    """The model with another gradient; knowable unless `undetermined` is a right answer."""
    given = {"knowable": not expect & OPEN, "error": CLEAR, "name": fault.name, "wrong": fault.wrong} | more
    return Box(start=model.p, **_given(model, fault.g, given), truth=truth, expect=expect, **given)


def _given(model: Model, g: Callable[[Array], Array], more: dict[str, Any]) -> dict[str, Any]:
    """objective, gradient, options and smooth, where `more` does not replace them."""
    made = {"objective": lambda p: float(model.J(p)), "gradient": g, "smooth": model.J, "options": model.options}
    return {key: more.pop(key, value) for key, value in made.items()}


Make = Callable[[np.random.Generator], Iterable[Box]]


@dataclass(frozen=True)
class Family:
    """Boxes of one origin; their data, and some of their faults, are drawn from a seed."""

    name: str
    kind: str
    make: Make

    def boxes(self, seed: int) -> list[Box]:
        """The same boxes for the same seed, whatever was built before."""
        return list(self.make(np.random.default_rng([zlib.crc32(self.name.encode()), seed])))


FAMILIES: dict[str, Family] = {}


def add(name: str, kind: str, make: Make) -> None:
    """Register a family under a name that is free."""
    assert name not in FAMILIES, name
    FAMILIES[name] = Family(name, kind, make)


def family(kind: str) -> Callable[[Make], Make]:
    """Register a function of a generator of random numbers under its own name."""

    def register(make: Make) -> Make:
        add(make.__name__.replace("_", "-"), kind, make)
        return make

    return register
