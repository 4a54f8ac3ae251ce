"""What is known of a problem before a route is chosen."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gradient_routes.bench.execution.cost_model import Prices
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Offers, Structure

LARGEST = 10**9  # counts
LONGEST = 1e12  # [s]


@dataclass(frozen=True)
class Measured:
    """Of a problem at hand: its prices and cold forward solve, its condition, the bytes of factors of R_u."""

    name: str
    prices: Prices
    structure: Structure
    matrix_free: bool
    condition: float | None
    factors: int | None


@dataclass(frozen=True)
class Answers:
    """One answer to each question. Raises InputError for numbers out of range.

    n_p        parameters
    outputs    1: the gradient of one J; m > 1: the whole Jacobian of m data
    n_u        unknowns, of one step where time is marched
    steps      in time; 0: a steady problem
    newton     Newton steps of a forward solve, of every step in time; 1: R is affine in u
    offers     what can be evaluated
    smooth     False: J has kinks near p
    iterate    True: the derivative of the last iterate is wanted, not that of the solution
    rtol       |R| / |R_0| that solves leave
    error      relative error that the gradient may have
    memory     [byte] at hand
    gradients  that are computed
    budget     [s] for all of them
    forward_s  [s] of a forward solve
    solve_s    [s] of one more solve with R_u or R_u^T after it; None: see `stand_in.prices`
    measured   of a problem at hand, where n_u, steps, newton, offers, forward_s and solve_s are its own
    """

    n_p: int = 100
    outputs: int = 1
    n_u: int = 100_000
    steps: int = 0
    newton: int = 1
    offers: Offers = Offers.LINEARIZE
    smooth: bool = True
    iterate: bool = False
    rtol: float = 1e-12
    error: float = 1e-7
    memory: float = 8 * 2.0**30
    gradients: int = 1
    budget: float = math.inf
    forward_s: float = 1.0
    solve_s: float | None = None
    measured: Measured | None = None

    def __post_init__(self) -> None:
        for name, least in (("n_p", 1), ("outputs", 1), ("n_u", 1), ("steps", 0), ("newton", 1), ("gradients", 1)):
            if not least <= getattr(self, name) <= LARGEST:
                raise InputError(f"advise: {name}={getattr(self, name)} - give a whole number from {least} to 1e9")
        for name, most in (("memory", math.inf), ("budget", math.inf), ("forward_s", LONGEST), ("solve_s", LONGEST)):
            value = getattr(self, name)
            if value is not None and not 0.0 < value <= most:
                raise InputError(f"advise: {name}={value:g} - give a number > 0, at most {most:g}")
        for name in ("rtol", "error"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise InputError(f"advise: {name}={getattr(self, name):g} - give a number between 0 and 1")
        if Offers.VALUE not in self.offers:
            raise InputError("advise: offers no J(p) - every route needs it")

    @property
    def linear(self) -> bool:
        """R is affine in u."""
        return self.newton == 1
