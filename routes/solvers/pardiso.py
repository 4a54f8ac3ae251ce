"""Sparse factors by MKL PARDISO: nested dissection, analyses kept for reuse, singular matrices rejected."""

from __future__ import annotations

import importlib.util
import weakref
from functools import cache
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError, SingularMatrix
from gradient_routes.problems.matrices.sparse import GeneralSparse, SymmetricSparse
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers import superlu
from gradient_routes.routes.solvers.solver import Factorization, Factorize, LinearSolver
from gradient_routes.routes.solvers.superlu import REGULAR, solution_error

POSITIVE_DEFINITE, SYMMETRIC, COMPLEX_SYMMETRIC, GENERAL, COMPLEX_GENERAL = 2, -2, 6, 11, 13
KINDS = {
    POSITIVE_DEFINITE: "L L^T",
    SYMMETRIC: "L D L^T",
    COMPLEX_SYMMETRIC: "complex L D L^T",
    GENERAL: "L U",
    COMPLEX_GENERAL: "complex L U",
}

# PARDISO's parameters by index, counted from 0
ORDERING, PIVOT_EPS, SCALING, TRANSPOSED, MATCHING, PERTURBED, ANALYSIS_KB, FACTORS_KB = 1, 9, 10, 11, 12, 13, 15, 16
NEGATIVE = 22  # eigenvalues of a symmetric matrix
# nested dissection takes 0.6 of the time of minimum degree, the default, on a solid of 14 000 unknowns; pivots below
# 1e-12 |A| count as zero: for a body without supports they are rounding, which the default accepts as pivots
SETTINGS = {ORDERING: 2, PIVOT_EPS: 12}
UNSYMMETRIC = {SCALING: 1, MATCHING: 1}
EXHAUSTED = "not enough memory"  # in the message of PARDISO
IDLE = 6  # analyses kept for reuse, for each pattern and kind: two for each of three load cases

Idle = dict[tuple[int, bool], list[Any]]


class PardisoFactorization(Factorization):
    """Factors of a SymmetricSparse (not Hermitian where complex) or GeneralSparse.

    The transposed solve of a general matrix needs factors of its own, made when first asked for and then kept:
    PARDISO can solve with the transpose, but its Python binding discards the factors at any change of a parameter.
    """

    def __init__(self, A: Any, who: str, mtype: int, idle: Idle) -> None:
        self.name, self.norm = f"PARDISO {KINDS[mtype]}", A.norm
        self._who, self._mtype, self._idle = who, mtype, idle
        self.solver = self._factorized(A, transposed=False)
        symmetric = mtype not in (GENERAL, COMPLEX_GENERAL)
        self._transposed: Any = self.solver if symmetric else None
        self._A = None if symmetric else A

    @property
    def nbytes(self) -> int:
        solvers = {id(s): s for s in (self.solver, self._transposed) if s is not None}
        return 1024 * sum(int(s.get_iparm_value(i)) for s in solvers.values() for i in (ANALYSIS_KB, FACTORS_KB))

    def substitute(self, b: Array, transposed: bool) -> Array:
        if not transposed:
            return self._substitute(self.solver, b)
        if self._transposed is None:
            self._transposed = self._factorized(self._A, transposed=True)
        return self._substitute(self._transposed, b)

    @property
    def negative_eigenvalues(self) -> int | None:
        if self._mtype == POSITIVE_DEFINITE:
            return 0
        return int(self.solver.get_iparm_value(NEGATIVE)) if self._mtype == SYMMETRIC else None

    def _substitute(self, solver: Any, b: Array) -> Array:
        dtype = np.complex128 if self._mtype in (COMPLEX_SYMMETRIC, COMPLEX_GENERAL) else np.float64
        if np.iscomplexobj(b) and dtype is np.float64:  # R_u need not depend on p
            return self._substitute(solver, b.real) + 1j * self._substitute(solver, b.imag)
        return np.asarray(solver.solve(np.ascontiguousarray(b, dtype=dtype)))

    def _factorized(self, A: Any, transposed: bool) -> Any:
        """A PARDISO that holds factors of A; raises SingularMatrix, MemoryError."""
        waiting = self._idle.setdefault((self._mtype, transposed), [])
        solver = _refactored(waiting.pop(), A) if waiting else None
        try:
            solver = solver or self._analyzed(A, transposed)
        except RuntimeError as error:
            if EXHAUSTED in str(error):
                raise MemoryError(f"factors of R_u ({A.shape[0]} unknowns): {error}") from error
            raise self._rejection(A, str(error)) from error
        missed = solution_error(A.T if transposed else A, lambda b: self._substitute(solver, b))
        if not missed < REGULAR:  # a singular L L^T may go unnoticed
            raise self._rejection(A, f"a known solution is missed by {missed:.2g}")
        weakref.finalize(self, _keep, waiting, solver)
        return solver

    def _analyzed(self, A: Any, transposed: bool) -> Any:
        """The first factors on a pattern."""
        from pymklpardiso import PardisoSolver

        unsymmetric = self._mtype in (GENERAL, COMPLEX_GENERAL)
        settings = SETTINGS | (UNSYMMETRIC if unsymmetric else {}) | ({TRANSPOSED: 2} if transposed else {})
        solver = PardisoSolver(A.rows if unsymmetric else A.upper, self._mtype, settings)
        perturbed = solver.get_iparm_value(PERTURBED)
        if perturbed:
            raise self._rejection(A, f"{perturbed} of its pivots are zero to 12 digits")
        return solver

    def _rejection(self, A: Any, why: str) -> SingularMatrix:
        what = f"{self._who}: R_u ({A.shape[0]} unknowns) has no {KINDS[self._mtype]}"
        return SingularMatrix(f"{what}: {why} - check p and the supports")


