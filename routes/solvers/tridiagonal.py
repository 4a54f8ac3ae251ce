"""Chains of springs solved by cumulative sums in O(N), the last node free, on a spring or held by a multiplier."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.tridiagonal import Bordered, Chain, cumulative_sum
from gradient_routes.problems.problem import Array
from gradient_routes.routes.solvers.solver import Factorization


class ChainFactorization(Factorization):
    """B^T D B is its own factorization: its inverse is B^{-1} D^{-1} B^{-T}, two cumulative sums.

    With a spring k behind the last node, the correction of rank one (Sherman & Morrison 1950) is written as the force
    t = b_N - k u_N in the last element: no difference of large numbers, however stiff the spring.
    """

    name = "cumulative sums"

    def __init__(self, K: Chain, who: str) -> None:
        check_positive(K.D, who)
        self.D, self.tip = K.D, K.tip
        self.norm = K.norm

    @property
    def nbytes(self) -> int:
        return self.D.nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        if not self.tip:
            forces = cumulative_sum(b[::-1])[::-1]  # B^{-T} b: what hangs behind each element
            return cumulative_sum(forces / self.D)
        h, w_N, C = hung(self.D, b)
        t = (b[-1] - self.tip * w_N) / (1.0 + self.tip * C)
        return stretched(self.D, h, t, (w_N + C * b[-1]) / (1.0 + self.tip * C))

    @property
    def negative_eigenvalues(self) -> int | None:
        """The spring adds k e e^T to a positive definite matrix: one if k is below the -1/C of the chain, else none."""
        if np.iscomplexobj(self.D) or np.iscomplexobj(self.tip):
            return None
        return int(1.0 + self.tip * (1.0 / self.D).sum() < 0.0)


class BorderedFactorization(Factorization):
    """L D L^T of a chain with a multiplier on its last node: the nodes before it one by one, then those two at once.

    Their 2 x 2 pivot [[1/C + c, 1], [1, 0]], C the compliance of the whole chain, has the determinant -1: it is regular
    and has the one negative eigenvalue. Inactive, the pivots are those of the chain and -1/c.
    """

    name = "cumulative sums, L D L^T"

    def __init__(self, A: Bordered, who: str) -> None:
        check_positive(A.D, who)
        self.D, self.c, self.active = A.D, A.c, A.active
        self.norm = A.norm

    @property
    def nbytes(self) -> int:
        return self.D.nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        if not self.active:
            forces = cumulative_sum(b[-2::-1])[::-1]
            return np.concatenate([cumulative_sum(forces / self.D), -self.c * b[-1:]])
        u_N = b[-1]
        h, w_N, C = hung(self.D, b[:-1])
        t = (u_N - w_N) / C
        return np.append(stretched(self.D, h, t, u_N), b[-2] - self.c * u_N - t)

    @property
    def negative_eigenvalues(self) -> int | None:
        """That of the multiplier, active or not."""
        return None if np.iscomplexobj(self.D) else 1


def check_positive(D: Array, who: str) -> None:
    bad = np.flatnonzero(~(D.real > 0))
    if bad.size:
        e = int(bad[0])
        raise SingularMatrix(f"{who}: stiffness {D[e]:g} of element {e + 1} is not positive - check its modulus")


def hung(D: Array, b: Array) -> tuple[Array, Array, Array]:
    """Of all loads b (N,) but b_N: forces h (N,) in the elements, the displacement of the last node; C = sum 1 / D."""
    h = np.append(cumulative_sum(b[-2::-1])[::-1], 0.0)
    return h, (h / D).sum(), (1.0 / D).sum()


def stretched(D: Array, h: Array, t: Array, u_N: Array) -> Array:
    """Displacements (N,) under element forces h + t; the last is known better than by their sum."""
    u = cumulative_sum((h + t) / D)
    u[-1] = u_N
    return u
