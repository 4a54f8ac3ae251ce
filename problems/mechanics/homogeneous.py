"""Homogeneous states of rubber specimens: F = diag(lambda, ..) by the mode of loading, stress by the stored energy.

mode          F                      free of stress    no change of volume
uniaxial      diag(lambda, t, t)     2 and 3           t = lambda^(-1/2)
equibiaxial   diag(lambda, lambda, t)   3              t = lambda^-2
shear         diag(lambda, 1, t)        3              t = 1/lambda       (pure shear: planar tension of a wide strip)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class Mode:
    """H = F - I = (lambda - 1) `stretched` + (t - 1) `thinned` on its diagonal; t = lambda^exponent at J = 1."""

    stretched: tuple[float, float, float]
    thinned: tuple[float, float, float]
    exponent: float


MODES: Mapping[str, Mode] = {
    "uniaxial": Mode((1.0, 0.0, 0.0), (0.0, 1.0, 1.0), -0.5),
    "equibiaxial": Mode((1.0, 1.0, 0.0), (0.0, 0.0, 1.0), -2.0),
    "shear": Mode((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), -1.0),
}


@dataclass(frozen=True, eq=False)
class States:
    """m specimens: stretched (m, 3) holds (lambda - 1) times the directions of the mode, thinned (m, 3) them alone.

    isochoric (m,) is t - 1 at J = 1.
    """

    stretch: Array
    stretched: Array
    thinned: Array
    isochoric: Array

    @classmethod
    def of(cls, modes: Sequence[str], stretch: Array) -> States:
        each = [MODES[mode] for mode in modes]
        along = np.array([mode.stretched for mode in each]) * (stretch - 1.0)[:, None]
        exponent = np.array([mode.exponent for mode in each])
        thinned = np.array([mode.thinned for mode in each])
        return cls(stretch, along, thinned, np.expm1(exponent * np.log(stretch)))

    def strains(self, thinning: Any) -> Any:
        """The diagonal of H, (m, 3), where t - 1 is `thinning` (m,)."""
        return self.stretched + self.thinned * thinning[:, None]
