"""Linear solvers that iterate to a tolerance without a preconditioner.

For studies of tolerances: the true residual b - A x decides where they end, and no last correction is taken without
computing its residual, as `krylov.py` does. Complex systems are solved by the same steps with nothing conjugated, so
that a complex step differentiates the iterate.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.matrices.sparse import GeneralSparse, SymmetricSparse
from gradient_routes.problems.matrices.tridiagonal import Bordered, Chain
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.krylov import ConjugateGradients, dot, norm
from gradient_routes.routes.solvers.solver import Factorization, Factorize, LinearSolver

SOUND = 1e-6  # |b - A x| / |b| that rounding may leave: beyond it, x is large because A is singular
GROWN = 1.0 / np.finfo(np.float64).eps  # of |r|_2^2 over |b|_2^2: cond(A) where A is positive definite, at most
STILL = 1.0 - 1e-6  # of |r|_2, before a restart
ROUNDING = 16.0 * np.finfo(np.float64).eps  # |b - A x| <= ROUNDING |A| |x|: no iteration can do better


@dataclass(frozen=True)
class Method:
    """An iteration for symmetric A, and one for general A.

    symmetric, general  their names
    at_most             products of a solve
    directions          kept before a restart, where A is not symmetric; one: no memory, also where A is symmetric
    """

    symmetric: str
    general: str
    at_most: int
    directions: int

    def named(self, symmetric: bool) -> str:
        return self.symmetric if symmetric else self.general


# conjugate gradients of Hestenes & Stiefel 1952, GMRES in the simpler form of Walker & Zhou 1994
KRYLOV = Method("conjugate gradients", "GMRES", 20_000, 200)
# Cauchy 1847. It converges slowly but evenly, where conjugate gradients on few unknowns have a large error until the
# n-th step and are exact from there on. On indefinite A it rarely converges
DESCENT = Method("steepest descent", "minimal residuals", 500_000, 1)


class IterativeFactorization(Factorization):
    """Solves A x = b to |b - A x|_inf <= rtol |b|_inf, or to rounding. Its products are not counted, nor are those of
    multigrid. A symmetric A that turns out to be indefinite is solved as a general one. A solve raises NotConverged.
    """

    def __init__(self, method: Method, rtol: float, A: Any, who: str) -> None:
        self._who, self._method, self.rtol = who, method, rtol
        self._symmetric = A.T is A or (isinstance(A, np.ndarray) and bool((A == A.T).all()))
        self.name = method.named(self._symmetric)
        known = isinstance(A, Chain | Bordered | SymmetricSparse | GeneralSparse)
        self.norm = float(A.norm if known else abs(A).sum(axis=1).max())
        self._nbytes = int((A if known else A.data).nbytes)
        self._A = A.full().tocsr() if isinstance(A, SymmetricSparse) else A

    @property
    def nbytes(self) -> int:
        return self._nbytes

    def to(self, rtol: float) -> IterativeFactorization:
        other = copy(self)
        other.rtol = rtol
        return other

    def substitute(self, b: Array, transposed: bool) -> Array:
        """Iterations on b - A x, restarted until the true residual is small: the one carried along drifts from it."""
        A, method = self._A.T if transposed and not self._symmetric else self._A, self._method
        x, r, size, before, products = np.zeros_like(b), b, norm(b), np.inf, 0
        wanted, sound = self.rtol * size, SOUND * size
        symmetric, at_most = self._symmetric, method.at_most
        enough = wanted
        while size > enough and size < before and products < at_most:
            if symmetric:
                dx, more = _conjugate_gradients(A, r, wanted, at_most - products, memory=method.directions > 1)
                symmetric = dx is not None
            if not symmetric:
                dx, more = _minimal_residuals(A, r, wanted, at_most - products, method.directions)
            x, products = x + dx, products + more
            r, before = b - A @ x, size
            size = norm(r)
            enough = max(wanted, min(sound, ROUNDING * self.norm * norm(x)))
        if not size <= enough:
            reached = f"|b - A x| = {size / norm(b):.2g} |b| after {products} products, wanted {self.rtol:.2g}"
            name = method.named(symmetric)
            raise NotConverged(
                f"{self._who}: {name}: {reached} - loosen the tolerance or take --linear-solver auto", ()
            )
        return x


def _conjugate_gradients(A: Any, b: Array, wanted: float, at_most: int, memory: bool) -> tuple[Array | None, int]:
    """x with |r|_inf <= wanted, r the residual carried along, and the products taken; None where A is indefinite:
    d.Ad is not positive, or |r| grows further than it can while the energy of a definite A falls.
    """
    cg = ConjugateGradients(A.__matmul__, lambda r: r, b)
    k, bound = 0, GROWN * abs(cg.rz)
    while norm(cg.r) > wanted and k < at_most:
        energy = cg.multiply()
        k += 1
        if not (energy.real > 0.0 and abs(cg.rz) <= bound):
            return None, k
        cg.advance()
        cg.redirect(memory)
    return cg.x, k


def _minimal_residuals(A: Any, b: Array, wanted: float, at_most: int, memory: int) -> tuple[Array, int]:
    """The same for any A; it stops where |r| no longer falls. The directions span q, A q, A^2 q ..., q = A r."""
    x, r, k = np.zeros_like(b), b, 0
    while norm(r) > wanted and k < at_most:
        directions: list[tuple[Array, Array]] = []  # d and A d, the A d orthonormal
        start = _norm2(r)
        while norm(r) > wanted and len(directions) < memory:
            d = directions[-1][1] if directions else r
            Ad = A @ d
            k += 1
            for e, Ae in directions:
                along = dot(Ae, Ad)
                d, Ad = d - along * e, Ad - along * Ae
            length = np.sqrt(dot(Ad, Ad))
            if length == 0.0:
                return x, k
            d, Ad = d / length, Ad / length
            directions.append((d, Ad))
            share = dot(Ad, r)
            x, r = x + share * d, r - share * Ad
        if not _norm2(r) < STILL * start:
            break
    return x, k


def _norm2(v: Array) -> float:
    return float(np.sqrt((np.abs(v) ** 2).sum()))


def solver(name: str, method: Method, gradual: bool) -> LinearSolver:
    def start(rtol: float) -> Factorize:
        return partial(IterativeFactorization, method, rtol)

    return LinearSolver(name, start, takes=lambda A: True, iterates=True, factors=False, gradual=gradual)


krylov = solver("krylov", KRYLOV, gradual=False)
descent = solver("descent", DESCENT, gradual=True)
