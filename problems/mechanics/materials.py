"""Laws of materials: the constants q of their stored energies W(H, q), and the hand-derived derivatives of some.

LAWS lists them by name. The energies themselves are in `energies`, which imports JAX: it is imported where one is used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.mechanics.arap_numpy import ARAP
from gradient_routes.problems.mechanics.materials_numpy import MOONEY_RIVLIN, NEO_HOOKEAN, NumpyMaterial

Energy = Callable[[Any, Any], Any]
ALPHA = (1.3, 5.0, -2.0)  # Ogden 1972, of vulcanized rubber, with the mu_r beside it
MU = (0.63, 0.0012, -0.01)  # [MPa]


def lame(E: Any, nu: float) -> tuple[Any, Any]:
    """mu, lam [Pa] from Young's modulus and Poisson's ratio."""
    return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


@dataclass(frozen=True)
class MaterialLaw:
    """A stored energy W(H, q) with the properties of its constants q.

    name        as in selectors
    constants   names of q
    positive    which constants must be > 0; this is not sufficient for a sound energy: with neo-Hookean's lam < 0
                (nu < 0), W has no lower bound for J to 0
    of_modulus  (E, nu) -> q with the small-strain moduli of Young's modulus E and Poisson's ratio nu, linear in E,
                which may be a number or an array of NumPy or jax.numpy, real or complex
    of_volume   (q without its last, nu) -> the last of q, so that Poisson's ratio at small strain is nu
    numpy       hand-derived derivatives in NumPy, if there are any
    energy      () -> W in jax.numpy, the same object at every call; None: the one of this name in `energies`
    """

    name: str
    constants: tuple[str, ...]
    positive: tuple[bool, ...]
    of_modulus: Callable[[Any, float], tuple[Any, ...]]
    of_volume: Callable[[Sequence[Any], float], Any]
    numpy: NumpyMaterial | None = None
    energy: Callable[[], Energy] | None = None

    @property
    def W(self) -> Energy:
        """The energy; JAX is imported here."""
        if self.energy is not None:
            return self.energy()
        from gradient_routes.problems.mechanics import energies

        energy: Energy = getattr(energies, self.name.replace("-", "_"))
        return energy

    def check(self, q: tuple[Any, ...]) -> None:
        """Raises InputError if a constant that must be positive is not."""
        for name, c, positive in zip(self.constants, q, self.positive, strict=True):
            lowest = float(np.min(np.real(c)))
            if positive and not lowest > 0.0:
                raise InputError(
                    f"{self.name}: {name} = {lowest:g} Pa, so the energy may have no lower bound"
                    f" - choose {name} > 0 (where E and nu set it, a larger nu)"
                )


def bulk(E: Any, nu: float) -> Any:
    """kappa = lam + 2 mu/3 [Pa]."""
    return E / (3.0 * (1.0 - 2.0 * nu))


def mooney_rivlin_q(E: Any, nu: float) -> tuple[Any, Any, Any]:
    """c1 = 0.4 mu, c2 = 0.1 mu, c = lam/2 - 0.2 mu.

    For nu <= 1/7, c <= 0; for c < 0 the energy has no lower bound, as c J^2 dominates c2 I2 ~ J^(4/3) for large J.
    Because lam = 2 c + 4 c2, no c2 > 0 admits nu <= 0. `MaterialLaw.check` refuses such constants.
    """
    mu, lam = lame(E, nu)
    return 0.4 * mu, 0.1 * mu, lam / 2.0 - 0.2 * mu


def yeoh_q(E: Any, nu: float) -> tuple[Any, Any, Any, Any]:
    """c1 = mu/2, c2 = -0.05 mu, c3 = 0.01 mu: softening, then stiffening, like rubber; W increases with I1."""
    mu, _ = lame(E, nu)
    return 0.5 * mu, -0.05 * mu, 0.01 * mu, bulk(E, nu)


def ogden_q(E: Any, nu: float) -> tuple[Any, Any, Any, Any]:
    """mu_r in the ratio of Ogden 1972; mu3 < 0, as mu_r alpha_r > 0 in every term."""
    mu, _ = lame(E, nu)
    scale = 2.0 * mu / sum(m * alpha for m, alpha in zip(MU, ALPHA, strict=True))
    return MU[0] * scale, MU[1] * scale, MU[2] * scale, bulk(E, nu)


def of_shear(modulus: Callable[[Any, float], Any], mu: Any, nu: float) -> Any:
    """lam or kappa [Pa] from the shear modulus and Poisson's ratio."""
    return modulus(2.0 * mu * (1.0 + nu), nu)


def second_lame(E: Any, nu: float) -> Any:
    """lam [Pa]."""
    return lame(E, nu)[1]


LAWS: dict[str, MaterialLaw] = {
    law.name: law
    for law in (
        MaterialLaw(
            "neo-hookean",
            ("mu", "lam"),
            (True, False),
            lame,
            lambda q, nu: of_shear(second_lame, q[0], nu),
            NEO_HOOKEAN,
        ),
        MaterialLaw(
            "mooney-rivlin",
            ("c1", "c2", "c"),
            (True,) * 3,
            mooney_rivlin_q,
            lambda q, nu: of_shear(second_lame, 2.0 * (q[0] + q[1]), nu) / 2.0 - 2.0 * q[1],
            MOONEY_RIVLIN,
        ),
        MaterialLaw(
            "yeoh",
            ("c1", "c2", "c3", "kappa"),
            (True, False, True, True),
            yeoh_q,
            lambda q, nu: of_shear(bulk, 2.0 * q[0], nu),
        ),
        MaterialLaw(
            "ogden",
            ("mu1", "mu2", "mu3", "kappa"),
            (True, True, False, True),
            ogden_q,
            lambda q, nu: of_shear(bulk, sum(m * a for m, a in zip(q, ALPHA, strict=True)) / 2.0, nu),
        ),
        MaterialLaw("linear", ("mu", "lam"), (True, False), lame, lambda q, nu: of_shear(second_lame, q[0], nu)),
        MaterialLaw("arap", ("mu", "lam"), (True, False), lame, lambda q, nu: of_shear(second_lame, q[0], nu), ARAP),
    )
}
