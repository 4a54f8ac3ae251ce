"""Stored energies W(H, q) per reference volume, written once in jax.numpy: H = grad u (3, 3), q constants.

First Piola-Kirchhoff stress P = dW/dF and tangent moduli A = dP/dF, F = I + H, follow by automatic differentiation.
Every energy is zero and stress-free at H = 0, and invariant to rotations (the linear law to first order). All are
holomorphic, as complex steps require.

The stress of a strain of 1e-14 has all its digits, because nothing is formed as a difference of numbers near 1: the
invariants of C = F^T F are replaced by what they exceed their values at F = I, and W has no terms of first order that
would cancel in P.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.mechanics.isotropic_functions import isochoric_powers
from gradient_routes.problems.mechanics.materials import ALPHA
from gradient_routes.problems.mechanics.polar import distance


def without_linear_part(f: Callable[[Any], Any], slope: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """f(j) = O(j^2) with its derivative `slope`, which differentiating f term by term would round to eps, not eps j."""
    exact = jax.custom_jvp(f)
    exact.defjvps(lambda dj, value, j: slope(j) * dj)
    return exact


log_part = without_linear_part(lambda j: j - jnp.log1p(j), lambda j: j / (1.0 + j))


def power_part(s: float) -> Callable[[Any], Any]:
    """(1 + j)^s - 1 - s j."""
    return without_linear_part(
        lambda j: jnp.expm1(s * jnp.log1p(j)) - s * j, lambda j: s * jnp.expm1((s - 1.0) * jnp.log1p(j))
    )


def det(H: Any) -> Any:
    """The determinant of a 3 x 3 array, as a triple product: holomorphic, and faster to differentiate in XLA."""
    return (H[0] * jnp.cross(H[1], H[2])).sum()


def kinematics(H: Any) -> tuple[Any, Any]:
    """j = J - 1 = tr H + ((tr H)^2 - H : H^T)/2 + det H, and x = I1 - 3 - 2 j = O(H^2), I1 = tr C.

    NaN with NaN derivatives where Re J <= 0: inverted elements are not admissible.
    """
    tr, HH, det_H = jnp.trace(H), (H * H.T).sum(), det(H)
    j = tr + (tr**2 - HH) / 2.0 + det_H
    j = jnp.where(jnp.real(j) > -1.0, 0.0, jnp.nan) * j + j
    return j, (H * H).sum() + HH - tr**2 - 2.0 * det_H


def second(H: Any, x: Any) -> Any:
    """y = I2 - 3 - 4 j = 2 x + 2 ((tr E)^2 - E : E) = O(H^2), with Green's strain E = sym H + H^T H/2."""
    E = (H + H.T + H.T @ H) / 2.0
    return 2.0 * (x + jnp.trace(E) ** 2 - (E * E).sum())


def neo_hookean(H: Any, q: Any) -> Any:
    """W = mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2, q = (mu, lam) [Pa] (Bonet & Wood 2008, eq. 6.27)."""
    mu, lam = q
    j, x = kinematics(H)
    return mu * (x / 2.0 + log_part(j)) + lam / 2.0 * jnp.log1p(j) ** 2


def mooney_rivlin(H: Any, q: Any) -> Any:
    """W = c (J - 1)^2 - d ln J + c1 (I1 - 3) + c2 (I2 - 3), d = 2 (c1 + 2 c2), q = (c1, c2, c) [Pa], of C = F^T F.

    Small strains: mu = 2 (c1 + c2), lam = 2 c + 4 c2 (Holzapfel 2000, sec. 6.5, after Ciarlet & Geymonat 1982).
    """
    c1, c2, c = q
    j, x = kinematics(H)
    return c * j**2 + 2.0 * (c1 + 2.0 * c2) * log_part(j) + c1 * x + c2 * second(H, x)


def volumetric(j: Any, kappa: Any) -> Any:
    """kappa/4 (J^2 - 1 - 2 ln J) (Simo & Taylor 1991): convex, infinite for J to 0 and J to infinity."""
    return kappa / 4.0 * (j**2 + 2.0 * log_part(j))


J_TO_2_3, J_TO_4_3 = power_part(2.0 / 3.0), power_part(4.0 / 3.0)


def isochoric(j: Any, x: Any) -> Any:
    """J^(-2/3) I1 - 3."""
    return jnp.exp(-2.0 / 3.0 * jnp.log1p(j)) * (x - 3.0 * J_TO_2_3(j))


def yeoh(H: Any, q: Any) -> Any:
    """W = sum_i c_i (J^(-2/3) I1 - 3)^i + volumetric, i = 1 to 3, q = (c1, c2, c3, kappa) [Pa] (Yeoh 1993).

    Small strains: mu = 2 c1, bulk modulus kappa.
    """
    c1, c2, c3, kappa = q
    j, x = kinematics(H)
    i1 = isochoric(j, x)
    return i1 * (c1 + i1 * (c2 + i1 * c3)) + volumetric(j, kappa)


def ogden(H: Any, q: Any) -> Any:
    """W = sum_r mu_r/alpha_r (sum_i lambar_i^alpha_r - 3) + volumetric, q = (mu1, mu2, mu3, kappa) [Pa] (Ogden 1972).

    lambar_i = J^(-1/3) lambda_i the isochoric principal stretches, alpha = (1.3, 5, -2) the exponents of that paper.
    Small strains: mu = sum_r mu_r alpha_r / 2, bulk modulus kappa. `isotropic_functions.py` states the accuracy of the
    powers; W is an isotropic energy with exact derivatives at any accuracy.
    """
    *mu, kappa = q
    j, x = kinematics(H)
    i2 = jnp.exp(-4.0 / 3.0 * jnp.log1p(j)) * (second(H, x) - 3.0 * J_TO_4_3(j))  # J^(-4/3) I2 - 3
    W = volumetric(j, kappa)
    for mu_r, alpha, power in zip(mu, ALPHA, isochoric_powers(isochoric(j, x), i2, ALPHA), strict=True):
        W = W + mu_r / alpha * (power - 3.0)
    return W


def linear(H: Any, q: Any) -> Any:
    """W = mu eps : eps + lam/2 (tr eps)^2 with eps the small strain, q = (mu, lam) [Pa]: linear elasticity."""
    mu, lam = q
    eps = (H + H.T) / 2.0
    return mu * (eps * eps).sum() + lam / 2.0 * jnp.trace(eps) ** 2


def arap(H: Any, q: Any) -> Any:
    """W = mu |F - R|^2 + lam/2 (J - 1)^2, R the rotation of F, q = (mu, lam) [Pa] (Bouaziz et al. 2014, sec. 5.1).

    As rigid as possible, with the moduli of linear elasticity at small strain.
    """
    mu, lam = q
    return mu * distance(H) + lam / 2.0 * kinematics(H)[0] ** 2
