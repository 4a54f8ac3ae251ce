"""Linear solvers that end where they are told to: iterations without a preconditioner, to a tolerance.

A study of tolerances asks where an iteration ends, so the true b - A x decides, and no last correction is taken
unchecked as in `krylov.py`. Complex systems are solved by the same steps, nothing conjugated: a complex step then
differentiates the iterate.
"""

from __future__ import annotations

from copy import copy
from typing import Any, Literal

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.matrices.sparse import GeneralSparse, SymmetricSparse
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal
from gradient_routes.problems.problem import Array

Kind = Literal["krylov", "descent"]
AT_MOST = {"krylov": 20_000, "descent": 500_000}  # products of a solve
MEMORY = {"krylov": 200, "descent": 1}  # directions before a restart, where A is not symmetric
NAMES = {
    ("krylov", True): "conjugate gradients",
    ("krylov", False): "GMRES",
    ("descent", True): "steepest descent",
    ("descent", False): "minimal residuals",
}
SOUND = 1e-6  # |b - A x| / |b| that rounding may leave: beyond, x is large because A is singular
GROWN = 1.0 / np.finfo(np.float64).eps  # of |r|_2^2 over |b|_2^2: cond(A) where A is positive definite, at most
STILL = 1.0 - 1e-6  # of |r|_2, before a restart
ROUNDING = 16.0 * np.finfo(np.float64).eps  # |b - A x| <= ROUNDING |A| |x|: no iteration can do better


class IterativeFactorization:
    """Solves A x = b to |b - A x|_inf <= rtol |b|_inf, or to rounding. Its products are not counted, as multigrid's.

    krylov   conjugate gradients (Hestenes & Stiefel 1952) where A is symmetric; where that turns out indefinite, or A
             is general, GMRES (in the simpler form of Walker & Zhou 1994, restarted)
    descent  the same without memory: steepest descent (Cauchy 1847) and minimal residuals. Slow, but evenly so on few
             unknowns, where conjugate gradients are off until the n-th step and exact from there on. Indefinite A it
             rarely solves

    solve raises NotConverged.
    """

    def __init__(self, A: Any, who: str, kind: Kind, rtol: float) -> None:
        self._who, self._kind, self.rtol = who, kind, rtol
        self._symmetric = A.T is A or (isinstance(A, np.ndarray) and bool((A == A.T).all()))
        self.name = NAMES[kind, self._symmetric]
        known = isinstance(A, Tridiagonal | BorderedTridiagonal | SymmetricSparse | GeneralSparse)
        self.norm = float(A.norm if known else abs(A).sum(axis=1).max())
        self.nbytes = int((A if known else A.data).nbytes)
        self._A = A.full().tocsr() if isinstance(A, SymmetricSparse) else A

    def to(self, rtol: float) -> IterativeFactorization:
        """The same matrix, solved to another tolerance."""
        other = copy(self)
        other.rtol = rtol
        return other

    def solve(self, b: Array) -> Array:
        return self._solve(self._A, b)

    def solve_transposed(self, b: Array) -> Array:
        return self._solve(self._A if self._symmetric else self._A.T, b)

    def _solve(self, A: Any, b: Array) -> Array:
        """Iterations on what is left, until the true residual is small: the one carried along drifts from it."""
        x, r, size, before, products = np.zeros_like(b), b, _norm(b), np.inf, 0
        wanted, sound = self.rtol * size, SOUND * size
        symmetric, at_most = self._symmetric, AT_MOST[self._kind]
        enough = wanted
        while size > enough and size < before and products < at_most:
            if symmetric:
                dx, more = _conjugate_gradients(A, r, wanted, at_most - products, memory=self._kind == "krylov")
                symmetric = dx is not None
            if not symmetric:
                dx, more = _minimal_residuals(A, r, wanted, at_most - products, MEMORY[self._kind])
            x, products = x + dx, products + more
            r, before = b - A @ x, size
            size = _norm(r)
            enough = max(wanted, min(sound, ROUNDING * self.norm * _norm(x)))
        if not size <= enough:
            came = f"|b - A x| = {size / _norm(b):.2g} |b| after {products} products, wanted {self.rtol:.2g}"
            name = NAMES[self._kind, symmetric]  # that it ended with
            raise NotConverged(f"{self._who}: {name}: {came} - loosen the tolerance or take --linear-solver auto", ())
        return x


def _conjugate_gradients(A: Any, b: Array, wanted: float, at_most: int, memory: bool) -> tuple[Array | None, int]:
    """x with |r|_inf <= wanted, r the residual carried along, and the products taken; None where A is indefinite.

    That shows in a direction's energy, or in an |r| that grows as no minimum of the energy lets it.
    """
    x, r, d = np.zeros_like(b), b, b
    rr, k = _dot(r, r), 0
    bound = GROWN * abs(rr)
    while _norm(r) > wanted and k < at_most:
        Ad = A @ d
        k += 1
        energy = _dot(d, Ad)
        if not (energy.real > 0.0 and abs(rr) <= bound):
            return None, k
        alpha = rr / energy
        x, r = x + alpha * d, r - alpha * Ad
        rr, rr_before = _dot(r, r), rr
        d = r + rr / rr_before * d if memory else r
    return x, k


def _minimal_residuals(A: Any, b: Array, wanted: float, at_most: int, memory: int) -> tuple[Array, int]:
    """The same for any A; it stops where it stands still. The directions' products are q, A q, A^2 q ..., q = A r."""
    x, r, k = np.zeros_like(b), b, 0
    while _norm(r) > wanted and k < at_most:
        directions: list[tuple[Array, Array]] = []  # d and A d, the A d orthonormal
        start = _norm2(r)
        while _norm(r) > wanted and len(directions) < memory:
            d = directions[-1][1] if directions else r
            Ad = A @ d
            k += 1
            for e, Ae in directions:
                along = _dot(Ae, Ad)
                d, Ad = d - along * e, Ad - along * Ae
            length = np.sqrt(_dot(Ad, Ad))
            if length == 0.0:
                return x, k
            d, Ad = d / length, Ad / length
            directions.append((d, Ad))
            share = _dot(Ad, r)
            x, r = x + share * d, r - share * Ad
        if not _norm2(r) < STILL * start:
            break
    return x, k


def _dot(a: Array, b: Array) -> Any:
    """a . b, nothing conjugated; without BLAS, which wakes its threads too soon."""
    return (a * b).sum()


def _norm2(v: Array) -> float:
    return float(np.sqrt((np.abs(v) ** 2).sum()))


def _norm(v: Array) -> float:
    return float(np.abs(v).max(initial=0.0))
