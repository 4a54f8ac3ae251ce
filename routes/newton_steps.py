"""Newton steps: exact, R_u du = R; chord steps, A du = R with given factors of A; inexact, by Krylov iterations; auto,
inexact until an exact one ends the solve.

Inexact steps keep one factorization as preconditioner (Dembo, Eisenstat & Steihaug 1982). On the block with 16^3 cells
a factorization with its assembly costs as much as 16 products, each with a substitution (10 ms together).
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

WORTH = 20.0  # products that cost as much as new factors and the few products that follow them
LOOSEST = 0.05  # forcing term |R - R_u du| / |R|
BELOW = 0.3  # of the goal: the aim of the last step
PER_ROW = 350.0  # bytes of factors in a row of R_u for which new ones cost as much as a product and a substitution
UNSURE = 10.0  # by which the remainder of an exact step may exceed what that of the first foretells


@dataclass(frozen=True)
class Operations:
    """The counted operations that a step consists of, bound to one p."""

    assemble: Callable[[Array], Any]
    factorize: Callable[[Any], Factorization]
    operator: Callable[[Array], Any] | None
    substitute: Callable[[Factorization, Array], Array]
    product: Callable[[Any, Array], Array]
    step: Callable[[], None]
    symmetric: bool


Correction = tuple[Array, float]


class Direction(Protocol):
    """factors are those of the last direction, rate the contraction of |R - R_u du| by a product where it iterated.

    The factors are released before new ones are made, which can then reuse their analysis: keep no other reference.
    """

    factors: Factorization | None
    rate: float | None

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Correction:
        """du (n_u,) at u and |A|_inf of the factors used; the steps end where |R| <= goal."""
        ...

    def renew(self) -> bool:
        """Make the next direction exact; False if the last was."""
        ...


class Full:
    """R_u du = R with R_u factorized at every u."""

    rate: float | None = None

    def __init__(self, operations: Operations) -> None:
        self._do = operations
        self.factors: Factorization | None = None

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Correction:
        self.factors = None
        self.factors = self._do.factorize(self._do.assemble(u))
        self._do.step()
        return self._do.substitute(self._solver(self.factors, R, scale, goal), R), self.factors.norm

    def renew(self) -> bool:
        return False

    def _solver(self, factors: Factorization, R: Array, scale: float, goal: float) -> Factorization:
        return factors


@dataclass(frozen=True)
class Step:
    """A step u' = u - a du that was taken, R_u du = R: arrays (n_u,), factors of R_u(u)."""

    u: Array
    du: Array
    factors: Factorization
    a: float
    after: Array


class Recorded(Full):
    """Full, with every step that is taken kept."""

    def __init__(self, operations: Operations) -> None:
        super().__init__(operations)
        self.steps: list[Step] = []

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Correction:
        du, size = super().__call__(u, R, scale, goal)
        self._last = u, du
        return du, size

    def taken(self, a: float, after: Array) -> None:
        assert self.factors is not None
        self.steps.append(Step(*self._last, self.factors, a, after))


class Chord:
    """A du = R with given factors of A."""

    rate: float | None = None

    def __init__(self, operations: Operations, factors: Factorization) -> None:
        self._do = operations
        self.factors: Factorization | None = factors

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Correction:
        assert self.factors is not None
        self._do.step()
        return self._do.substitute(self.factors, R), self.factors.norm

    def renew(self) -> bool:
        return False