def _refactored(solver: Any, A: Any) -> Any:
    """The solver with factors of A, or None where its analysis, made for other entries, does not suit these."""
    try:
        solver.refactor(A.data)
    except RuntimeError:
        return None
    return None if solver.get_iparm_value(PERTURBED) else solver


def _keep(waiting: list[Any], solver: Any) -> None:
    if len(waiting) < IDLE:
        waiting.append(solver)


class Pardiso:
    """Factorizes by MKL PARDISO. A pattern is analyzed once: factors that are no longer referenced leave their analysis
    to the next ones.
    """

    def __init__(self) -> None:
        self._idle: weakref.WeakKeyDictionary[Any, Idle] = weakref.WeakKeyDictionary()

    def __call__(self, A: SymmetricSparse | GeneralSparse, who: str) -> Factorization:
        """Raises SingularMatrix."""
        idle, complex_ = self._idle.setdefault(A.pattern, {}), np.iscomplexobj(A.data)
        if isinstance(A, GeneralSparse):
            return PardisoFactorization(A, who, COMPLEX_GENERAL if complex_ else GENERAL, idle)
        if complex_:
            return PardisoFactorization(A, who, COMPLEX_SYMMETRIC, idle)
        try:
            return PardisoFactorization(A, who, POSITIVE_DEFINITE, idle)
        except SingularMatrix:  # or not positive definite, as at an unstable state
            return PardisoFactorization(A, who, SYMMETRIC, idle)


@cache
def installed() -> bool:
    return importlib.util.find_spec("pymklpardiso") is not None


def start(rtol: float) -> Factorize:
    if not installed():
        raise InputError("linear solver pardiso: py-mkl-pardiso is not installed - pip install it or take superlu")
    return Pardiso()


def start_best(rtol: float) -> Factorize:
    """PARDISO where it is installed, else SuperLU."""
    return start(rtol) if installed() else superlu.start(rtol)


def takes(A: Any) -> bool:
    return isinstance(A, SymmetricSparse | GeneralSparse)


pardiso = LinearSolver("pardiso", start, takes)
auto = LinearSolver("auto", start_best, takes)
