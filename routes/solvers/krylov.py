"""Preconditioned Krylov iterations on products v -> A v, given factors of a matrix M near A.

Both end in a correction whose residual is not computed: once the residual times the mean contraction so far is small
enough, a step along the last direction is taken with the last step length. The last digits cost a substitution, and no
product.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

Apply = Callable[[Array], Array]
TRIED = 3  # products before their mean contraction is extrapolated


@dataclass(frozen=True)
class Iterated:
    """x (n_u,) after `products` products with A; as many substitutions, and one more where it converged.

    rate       mean contraction of |r|_inf a product
    converged  the last correction is expected to reach the tolerance
    breakdown  why the iteration could not go on, where it could not
    """

    x: Array
    products: int
    rate: float
    converged: bool
    breakdown: str | None = None


class ConjugateGradients:
    """The iteration of Hestenes & Stiefel 1952 for A = A^T, preconditioned by M = M^T: x (n_u,), r = b - A x, the next
    direction d. Nothing is conjugated, so that the iterates for complex A are analytic in A and b.

    One iteration is `multiply`, the product with A; `advance` along d; `redirect`, the substitution with M.
    """

    def __init__(self, A: Apply, M_solve: Apply, b: Array) -> None:
        self._A, self._M_solve = A, M_solve
        self.x, self.r, self.d = np.zeros_like(b), b, M_solve(b)
        self.rz, self.alpha = dot(b, self.d), 1.0

    def multiply(self) -> Any:
        """The energy d.Ad of the direction: positive for positive definite A."""
        self._Ad = self._A(self.d)
        self._energy = dot(self.d, self._Ad)
        return self._energy

    def advance(self) -> None:
        """To the minimum of the energy along d."""
        self.alpha = self.rz / self._energy
        self.x, self.r = self.x + self.alpha * self.d, self.r - self.alpha * self._Ad

    def redirect(self, memory: bool = True) -> None:
        """d conjugate to all before it; without memory M^{-1} r, the direction of steepest descent."""
        z = self._M_solve(self.r)
        rz_before, self.rz = self.rz, dot(self.r, z)
        self.d = z + self.rz / rz_before * self.d if memory else z


def conjugate_gradients(
    A: Apply,
    M_solve: Apply,
    b: Array,
    wanted: float,
    rate: float = math.inf,
    at_most: int = 50,
    definite: bool = False,
    tried: int = TRIED,
) -> Iterated:
    """x with |b - A x|_inf <= wanted expected, A = A^T, M = M^T.

    `rate` is the contraction to expect before the first product. Gives up after `at_most` products, or once `tried`
    were made and more than `at_most` are to be expected. Breaks down where A and M disagree on the sign of a
    direction's energy, for one of them is indefinite then; where both have to be `definite`, at a negative energy. For
    real numbers.
    """
    cg = ConjugateGradients(A, M_solve, b)
    start = size = norm(b)
    k = 0
    while not _small(rate, size, wanted):
        energy = cg.multiply()
        k += 1
        if not energy * np.sign(cg.rz) > 0.0 or (definite and energy < 0.0):
            said = f"d.Ad = {energy:.3g} where r.z = {cg.rz:.3g}: not positive definite"
            return Iterated(cg.x, k, rate, False, said)
        cg.advance()
        size = norm(cg.r)
        rate = (size / start) ** (1.0 / k)
        if _hopeless(k, rate, size, wanted, at_most, tried):
            return Iterated(cg.x, k, rate, False)
        cg.redirect()
    return Iterated(cg.x + cg.alpha * cg.d, k, rate, True)


def conjugate_residuals(
    A: Apply, M_solve: Apply, b: Array, wanted: float, rate: float = math.inf, at_most: int = 50
) -> Iterated:
    """The same for any A: generalized conjugate residuals, the iterates of GMRES (Eisenstat, Elman & Schultz 1983).

    Every product is kept: memory grows by two vectors a product. Breaks down where a direction lowers |r| no more.
    """
    x, r = np.zeros_like(b), b
    start = size = norm(b)
    directions: list[tuple[Array, Array]] = []  # d and A d, the A d orthonormal
    z = M_solve(b)
    while not _small(rate, size, wanted):
        d, Ad = z, A(z)
        for e, Ae in directions:
            along = dot(np.conj(Ae), Ad)
            d, Ad = d - along * e, Ad - along * Ae
        length = math.sqrt(abs(dot(np.conj(Ad), Ad)))
        share = dot(np.conj(Ad), r)
        if not (length > 0.0 and abs(share) > 0.0):
            stands = f"|A d| = {length:.3g}, A d orthogonal to r: the iteration stands still"
            return Iterated(x, len(directions) + 1, rate, False, stands)
        d, Ad = d / length, Ad / length
        directions.append((d, Ad))
        x, r = x + share / length * d, r - share / length * Ad
        size = norm(r)
        k = len(directions)
        rate = (size / start) ** (1.0 / k)
        if _hopeless(k, rate, size, wanted, at_most):
            return Iterated(x, k, rate, False)
        z = M_solve(r)
    return Iterated(x + z, len(directions), rate, True)


def products_to(rate: float, size: float, wanted: float) -> float:
    """Products to expect until a residual of `size` is down to `wanted`."""
    if size <= wanted or rate <= 0.0:
        return 0.0
    return math.log(wanted / size) / math.log(rate) if 0.0 < wanted and rate < 1.0 else math.inf


def _small(rate: float, size: float, wanted: float) -> bool:
    return size == 0.0 or rate * size <= wanted


def _hopeless(k: int, rate: float, size: float, wanted: float, at_most: int, tried: int = TRIED) -> bool:
    return not math.isfinite(size) or k >= at_most or (k >= tried and k + products_to(rate, size, wanted) > at_most)


def dot(a: Array, b: Array) -> Any:
    """a . b, nothing conjugated. Without BLAS, whose threads cost more than they save on vectors of 14 000 numbers."""
    return (a * b).sum()


def norm(v: Array) -> float:
    """|v|_inf."""
    return float(np.abs(v).max(initial=0.0))
