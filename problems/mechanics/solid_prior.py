"""Phi of a solid: neighbours are cells that share a facet, and adjacent layers."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from gradient_routes.problems.data.regularization import Phi, Prior
from gradient_routes.problems.mechanics.design_variables import CELLWISE, FIELDS, MODULI
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.problem import Array, Parameters


def prior_of(alpha: float, o: SimpleNamespace, solid: LoadedSolid, parameters: Parameters, theta: Array) -> Prior:
    """alpha Phi of the options `o`; theta (n_p,) is the regularized quantity at the start. Raises InputError."""
    kind: Phi = o.phi or ("tikhonov" if o.unknown in FIELDS else "amplitude")
    f2t = solid.mesh.skfem_mesh.f2t
    pairs = np.asarray(f2t.T[f2t[1] != -1]) if o.unknown in CELLWISE else None
    n, scale = len(parameters), parameters.scale.copy()
    if solid.springs is not None:  # k has no neighbours, and no prior
        n -= solid.springs.count
        pairs = np.stack([np.arange(1, n), np.arange(n - 1)], axis=1) if o.unknown == "layers" else pairs
        scale[n:] = np.inf
    prior = Prior(alpha, kind, o.phi_width, pairs, parameters.start, scale)
    if kind == "amplitude" and o.unknown in MODULI:
        prior = replace(prior, origin=theta, scale=np.where(np.isinf(scale), scale, 1.0))
    prior.check(solid.mesh.who)
    return prior
