"""Where a Newton step goes: along R_u^{-1} R, along A^{-1} R with factors that are given, or near enough to the first.

Inexact steps keep one factorization and iterate with it (Dembo, Eisenstat & Steihaug 1982). What that costs, on the
block with 16^3 cells in units of one product and one substitution (10 ms): a factorization with its assembly 16.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.krylov import conjugate_gradients, conjugate_residuals, products_to
from gradient_routes.routes.solvers.solver import Factorization

WORTH = 20.0  # products that cost what new factors cost, and the few that those need in their turn
LOOSEST = 0.05  # forcing term |R - R_u du| / |R|
BELOW = 0.3  # of the goal, where the last step aims


@dataclass(frozen=True)
class Doorways:
    """The counted operations that directions are made of, bound to one p."""

    assemble: Callable[[Array], Any]
    factorize: Callable[[Any], Factorization]
    operator: Callable[[Array], Any] | None
    substitute: Callable[[Factorization, Array], Array]
    product: Callable[[Any, Array], Array]
    step: Callable[[], None]
    symmetric: bool


Directed = tuple[Array, float]


class Direction(Protocol):
    """factors are those of the last direction, rate their contraction of |R - R_u du| a product where it was iterated.

    They are let go of before new ones are made, which can then take over their analysis: hold no other reference.
    """

    factors: Factorization | None
    rate: float | None

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Directed:
        """du (n_u,) at u, where |R| shall come down to `goal` in the end, and |A|_inf of the factors used."""
        ...

    def renew(self) -> bool:
        """Make the next direction exact; False if the last was."""
        ...


class Full:
    """R_u du = R, R_u factorized at every u."""

    rate: float | None = None

    def __init__(self, doorways: Doorways) -> None:
        self._do = doorways
        self.factors: Factorization | None = None

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Directed:
        self.factors = None
        self.factors = self._do.factorize(self._do.assemble(u))
        self._do.step()
        return self._do.substitute(self.factors, R), self.factors.norm

    def renew(self) -> bool:
        return False


class Chord:
    """A du = R with the factors given."""

    rate: float | None = None

    def __init__(self, doorways: Doorways, factors: Factorization) -> None:
        self._do = doorways
        self.factors: Factorization | None = factors

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Directed:
        assert self.factors is not None
        self._do.step()
        return self._do.substitute(self.factors, R), self.factors.norm

    def renew(self) -> bool:
        return False


class Inexact:
    """|R - R_u du| <= eta |R| by Krylov iterations preconditioned with the factors of an earlier u.

    eta = sqrt(|R| / scale), at most 0.05 and never below what the goal asks for: fewer products in all than with the
    quadratic choices of Eisenstat & Walker 1996, for a residual costs less than the product it saves. New factors,
    and an exact step, where more than WORTH products are to be expected before the goal.
    """

    def __init__(self, doorways: Doorways, factors: Factorization | None = None) -> None:
        self._do = doorways
        self.factors = factors
        self.rate: float | None = math.inf if factors is not None else None
        self._before = math.inf

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Directed:
        self._do.step()
        size, before = float(np.abs(R).max(initial=0.0)), self._before
        self._before = size
        if self.factors is None:
            return self._exact(self._do.assemble(u), R)
        if self.rate is None:  # the step before was exact: what is left of R says how far R_u has moved since
            self.rate = size / before
        if self.rate < 1.0 and products_to(self.rate, size, goal) > WORTH:
            return self._exact(self._do.assemble(u), R)
        K = (self._do.operator or self._do.assemble)(u)
        iterate = conjugate_gradients if self._do.symmetric else conjugate_residuals
        eta = min(LOOSEST, max(math.sqrt(size / scale) if scale else 0.0, BELOW * goal / size if size else 0.0))
        done = iterate(
            lambda v: self._do.product(K, v),
            self._substitute,
            R,
            eta * size,
            self.rate,
            at_most=int(WORTH),
        )
        if not done.converged:
            return self._exact(self._do.assemble(u) if self._do.operator else K, R)
        self.rate = done.rate
        return done.x, self.factors.norm

    def _substitute(self, b: Array) -> Array:
        assert self.factors is not None
        return self._do.substitute(self.factors, b)

    def _exact(self, K: Any, R: Array) -> Directed:
        self.factors, self.rate = None, None
        self.factors = self._do.factorize(K)
        return self._do.substitute(self.factors, R), self.factors.norm

    def renew(self) -> bool:
        exact, self.factors = self.rate is None, None
        return not exact