class Inexact:
    """|R - R_u du| <= eta |R| by Krylov iterations preconditioned with the factors of an earlier u.

    eta = sqrt(|R| / scale), at most 0.05 and at least what the goal needs: fewer products in all than with the
    quadratic choices of Eisenstat & Walker 1996, because a residual costs less than the product that it saves. A rate
    that promises so much that no product is made is forgotten where it does not hold. New
    factors and an exact step are made where more than WORTH products are to be expected.
    """

    def __init__(self, operations: Operations, factors: Factorization | None = None) -> None:
        self._do = operations
        self.factors = factors
        self.rate: float | None = math.inf if factors is not None else None
        self._before, self._trusted = math.inf, False

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Correction:
        self._do.step()
        size, before = float(np.abs(R).max(initial=0.0)), self._before
        self._before = size
        if self.factors is None:
            return self._exact(self._do.assemble(u), R)
        if self.rate is None:  # after an exact step, the ratio of residuals estimates the contraction by its factors
            self.rate = size / before
        elif self._trusted and size > LOOSEST * before:
            self.rate = math.inf
        worth, goal = self._worth(), self._aim(size, scale, goal)
        if self.rate < 1.0 and products_to(self.rate, size, goal) > worth:
            return self._exact(self._do.assemble(u), R)
        K = (self._do.operator or self._do.assemble)(u)
        iterate = conjugate_gradients if self._do.symmetric else conjugate_residuals
        eta = forcing(size, scale, goal)
        done = iterate(
            lambda v: self._do.product(K, v),
            self._substitute,
            R,
            eta * size,
            self.rate,
            at_most=max(1, int(worth)),
        )
        if not done.converged:
            return self._exact(self._do.assemble(u) if self._do.operator else K, R)
        self.rate, self._trusted = done.rate, done.products == 0
        return done.x, self.factors.norm

    def _aim(self, size: float, scale: float, goal: float) -> float:
        """The |R| that iterations have to reach; 0 where an exact step is due."""
        return goal

    def _worth(self) -> float:
        """Products, each with a substitution, that cost as much as new factors."""
        return WORTH

    def _substitute(self, b: Array) -> Array:
        assert self.factors is not None
        return self._do.substitute(self.factors, b)

    def _exact(self, K: Any, R: Array) -> Correction:
        self.factors, self.rate, self._trusted = None, None, False
        self.factors = self._do.factorize(K)
        return self._do.substitute(self.factors, R), self.factors.norm

    def renew(self) -> bool:
        exact, self.factors = self.rate is None, None
        return not exact


class Auto(Inexact):
    """Inexact until one exact step reaches the goal, then that one, where new factors cost less than the products that
    they save in the rest of the solve and in a linearized one to `rtol` after it.

    An exact step leaves c |R|^2 / scale, c about as after the first. The last factors are those of the last iterate,
    as after full steps. Factors of m entries in each row cost about m times as much as a substitution with them.
    """

    def __init__(self, operations: Operations, rtol: float) -> None:
        super().__init__(operations)
        self._rtol = rtol
        self._c: float | None = None
        self._n = 1

    def __call__(self, u: Array, R: Array, scale: float, goal: float) -> Correction:
        self._n = len(u)
        return super().__call__(u, R, scale, goal)

    def _aim(self, size: float, scale: float, goal: float) -> float:
        assert self.rate is not None
        if self._c is None:
            self._c = size / scale
        near = math.sqrt(goal * scale / (UNSURE * self._c))
        saved = products_to(self.rate, size, goal) + products_to(self.rate, 1.0, self._rtol)
        if self.rate < 1.0 and saved <= self._worth():
            return goal
        return near if size > near else 0.0

    def _worth(self) -> float:
        assert self.factors is not None
        per_row = min(self.factors.nbytes / self._n, 2.0 * self._n)  # of half a triangle, where workspace is more
        return per_row / PER_ROW


class Truncated(Full):
    """|R - R_u du| <= eta |R|, eta as for Inexact, by a linear solver that iterates, R_u assembled at every u."""

    rate: float | None = math.inf

    def _solver(self, factors: Factorization, R: Array, scale: float, goal: float) -> Factorization:
        return factors.to(forcing(float(np.abs(R).max(initial=0.0)), scale, goal))


def forcing(size: float, scale: float, goal: float) -> float:
    """eta for |R| = size: sqrt(|R| / scale), at most LOOSEST and at least what the goal needs."""
    return min(LOOSEST, max(math.sqrt(size / scale) if scale else 0.0, BELOW * goal / size if size else 0.0))
