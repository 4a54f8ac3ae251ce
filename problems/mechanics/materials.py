"""Stored energies W(F, q) per reference volume, written once in jax.numpy: F (3, 3) deformation gradient, q constants.

First Piola-Kirchhoff stress P = dW/dF and tangent moduli A = dP/dF follow by automatic differentiation; `numpy` holds
hand-derived ones. Every energy is zero and stress-free at F = I, and W(Q F) = W(F) for rotations Q (for the linear law
to first order). All are holomorphic, as complex steps require. LAWS lists them by name.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.jax64 import jnp
from gradient_routes.problems.mechanics.isotropic_functions import isochoric_powers
from gradient_routes.problems.mechanics.materials_numpy import MOONEY_RIVLIN, NEO_HOOKEAN, NumpyMaterial

Energy = Callable[[Any, Any], Any]
ALPHA = (1.3, 5.0, -2.0)  # Ogden 1972, of vulcanized rubber, with the mu_r beside it
MU = (0.63, 0.0012, -0.01)  # [MPa]


def det(F: Any) -> Any:
    """det F of a 3 x 3 array, as a triple product: holomorphic, and faster to differentiate in XLA."""
    return (F[0] * jnp.cross(F[1], F[2])).sum()


def nan_if_inverted(J: Any) -> Any:
    """0 for Re J > 0, else NaN with NaN derivatives: inverted elements are not admissible."""
    return jnp.where(jnp.real(J) > 0.0, 0.0, jnp.nan) * J


def log(J: Any) -> Any:
    """ln J, NaN for Re J <= 0 also if J is complex, where jnp.log is finite."""
    return jnp.log(J) + nan_if_inverted(J) if jnp.iscomplexobj(J) else jnp.log(J)


def lame(E: Any, nu: float) -> tuple[Any, Any]:
    """mu, lam [Pa] from Young's modulus and Poisson's ratio."""
    return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


def neo_hookean(F: Any, q: Any) -> Any:
    """W = mu/2 (tr F^T F - 3) - mu ln det F + lam/2 (ln det F)^2, q = (mu, lam) [Pa] (Bonet & Wood 2008, eq. 6.27)."""
    mu, lam = q
    ln_J = log(det(F))
    return mu / 2.0 * ((F * F).sum() - 3.0) - mu * ln_J + lam / 2.0 * ln_J**2


def cofactor(F: Any) -> Any:
    """cof F of a 3 x 3 array, rows as cross products, the fastest form to differentiate in XLA."""
    return jnp.stack([jnp.cross(F[1], F[2]), jnp.cross(F[2], F[0]), jnp.cross(F[0], F[1])])


def mooney_rivlin(F: Any, q: Any) -> Any:
    """W = c (J - 1)^2 - d ln J + c1 (I1 - 3) + c2 (I2 - 3), d = 2 (c1 + 2 c2), q = (c1, c2, c) [Pa], of C = F^T F.

    Small strains: mu = 2 (c1 + c2), lam = 2 c + 4 c2 (Holzapfel 2000, sec. 6.5, after Ciarlet & Geymonat 1982).
    """
    c1, c2, c = q
    J, cof = det(F), cofactor(F)
    I1, I2 = (F * F).sum(), (cof * cof).sum()
    J = J + nan_if_inverted(J)  # P contains no ln J and would be finite for J < 0
    return c * (J - 1.0) ** 2 - 2.0 * (c1 + 2.0 * c2) * log(J) + c1 * (I1 - 3.0) + c2 * (I2 - 3.0)


def volumetric(J: Any, kappa: Any) -> Any:
    """kappa/4 (J^2 - 1 - 2 ln J) (Simo & Taylor 1991): convex, infinite for J to 0 and J to infinity."""
    return kappa / 4.0 * (J**2 - 1.0 - 2.0 * log(J))


def yeoh(F: Any, q: Any) -> Any:
    """W = sum_i c_i (J^(-2/3) I1 - 3)^i + volumetric, i = 1 to 3, q = (c1, c2, c3, kappa) [Pa] (Yeoh 1993).

    Small strains: mu = 2 c1, bulk modulus kappa.
    """
    c1, c2, c3, kappa = q
    J = det(F)
    x = J ** (-2.0 / 3.0) * (F * F).sum() - 3.0
    return x * (c1 + x * (c2 + x * c3)) + volumetric(J, kappa)


def ogden(F: Any, q: Any) -> Any:
    """W = sum_r mu_r/alpha_r (sum_i lambar_i^alpha_r - 3) + volumetric, q = (mu1, mu2, mu3, kappa) [Pa] (Ogden 1972).

    lambar_i = J^(-1/3) lambda_i the isochoric principal stretches, alpha = (1.3, 5, -2) the exponents of that paper.
    Small strains: mu = sum_r mu_r alpha_r / 2, bulk modulus kappa. `isotropic_functions.py` states the accuracy of the
    powers; W is an isotropic energy with exact derivatives at any accuracy.
    """
    *mu, kappa = q
    J, cof = det(F), cofactor(F)
    powers = isochoric_powers((F * F).sum(), (cof * cof).sum(), J, ALPHA)
    W = volumetric(J, kappa)
    for mu_r, alpha, power in zip(mu, ALPHA, powers, strict=True):
        W = W + mu_r / alpha * (power - 3.0)
    return W


def linear(F: Any, q: Any) -> Any:
    """W = mu eps : eps + lam/2 (tr eps)^2 with eps the small strain, q = (mu, lam) [Pa]: linear elasticity."""
    mu, lam = q
    eps = (F + F.T) / 2.0 - jnp.eye(3)
    return mu * (eps * eps).sum() + lam / 2.0 * jnp.trace(eps) ** 2


@dataclass(frozen=True)
class MaterialLaw:
    """A stored energy W(F, q) with the properties of its constants q.

    name        as in selectors
    W           the energy
    constants   names of q
    positive    which constants must be > 0; this is not sufficient for a sound energy: with neo-Hookean's lam < 0
                (nu < 0), W has no lower bound for J to 0
    of_modulus  (E, nu) -> q with the small-strain moduli of Young's modulus E and Poisson's ratio nu, linear in E,
                which may be a number or an array of NumPy or jax.numpy, real or complex
    numpy       hand-derived derivatives in NumPy, if there are any
    """

    name: str
    W: Energy
    constants: tuple[str, ...]
    positive: tuple[bool, ...]
    of_modulus: Callable[[Any, float], tuple[Any, ...]]
    numpy: NumpyMaterial | None = None

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


LAWS: dict[str, MaterialLaw] = {
    law.name: law
    for law in (
        MaterialLaw("neo-hookean", neo_hookean, ("mu", "lam"), (True, False), lame, NEO_HOOKEAN),
        MaterialLaw("mooney-rivlin", mooney_rivlin, ("c1", "c2", "c"), (True,) * 3, mooney_rivlin_q, MOONEY_RIVLIN),
        MaterialLaw("yeoh", yeoh, ("c1", "c2", "c3", "kappa"), (True, False, True, True), yeoh_q),
        MaterialLaw("ogden", ogden, ("mu1", "mu2", "mu3", "kappa"), (True, True, False, True), ogden_q),
        MaterialLaw("linear", linear, ("mu", "lam"), (True, False), lame),
    )
}
