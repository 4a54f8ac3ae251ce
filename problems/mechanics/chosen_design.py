"""The design variables of a solid that the option `unknown` names, and all that stays as it is beside them."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np

from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics import design_variables
from gradient_routes.problems.mechanics.constants import Constants
from gradient_routes.problems.mechanics.design_variables import AnyDesign, DesignVariables, Setup
from gradient_routes.problems.mechanics.loading import Loading
from gradient_routes.problems.mechanics.supports import Supports

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.materials import MaterialLaw

UNIT_MODULUS = 1.0  # [Pa], where none is given


def base_of(o: SimpleNamespace, mesh: Mesh, law: MaterialLaw, loading: Loading, measured: bool) -> Setup:
    """Everything that p does not set: a field of moduli, uniform where data are `measured` or the modulus is given."""
    field = design_variables.default_modulus(mesh.normalized(mesh.geometry.centres))
    E = np.full_like(field, o.modulus or UNIT_MODULUS) if measured or o.modulus else field
    return Setup(law.of_modulus(E, o.nu), mesh.geometry.X, np.float64(loading.amplitude))


def design_of(
    o: SimpleNamespace,
    log: bool,
    mesh: Mesh,
    law: MaterialLaw,
    base: Setup,
    supports: Supports,
    loading: Loading,
    constants: Constants | None,
) -> DesignVariables:
    """p of the options `o`, with the stiffness of springs beside it; log: whether moduli are by their logarithm.

    Raises InputError.
    """
    E, uniform = o.modulus or UNIT_MODULUS, o.data is not None or o.modulus is not None
    choices: dict[AnyDesign, Callable[[], DesignVariables]] = {
        "modulus": lambda: design_variables.moduli(mesh, law, o.nu, log, uniform, E),
        "layers": lambda: design_variables.layers(mesh, law, o.nu, log, uniform, E, o.layers),
        "regions": lambda: design_variables.regions(mesh, law, o.nu, log, uniform, E),
        "thickness": lambda: design_variables.thicknesses(mesh, base.q, log, uniform),
        "constants": lambda: constants.design(mesh, law, o.nu, E),  # type: ignore[union-attr]
        "traction": lambda: design_variables.tractions(
            mesh, supports.loaded, loading.amplitude * loading.directions[0]
        ),
        "shape": lambda: design_variables.shape(mesh, o.surface, supports.nodes),
        "load": lambda: design_variables.amplitude(o.load, loading.amplitude, loading.unit),
    }
    design = choices[o.unknown]()
    return design if supports.springs is None else supports.springs.beside(design, E / mesh.diameter)
