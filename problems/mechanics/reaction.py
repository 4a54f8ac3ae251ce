"""The force that holds a face where displacements are prescribed, and its derivatives.

    F(u, p) = e . f_int(u, p),     f_int = dPi/du at all nodes

with e the direction at the nodes of the face and 0 elsewhere.
F is linear in the stresses. At equilibrium it is the resultant on the face, whatever e is at the free nodes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.problem import Array

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid


@dataclass(frozen=True, eq=False)
class Reaction:
    """F [N] along e (n_nodes, d), in every load case for itself."""

    solid: LoadedSolid
    e: Array

    def value(self, u: Any, p: Any, case: int, xp: Any = np) -> Any:
        """Holomorphic; traceable with xp = jax.numpy."""
        if xp is not np:
            return self._traced(u, p, case)
        if self.solid.use_numpy:
            return self.solid.by_hand.reaction(u, p, case, self.e)
        return np.asarray(self._compiled[0](u, p, case))[()]

    def by_u(self, u: Array, p: Array, case: int) -> Array:
        """(n_u,)."""
        if self.solid.use_numpy:
            return self.solid.by_hand.reaction_by_u(u, p, case, self.e)
        return np.asarray(self._compiled[1](u, p, case))

    def by_p(self, u: Array, p: Array, case: int) -> Array:
        """(n_p,)."""
        if self.solid.use_numpy:
            return self.solid.by_hand.reaction_by_p(u, p, case, self.e)
        return np.asarray(self._compiled[2](u, p, case))

    def _traced(self, u: Any, p: Any, case: int) -> Any:
        return self.solid.internal_work(u, p, case, self.e)

    @cached_property
    def _compiled(self) -> tuple[Callable[..., Any], ...]:
        from gradient_routes.problems.jax64 import jax

        functions = self._traced, jax.grad(self._traced, 0), jax.grad(self._traced, 1)
        return tuple(jax.jit(f, static_argnums=2) for f in functions)
