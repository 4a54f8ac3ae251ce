"""What the backward march needs of some steps in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array, Linearization, Operator


@dataclass(frozen=True)
class Rates:
    """J (k,) of k steps and their partial derivatives.

    J_u (k, n), J_p (k, n_p)
    by_p  lam (k, n) -> R_p^T lam of every step by itself, (k, n_p)
    R_p   (k n, n_p), where it is known as an operator
    """

    J: Array
    J_u: Array
    J_p: Array
    by_p: Callable[[Array], Array]
    R_p: Operator | None = None

    @property
    def single(self) -> Linearization:
        """Of one step."""
        assert self.R_p is not None
        (J_u,), (J_p,) = self.J_u, self.J_p
        return Linearization(self.R_p, J_u, J_p)


class Stacked:
    """Operators with n rows each, the last with as many or fewer, one below the other."""

    def __init__(self, blocks: Sequence[Operator], n: int, transposed: bool = False) -> None:
        self.blocks, self.n, self.transposed = blocks, n, transposed

    @property
    def T(self) -> Stacked:
        return Stacked(self.blocks, self.n, not self.transposed)

    def __matmul__(self, x: Array) -> Any:
        if self.transposed:
            parts = (x[i * self.n : (i + 1) * self.n] for i in range(len(self.blocks)))
            return sum(block.T @ part for block, part in zip(self.blocks, parts, strict=True))
        return np.concatenate([block @ x for block in self.blocks])

    def each_transposed(self, lam: Array) -> Array:
        """block^T lam of every block, (k, n_p), from lam (k, n)."""
        return np.stack([block.T @ part for block, part in zip(self.blocks, lam, strict=True)])
