"""A part of a gradient, where the whole is too dear: a few components, or its slopes along a few directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from gradient_routes.bench.cases.machine import available_bytes
from gradient_routes.bench.units import size
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.subspace import Subspace, components, directions


@dataclass(frozen=True)
class Partial:
    """`count` random components of dJ/dp, or its slopes along `count` random directions."""

    kind: Literal["components", "directions"]
    count: int
    seed: int = 0

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError(f"--{self.kind} {self.count} - give at least 1")
        if self.seed < 0:
            raise InputError(f"--seed {self.seed} - give a whole number >= 0")

    def restrict(self, problem: Problem, p: Array) -> Subspace | None:
        """The problem in these few parameters; None where they are all there are."""
        n_p = len(p)
        if self.kind == "components":
            if self.count > n_p:
                raise InputError(f"--components {self.count}: {problem.name} has {n_p} parameters - take at most {n_p}")
            if self.count == n_p:
                return None
            index = np.random.default_rng(self.seed).choice(n_p, self.count, replace=False)
            return components(problem, p, np.sort(index))
        needed, at_hand = 8.0 * n_p * self.count, available_bytes()
        if at_hand is not None and needed > at_hand / COPIES:
            raise InputError(
                f"--directions {self.count}: {size(needed)} for directions of {n_p} parameters, {size(at_hand)} of"
                " memory at hand - take fewer"
            )
        return directions(problem, p, self.count, self.seed)

    def of(self, n_p: int) -> str:
        """What was computed, in words."""
        if self.kind == "components":
            return f"{self.count} of {n_p} components"
        return f"{self.count} random direction{'s' if self.count > 1 else ''} of {n_p} parameters"


def chosen(components: int | None, directions: int | None, seed: int) -> Partial | None:
    """What --components and --directions ask for. Raises InputError."""
    if components is not None and directions is not None:
        raise InputError(f"--components {components} --directions {directions} - give one of them")
    if components is not None:
        return Partial("components", components, seed)
    return None if directions is None else Partial("directions", directions, seed)


COPIES = 4  # of the directions, while their bounds are found
