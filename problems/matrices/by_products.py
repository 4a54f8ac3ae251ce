"""A matrix that is given by its products."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class ByProducts:
    """A with forward(v) = A v and reverse(w) = A^T w."""

    forward: Callable[[Array], Any]
    reverse: Callable[[Array], Any]

    @property
    def T(self) -> ByProducts:
        return ByProducts(self.reverse, self.forward)

    def __matmul__(self, v: Array) -> Array:
        return np.asarray(self.forward(v))
