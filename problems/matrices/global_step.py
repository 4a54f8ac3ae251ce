"""The constant matrix of a global step: a scalar for every node, and the stiffness of what a body touches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from gradient_routes.problems.matrices.sparse import SymmetricSparse
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class GlobalStep:
    """S = A x I_d + E diag(k(u)) E^T, (n, n), of nodes whose d unknowns are all free.

    A (n/d, n/d)    constant
    at (m,)         the unknowns that E picks
    stiffness       u (n,) -> k (m,)
    """

    A: SymmetricSparse
    d: int
    at: Array
    stiffness: Callable[[Array], Array]
