"""The global step of projective methods: one constant matrix in place of M + c K(u), a scalar for every node.

    S = A x I_d + E diag(k(u)) E^T,    A = M + c sum over points of (2 mu + 3/2 lam) grad N . grad N dx

K of mu |F - R|^2 is at most 2 mu times the Laplacian, that of lam/2 (J - 1)^2 at small strain 3 lam times, which a
dilation reaches: 2 S exceeds M + c K, so that plain sweeps converge there. The stiffness k of what a body touches is
exact: E picks the unknowns `at`. Bouaziz et al. 2014; Du et al. 2021, DiffPD.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gradient_routes.problems.matrices.global_step import GlobalStep
from gradient_routes.problems.matrices.sparse import SymmetricPattern
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.problem import Array


def global_step(
    solid: LoadedSolid,
    p: Array,
    c: float,
    masses: Array | float,
    at: Array,
    stiffness: Callable[[Array], Array],
) -> GlobalStep:
    """Of the law arap in one load case, with masses (n_e, n_a, n_a) [kg] of the cells."""
    geometry, d = solid.mesh.geometry, solid.mesh.geometry.dim
    first, (mu, lam), (dN, dx) = solid.bc.index[0, :, 0], solid.setup(p).q, geometry.metric
    dofs = np.where(first < solid.bc.n_free, first // d, -1)[geometry.nodes]
    w = (2.0 * mu + 1.5 * lam)[..., None] * dx if np.ndim(mu) else (2.0 * mu + 1.5 * lam) * dx
    if len(dN) == 1:
        laplacian = np.einsum("eq,qab->eab", w, np.einsum("qaj,qbj->qab", dN[0], dN[0]))
    else:
        laplacian = np.einsum("eq,eqaj,eqbj->eab", w, dN, dN)
    i, j = np.triu_indices(dofs.shape[1])
    pattern = SymmetricPattern.of_elements(dofs, solid.bc.n_free // d)
    return GlobalStep(pattern.assemble((masses + c * laplacian)[:, i, j]), d, at, stiffness)
