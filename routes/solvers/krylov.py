"""Preconditioned Krylov iterations on products v -> A v, given factors of a matrix M near A.

Both end in a correction nobody looks at: once the residual times the contraction seen so far is small enough, the
last direction is taken with the last step length. The last digits so cost a substitution, not one and a product.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

Apply = Callable[[Array], Array]
TRIED = 3  # products before the contraction seen is believed to last


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
    """x with |b - A x|_inf <= wanted expected, A = A^T, M = M^T (Hestenes & Stiefel 1952; no conjugation).

    `rate` is the contraction to expect before any was seen. Gives up after `at_most` products, or as soon as more are
    to be expected once `tried` were made. Breaks down where A and M disagree on the sign of a direction's energy, for
    one of them is indefinite then; where both have to be `definite`, at any negative one. Real numbers only.
    """
    x, r, z = np.zeros_like(b), b, M_solve(b)
    d, rz, alpha = z, _dot(r, z), 1.0
    start = size = _norm(b)
    k = 0
    while not _small(rate, size, wanted):
        Ad = A(d)
        k += 1
        energy = _dot(d, Ad)
        if not energy * np.sign(rz) > 0.0 or (definite and energy < 0.0):
            return Iterated(x, k, rate, False, f"d.Ad = {energy:.3g} where r.z = {rz:.3g}: not positive definite")
        alpha = rz / energy
        x, r = x + alpha * d, r - alpha * Ad
        size = _norm(r)
        rate = (size / start) ** (1.0 / k)
        if _hopeless(k, rate, size, wanted, at_most, tried):
            return Iterated(x, k, rate, False)
        z = M_solve(r)
        rz, rz_before = _dot(r, z), rz
        d = z + rz / rz_before * d
    return Iterated(x + alpha * d, k, rate, True)


def conjugate_residuals(
    A: Apply, M_solve: Apply, b: Array, wanted: float, rate: float = math.inf, at_most: int = 50
) -> Iterated:
    """The same for any A: generalized conjugate residuals, the iterates of GMRES (Eisenstat, Elman & Schultz 1983).

    Every product is kept: memory grows by two vectors a product. Breaks down where a direction lowers |r| no more.
    """
    x, r = np.zeros_like(b), b
    start = size = _norm(b)
    directions: list[tuple[Array, Array]] = []  # d and A d, the A d orthonormal
    z = M_solve(b)
    while not _small(rate, size, wanted):
        d, Ad = z, A(z)
        for e, Ae in directions:
            along = _dot(np.conj(Ae), Ad)
            d, Ad = d - along * e, Ad - along * Ae
        length = math.sqrt(abs(_dot(np.conj(Ad), Ad)))
        share = _dot(np.conj(Ad), r)
        if not (length > 0.0 and abs(share) > 0.0):
            stands = f"|A d| = {length:.3g}, A d orthogonal to r: the iteration stands still"
            return Iterated(x, len(directions) + 1, rate, False, stands)
        d, Ad = d / length, Ad / length
        directions.append((d, Ad))
        x, r = x + share / length * d, r - share / length * Ad
        size = _norm(r)
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


def _dot(a: Array, b: Array) -> Any:
    """a . b without BLAS, which wakes its threads for 14 000 numbers already: on a busy machine they take longer."""
    return (a * b).sum()


def _norm(v: Array) -> float:
    return float(np.abs(v).max(initial=0.0))
