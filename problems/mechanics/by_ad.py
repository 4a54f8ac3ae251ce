"""R, R_u and R_p of a solid by automatic differentiation of its potential."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.fem.assembly_jax import CompiledResidual
from gradient_routes.problems.problem import Array, Operator
from gradient_routes.problems.programs import program, shared

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid


class ByAd:
    """Compiled once for all solids with the same potential; for u and p that are real, or one of them complex."""

    def __init__(self, solid: LoadedSolid) -> None:
        self._solid = solid

    def residual(self, u: Array, p: Array) -> Array:
        kernels, u, p = self._at(u, p)
        return kernels(u, p)

    def R_u(self, u: Array, p: Array) -> Operator:
        kernels, u, p = self._at(u, p)
        return kernels.R_u(u, p)

    def R_p(self, u: Array, p: Array) -> Operator:
        kernels, u, p = self._at(u, p)
        return kernels.R_p(u, p)

    def _at(self, u: Array, p: Array) -> tuple[CompiledResidual, Array, Array]:
        if np.iscomplexobj(u) or np.iscomplexobj(p):
            return self._of_complex, u.astype(complex, copy=False), p.astype(complex, copy=False)
        return self.of_real, u, p

    @cached_property
    def of_real(self) -> CompiledResidual:
        return self._of(float)

    @cached_property
    def _of_complex(self) -> CompiledResidual:
        return self._of(complex)

    def _of(self, kind: type) -> CompiledResidual:
        solid = self._solid
        at: Any = np.zeros(solid.bc.n_u, kind), solid.design.parameters.start.astype(kind)
        g = program(solid.follower_residual, *at) if solid.load == "follower" else None
        return shared(CompiledResidual, "solid", program(solid.potential, *at), g)
