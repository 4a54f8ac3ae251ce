"""Stored energies W(F, q) per reference volume, written once in jax.numpy: F (3, 3) deformation gradient, q constants.

First Piola-Kirchhoff stress P = dW/dF and tangent moduli A = dP/dF follow by automatic differentiation, or by hand
where `hand` gives them in NumPy. Every energy is zero and stress-free at F = I, and W(Q F) = W(F) for rotations Q
(the small-strain one only to first order).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from problems.jax64 import jnp

Energy = Callable[[Any, Any], Any]


def det(F: Any) -> Any:
    """det F of a 3 x 3 array, component by component: holomorphic and cheap to differentiate."""
    return (
        F[0, 0] * (F[1, 1] * F[2, 2] - F[1, 2] * F[2, 1])
        - F[0, 1] * (F[1, 0] * F[2, 2] - F[1, 2] * F[2, 0])
        + F[0, 2] * (F[1, 0] * F[2, 1] - F[1, 1] * F[2, 0])
    )


def lame(E: Any, nu: float) -> tuple[Any, Any]:
    """mu, lam [Pa] from Young's modulus and Poisson's ratio."""
    return E / (2.0 * (1.0 + nu)), E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))


def neo_hookean(F: Any, q: Any) -> Any:
    """W = mu/2 (tr F^T F - 3) - mu ln det F + lam/2 (ln det F)^2, q = (mu, lam) [Pa] (Bonet & Wood 2008, eq. 6.27)."""
    mu, lam = q
    ln_J = jnp.log(det(F))
    return mu / 2.0 * ((F * F).sum() - 3.0) - mu * ln_J + lam / 2.0 * ln_J**2


def linear(F: Any, q: Any) -> Any:
    """W = mu eps : eps + lam/2 (tr eps)^2 with eps the small strain, q = (mu, lam) [Pa]: the linear baseline."""
    mu, lam = q
    eps = (F + F.T) / 2.0 - jnp.eye(3)
    return mu * (eps * eps).sum() + lam / 2.0 * jnp.trace(eps) ** 2
