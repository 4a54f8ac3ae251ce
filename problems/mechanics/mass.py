"""Mass matrices of solids whose cells are parallelepipeds or straight tetrahedra, as those of a box are."""

from __future__ import annotations

from typing import Literal

import numpy as np

from gradient_routes.problems.fem.elements import Element, ElementName, Geometry
from gradient_routes.problems.problem import Array

Mass = Literal["consistent", "lumped"]
ORDER: dict[ElementName, int] = {"hex8": 2, "tet4": 2, "tet10": 4}  # of quadrature that integrates N_a N_b exactly


def nodal_shares(element: Element, kind: Mass) -> Array:
    """(n_a, n_a), the mean of N_a N_b over a cell; lumped: its diagonal, scaled to the sum 1, which is positive for all
    elements (Hinton, Rock & Zienkiewicz 1976).
    """
    from skfem.quadrature import get_quadrature

    xi, w = get_quadrature(element.basis.refdom, ORDER[element.name])
    N, _ = element.shape_functions(np.asarray(xi))
    share = np.einsum("q,qa,qb->ab", w / w.sum(), N, N)
    return np.diag(np.diag(share) / np.trace(share)) if kind == "lumped" else np.asarray(share)


def element_masses(geometry: Geometry, density: float, kind: Mass) -> Array:
    """(n_e, n_a, n_a) [kg], the same for every component."""
    volumes = geometry.metric[1].sum(axis=1)
    return np.asarray(density * volumes[:, None, None] * nodal_shares(geometry.element, kind))
