"""As rigid as possible: W = mu |F - R|^2 + lam/2 (J - 1)^2 and its derivatives in NumPy, R the rotation of F = R U.

At small strain mu and lam are those of linear elasticity. With dR = R [w]x, (tr U I - U) w = axial(R^T dF - dF^T R),

    P = 2 mu (F - R) + lam (J - 1) J G,    dR_iJ/dF_kL = B_iJn (tr U I - U)^-1_nr B_kLr,    B_iJn = R_iM eps_MJn
"""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.mechanics.materials_numpy import (
    IDENTITY,
    ComponentsFirst,
    Constants,
    Kinematics,
    add_in_rows,
    cofactor,
    det,
    dyad,
    inner,
    kinematics,
    numpy_material,
    product,
    swapped,
    trace,
)
from gradient_routes.problems.problem import Array

AT_MOST, CLOSE = 40, 1e-8  # see `polar`
LEVI_CIVITA = np.array([[[(i - j) * (j - k) * (k - i) / 2.0 for k in range(3)] for j in range(3)] for i in range(3)])


def rotation(F: Array) -> Array:
    """R (3, 3, m) of F, det F > 0 (Higham 1986: X <- (X + X^-T) / 2 from F)."""
    X, change = F, np.inf
    for _ in range(AT_MOST):
        if not change > CLOSE:
            break
        new = (X + cofactor(X) / det(X)) / 2.0
        X, change = new, np.nanmax(np.abs(new - X), initial=0.0)
    return np.asarray((X + cofactor(X) / det(X)) / 2.0)


def split(k: Kinematics) -> tuple[Array, Array, Array]:
    """R, U, and S = U - I = (U + I)^-1 2 E, which has all digits of the strain E."""
    R = rotation(k.F)
    U = product(R.swapaxes(0, 1), k.F)
    V = U + IDENTITY
    return R, U, product(cofactor(V).swapaxes(0, 1) / det(V), 2.0 * k.E)


def by_rotation(U: Array) -> Array:
    """(tr U I - U)^-1, symmetric."""
    Y = trace(U) * IDENTITY - U
    return np.asarray(cofactor(Y) / det(Y))


def arap_W(H: Array, q: Constants) -> Array:
    """W = mu S : S + lam/2 (J - 1)^2, q = (mu, lam) [Pa]."""
    (mu, lam), k = q, kinematics(H)
    S = split(k)[2]
    return np.asarray(mu * inner(S, S) + lam / 2.0 * k.j**2)


def arap_P(H: Array, q: Constants) -> Array:
    """P = 2 mu R S + lam (J - 1) J G."""
    (mu, lam), k = q, kinematics(H)
    R, _, S = split(k)
    return np.asarray(2.0 * mu * product(R, S) + lam * k.j * (1.0 + k.j) * k.G)


def arap_A(H: Array, q: Constants) -> Array:
    """A_iJkL = 2 mu (1_ik 1_JL - dR_iJ/dF_kL) + lam J ((2 J - 1) G_iJ G_kL - (J - 1) G_iL G_kJ)."""
    (mu, lam), k = q, kinematics(H)
    (R, U, _), J = split(k), 1.0 + k.j
    B = np.einsum("iMm,MJn->iJnm", R, LEVI_CIVITA)
    A = np.einsum("iJnm,kLnm->iJkLm", B, -2.0 * mu * np.einsum("nrm,kLrm->kLnm", by_rotation(U), B))
    A += dyad(lam * J * (2.0 * J - 1.0) * k.G, k.G)
    A -= swapped(dyad(lam * J * k.j * k.G, k.G))
    add_in_rows(A, 2.0 * mu * IDENTITY)
    return np.asarray(A)


def arap_dP(H: Array, dH: Array, q: Constants) -> Array:
    """A dH, term by term as in A."""
    (mu, lam), k = q, kinematics(H)
    (R, U, _), J = split(k), 1.0 + k.j
    B = np.einsum("iMm,MJn->iJnm", R, LEVI_CIVITA)
    w = np.einsum("nrm,rm->nm", by_rotation(U), np.einsum("kLrm,kLm->rm", B, dH))
    turned = product(k.G, product(dH.swapaxes(0, 1), k.G))
    of_volume = lam * J * ((2.0 * J - 1.0) * inner(k.G, dH) * k.G - k.j * turned)
    return np.asarray(2.0 * mu * (dH - np.einsum("iJnm,nm->iJm", B, w)) + of_volume)


def arap_P_q(H: Array, q: Constants) -> Array:
    """dP/dmu = 2 R S, dP/dlam = (J - 1) J G."""
    k = kinematics(H)
    R, _, S = split(k)
    return np.stack([2.0 * product(R, S), k.j * (1.0 + k.j) * k.G])


ARAP = numpy_material(ComponentsFirst(arap_W, arap_P, arap_A, arap_P_q, arap_dP), n_q=2)
