"""READ THIRD. What a linear solver is: a value with a name, and the factorization it makes of a matrix."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from gradient_routes.problems.problem import Array


class Factorization(ABC):
    """A matrix A (n_u, n_u) that is ready to be solved with.

    name    the method, for tables
    norm    |A|_inf, or an upper bound of it

    Law: A @ solve(b) == b and A.T @ solve_transposed(b) == b, to rounding or to the tolerance of an iteration.
    """

    name: str
    norm: float

    @property
    @abstractmethod
    def nbytes(self) -> int:
        """Bytes of the factors, or of what an iteration keeps."""

    @abstractmethod
    def substitute(self, b: Array, transposed: bool) -> Array:
        """A^{-1} b (n_u,), or A^{-T} b. An iteration raises NotConverged."""

    def solve(self, b: Array) -> Array:
        """A^{-1} b (n_u,)."""
        return self.substitute(b, transposed=False)

    def solve_transposed(self, b: Array) -> Array:
        """A^{-T} b (n_u,)."""
        return self.substitute(b, transposed=True)

    def to(self, rtol: float) -> Factorization:
        """The same matrix, solved to |b - A x|_inf <= rtol |b|_inf where the solver iterates."""
        return self

    @property
    def negative_eigenvalues(self) -> int | None:
        """How many eigenvalues of a real symmetric A are negative, by Sylvester's law of inertia; None: unknown."""
        return None


Factorize = Callable[[Any, str], Factorization]


@dataclass(frozen=True)
class LinearSolver:
    """How systems with R_u are solved. Register one by an entry point of the group `gradient_routes.solvers`.

    name      as `--linear-solver` takes it, the same as that of the entry point
    start     (rtol) -> factorize, and factorize(A, who) -> Factorization; `start` is called once a model, so that
              analyses of patterns can be kept between matrices. Raises InputError where a package is not installed;
              factorize raises SingularMatrix, and InputError for matrices that are not of the solver's kind
    takes     (A) -> whether matrices of this type are given to it; all others are solved by LAPACK, SuperLU or the
              recurrences of a tridiagonal matrix
    iterates  solutions are exact to a tolerance, not to rounding
    factors   a factorization is expensive to make and cheap to solve with, so that it pays to keep it as a
              preconditioner; False: each solve starts from nothing but A
    gradual   an iteration lowers the error by about the same factor every time, also on few unknowns
    """

    name: str
    start: Callable[[float], Factorize]
    takes: Callable[[Any], bool]
    iterates: bool = False
    factors: bool = True
    gradual: bool = False
