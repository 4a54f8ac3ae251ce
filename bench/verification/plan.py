"""How a gradient is tested: which steps, which lines, how many calls."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

FEWEST_CALLS, SMALLEST_STEP, MOST_DIRECTIONS = 20, 1e-100, 1000


@dataclass(frozen=True)
class Plan:
    """Steps h from h_min to h_max relative to max(|p_i|, s_i), `per_decade` in each decade.

    components   tested one by one: a number of them (largest, median, smallest sensitivity ...) or these indices
    directions   number of random directions
    everywhere   all steps on every line; else on the first line only, and on the others near its best step
    budget       objective calls at most
    """

    h_min: float = 1e-15
    h_max: float = 1.0
    per_decade: int = 2
    components: int | tuple[int, ...] = 3
    directions: int = 2
    everywhere: bool = False
    budget: float = 240.0
    seed: int = 0

    def __post_init__(self) -> None:
        ordered = SMALLEST_STEP <= self.h_min < self.h_max <= 1.0 / SMALLEST_STEP
        if not ordered or self.h_max / self.h_min < 1e3:
            raise InputError(
                f"steps from {self.h_min:g} to {self.h_max:g} - give 0 < least < largest, 3 decades apart,"
                f" {SMALLEST_STEP:g} at least"
            )
        if not 2 <= self.per_decade <= 100:
            raise InputError(f"{self.per_decade} steps a decade - give 2 to 100")
        if not self.budget >= FEWEST_CALLS:
            raise InputError(f"a budget of {self.budget:g} calls - give at least {FEWEST_CALLS}")
        if not 1 <= self.directions <= MOST_DIRECTIONS:
            raise InputError(f"{self.directions} random directions - give at least 1, at most {MOST_DIRECTIONS}")
        if self.seed < 0:
            raise InputError(f"seed {self.seed} - give a whole number >= 0")

    @cached_property
    def steps(self) -> Array:
        """All steps, ascending."""
        count = round(math.log10(self.h_max / self.h_min) * self.per_decade)
        return np.asarray(self.h_max * 10.0 ** (-np.arange(count, -1, -1) / self.per_decade))

    def near(self, h: float, decades: float = 1.0) -> Array:
        """The steps within so many decades of h, on both sides."""
        steps = self.steps
        nearest = steps[np.abs(np.log10(steps / h)).argmin()]
        return np.asarray(steps[np.abs(np.log10(steps / nearest)) <= decades + 1e-9])


THOROUGH = Plan(h_min=1e-16, per_decade=4, components=1, directions=2, everywhere=True, budget=math.inf)
