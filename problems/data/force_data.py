"""Forces on faces at known displacements, as data: they tell the size of moduli, which displacements do not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.mechanics.reaction import Reaction
from gradient_routes.problems.problem import Array

DEFAULT_NOISE = 0.01  # of the largest force, and of displacements whose noise is unknown


@dataclass(frozen=True, eq=False)
class ForceData:
    """One datum in each load case k: w (F(u, p) - F_k).

    F (cases,)  [N]
    weight      w [m/N], the noise of displacements over that of forces
    """

    reaction: Reaction
    F: Array
    weight: float

    def single_case(self, case: int) -> ForceData:
        """Of one load case."""
        reaction = replace(self.reaction, solid=self.reaction.solid.single_case(case))
        return replace(self, reaction=reaction, F=self.F[case : case + 1])

    def residuals(self, u: Any, p: Any, xp: Any = np) -> list[Any]:
        """[m], one of every case."""
        return [self.weight * (self.reaction.value(u, p, case, xp) - F) for case, F in enumerate(self.F)]

    def misfit_gradient(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Derivatives of 1/2 |residuals|^2 by u (n_u,) and p (n_p,)."""
        r = np.array(self.residuals(u, p))
        by_u, by_p = self._derivatives(u, p)
        return r @ by_u, r @ by_p

    def _derivatives(self, u: Array, p: Array) -> tuple[Array, Array]:
        """Of the residuals, (cases, n_u) and (cases, n_p)."""
        cases = range(len(self.F))
        by_u = np.stack([self.reaction.by_u(u, p, case) for case in cases])
        return self.weight * by_u, self.weight * np.stack([self.reaction.by_p(u, p, case) for case in cases])

    def beside(self, seen: Observation, u: Array, p: Array) -> Observation:
        """The displacements seen, and the forces after them; these have no position."""
        from scipy import sparse

        m, data = len(seen.data), self.weight * self.F
        by_u, by_p = self._derivatives(u, p)
        S_p = sparse.csr_array((m, len(p))) if seen.S_p is None else sparse.csr_array(seen.S_p)
        assert seen.position is not None
        nowhere = np.full((len(data), seen.position.shape[1]), np.nan)
        return replace(
            seen,
            predicted=np.concatenate([seen.predicted, data + np.array(self.residuals(u, p))]),
            data=np.concatenate([seen.data, data]),
            S_u=sparse.vstack([seen.S_u, sparse.csr_array(by_u)], format="csr"),
            S_p=sparse.vstack([S_p, sparse.csr_array(by_p)], format="csr"),
            relative=np.concatenate([np.broadcast_to(seen.relative, m), np.full(len(data), self.weight)]),
            label=lambda k: seen.label(k) if k < m else self._label(k - m),
            position=np.concatenate([seen.position, nowhere]),
            quantity=None
            if seen.quantity is None
            else np.append(seen.quantity, [self._label(k) for k in range(len(data))]),
        )

    def _label(self, k: int) -> str:
        return f"force, case {k + 1}" if len(self.F) > 1 else "force"
