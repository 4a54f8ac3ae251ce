"""How a gradient is looked at: which steps, which lines, how many calls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

LOCAL = 1.0  # decades on both sides of the best step, where a line is looked at near it only


@dataclass(frozen=True)
class Plan:
    """Steps h from h_min to h_max relative to max(|p_i|, s_i), `per_decade` of them a decade.

    components   of p looked at one by one: so many (largest, median, smallest sensitivity ...) or these indices
    directions   random ones
    everywhere   every line over all steps; else the first one, and the others near its best step
    budget       objective calls at most
    """

    h_min: float = 1e-15
    h_max: float = 1.0
    per_decade: int = 2
    components: int | tuple[int, ...] = 3
    directions: int = 2
    everywhere: bool = False
    budget: float = 200.0
    seed: int = 0

    def __post_init__(self) -> None:
        if not LEAST_STEP <= self.h_min < self.h_max <= 1.0 / LEAST_STEP or self.h_max / self.h_min < 1e3:
            raise InputError(
                f"steps from {self.h_min:g} to {self.h_max:g} - give 0 < least < largest, 3 decades apart,"
                f" {LEAST_STEP:g} at least"
            )
        if not 2 <= self.per_decade <= 100:
            raise InputError(f"{self.per_decade} steps a decade - give 2 to 100")
        if not self.budget >= LEAST:
            raise InputError(f"a budget of {self.budget:g} calls - give at least {LEAST}")
        if not 1 <= self.directions <= MOST:
            raise InputError(f"{self.directions} random directions - give at least 1, at most {MOST}")
        if self.seed < 0:
            raise InputError(f"seed {self.seed} - give a whole number >= 0")

    @property
    def steps(self) -> Array:
        """All steps, ascending."""
        decades = math.log10(self.h_max / self.h_min)
        count = round(decades * self.per_decade)
        return np.asarray(self.h_max * 10.0 ** (-np.arange(count, -1, -1) / self.per_decade))

    def near(self, h: float, decades: float = LOCAL) -> Array:
        """The steps within so many decades of h."""
        steps = self.steps
        nearest = steps[np.abs(np.log10(steps / h)).argmin()]
        return np.asarray(steps[np.abs(np.log10(steps / nearest)) <= decades + 1e-9])


LEAST, LEAST_STEP, MOST = 20, 1e-100, 1000
THOROUGH = Plan(h_min=1e-16, per_decade=4, components=1, directions=2, everywhere=True, budget=math.inf)
