"""Hand-derived derivatives of stored energies in NumPy: W -> P = dW/dF -> A = dP/dF, and dP/dq.

The formulas take the components first, F (3, 3, m) at m points, q numbers or (m,). The public functions take the points
first, F (..., 3, 3), and work in chunks that fit the cache. With G = F^-T,

    dJ/dF_kL = J G_kL,     dG_iJ/dF_kL = -G_iL G_kJ.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

POINTS_PER_CHUNK = 1000  # stays in cache; with a power of two, transposed arrays share few cache sets
IDENTITY = np.eye(3)[..., None]  # (3, 3, 1)
NEXT, PREVIOUS = [1, 2, 0], [2, 0, 1]  # cyclic indices

Constants = tuple[Any, ...]
Function = Callable[[Array, Constants], Array]


@dataclass(frozen=True)
class NumpyMaterial:
    """A stored energy W(F, q) and its derivatives in NumPy, real or complex, for F (..., 3, 3).

    q is a tuple of constants that broadcast against F.shape[:-2]; P (..., 3, 3) first Piola-Kirchhoff stress,
    A (..., 3, 3, 3, 3) with A[..., i, J, k, L] = dP_iJ/dF_kL, P_q a tuple of dP/dq (..., 3, 3), one per constant.
    Law: P = dW/dF, A = dP/dF, symmetric under (i, J) <-> (k, L); NaN for Re det F <= 0.
    """

    W: Function
    P: Function
    A: Function
    P_q: Callable[[Array, Constants], tuple[Array, ...]]


def at_points(f: Function, *shape: int) -> Function:
    """Turns f of F (3, 3, m), (*shape, m), into a function of F (..., 3, 3), (..., *shape)."""
    components_last = (len(shape), *range(len(shape)))

    def at_every_point(F: Array, q: Constants) -> Array:
        points = np.broadcast_shapes(F.shape[:-2], *map(np.shape, q))
        m = int(np.prod(points))
        F = np.broadcast_to(F, (*points, 3, 3)).reshape(m, 3, 3)
        q = tuple(np.broadcast_to(c, points).reshape(m) if np.ndim(c) else c for c in q)
        values = np.empty((m, *shape), np.result_type(F, *q, np.float64))
        for first in range(0, m, POINTS_PER_CHUNK):
            chunk = slice(first, first + POINTS_PER_CHUNK)
            piece = tuple(c[chunk] if np.ndim(c) else c for c in q)
            with np.errstate(all="ignore"):  # NaN and infinity are results here, as in JAX
                values[chunk] = f(np.ascontiguousarray(F[chunk].transpose(1, 2, 0)), piece).transpose(components_last)
        return values.reshape((*points, *shape))

    return at_every_point


def numpy_material(W: Function, P: Function, A: Function, P_q: Function, n_q: int) -> NumpyMaterial:
    """From functions that take the components first; P_q returns (n_q, 3, 3, m)."""
    stacked = at_points(P_q, n_q, 3, 3)
    return NumpyMaterial(
        at_points(W),
        at_points(P, 3, 3),
        at_points(A, 3, 3, 3, 3),
        lambda F, q: tuple(np.moveaxis(stacked(F, q), -3, 0)),
    )


def J_and_G(F: Array) -> tuple[Array, Array]:
    """det F (m,) and F^-T (3, 3, m), by cofactors."""
    a, b = F[NEXT], F[PREVIOUS]
    cof = a[:, NEXT] * b[:, PREVIOUS] - a[:, PREVIOUS] * b[:, NEXT]
    J = (F[0] * cof[0]).sum(axis=0)
    J = np.where(J.real > 0.0, J, np.nan)  # inverted elements are not admissible
    return J, cof / J


def dyad(a: Array, b: Array) -> Array:
    """a_iJ b_kL, (3, 3, 3, 3, m)."""
    return np.asarray(a[:, :, None, None] * b)


def swapped(A: Array) -> Array:
    """A_iLkJ in place of A_iJkL."""
    return A.transpose(0, 3, 2, 1, 4)


def add_in_rows(A: Array, X: Array) -> None:
    """A_iJkL += 1_ik X_JL."""
    for i in range(3):
        A[i, :, i] += X


def add_in_columns(A: Array, X: Array) -> None:
    """A_iJkL += X_ik 1_JL."""
    for J in range(3):
        A[:, J, :, J] += X


def neo_hookean_W(F: Array, q: Constants) -> Array:
    """W = mu/2 (F : F - 3) - mu ln J + lam/2 (ln J)^2, q = (mu, lam) [Pa]."""
    mu, lam = q
    ln_J = np.log(J_and_G(F)[0])
    return np.asarray(mu / 2.0 * ((F * F).sum(axis=(0, 1)) - 3.0) - mu * ln_J + lam / 2.0 * ln_J**2)


def neo_hookean_P(F: Array, q: Constants) -> Array:
    """P = mu F + (lam ln J - mu) G."""
    mu, lam = q
    J, G = J_and_G(F)
    return np.asarray(mu * F + (lam * np.log(J) - mu) * G)


def neo_hookean_A(F: Array, q: Constants) -> Array:
    """A_iJkL = mu 1_ik 1_JL + lam G_iJ G_kL - (lam ln J - mu) G_iL G_kJ."""
    mu, lam = q
    J, G = J_and_G(F)
    A = dyad(lam * G, G)
    A -= swapped(dyad((lam * np.log(J) - mu) * G, G))
    add_in_rows(A, mu * IDENTITY)
    return A


def neo_hookean_P_q(F: Array, q: Constants) -> Array:
    """dP/dmu = F - G, dP/dlam = ln J G."""
    J, G = J_and_G(F)
    return np.stack([F - G, np.log(J) * G])


NEO_HOOKEAN = numpy_material(neo_hookean_W, neo_hookean_P, neo_hookean_A, neo_hookean_P_q, 2)


def products(F: Array) -> tuple[Array, Array]:
    """C = F^T F and B = F F^T, (3, 3, m)."""
    return (F[:, :, None] * F[:, None]).sum(axis=0), (F[:, None] * F).sum(axis=2)


def gradient_of_I2(F: Array) -> Array:
    """dI2/dF = 2 (I1 F - F C), I1 = tr C, I2 = (I1^2 - C : C)/2."""
    C, _ = products(F)
    I1 = C[0, 0] + C[1, 1] + C[2, 2]
    return np.asarray(2.0 * (I1 * F - (F[:, :, None] * C).sum(axis=1)))


def mooney_rivlin_W(F: Array, q: Constants) -> Array:
    """W = c (J - 1)^2 - d ln J + c1 (I1 - 3) + c2 (I2 - 3), d = 2 (c1 + 2 c2), q = (c1, c2, c) [Pa]."""
    c1, c2, c = q
    C, _ = products(F)
    J, _ = J_and_G(F)
    I1 = C[0, 0] + C[1, 1] + C[2, 2]
    I2 = (I1**2 - (C * C).sum(axis=(0, 1))) / 2.0
    return np.asarray(c * (J - 1.0) ** 2 - 2.0 * (c1 + 2.0 * c2) * np.log(J) + c1 * (I1 - 3.0) + c2 * (I2 - 3.0))


def mooney_rivlin_P(F: Array, q: Constants) -> Array:
    """P = 2 c1 F + c2 dI2/dF + h G, h = 2 c (J - 1) J - d."""
    c1, c2, c = q
    J, G = J_and_G(F)
    h = 2.0 * c * (J - 1.0) * J - 2.0 * (c1 + 2.0 * c2)
    return np.asarray(2.0 * c1 * F + c2 * gradient_of_I2(F) + h * G)


def mooney_rivlin_A(F: Array, q: Constants) -> Array:
    """A_iJkL = 2 c1 1_ik 1_JL + 2 c2 (2 F_iJ F_kL - F_iL F_kJ + 1_ik (I1 1_JL - C_JL) - B_ik 1_JL)
    + 2 c (2 J - 1) J G_iJ G_kL - h G_iL G_kJ, h as in P.
    """
    c1, c2, c = q
    J, G = J_and_G(F)
    C, B = products(F)
    h = 2.0 * c * (J - 1.0) * J - 2.0 * (c1 + 2.0 * c2)
    A = dyad(4.0 * c2 * F, F)
    A += dyad(2.0 * c * (2.0 * J - 1.0) * J * G, G)
    A -= swapped(dyad(2.0 * c2 * F, F))
    A -= swapped(dyad(h * G, G))
    add_in_rows(A, 2.0 * (c1 + c2 * (C[0, 0] + C[1, 1] + C[2, 2])) * IDENTITY - 2.0 * c2 * C)
    add_in_columns(A, -2.0 * c2 * B)
    return A


def mooney_rivlin_P_q(F: Array, q: Constants) -> Array:
    """dP/dc1 = 2 F - 2 G, dP/dc2 = dI2/dF - 4 G, dP/dc = 2 (J - 1) J G."""
    J, G = J_and_G(F)
    return np.stack([2.0 * (F - G), gradient_of_I2(F) - 4.0 * G, 2.0 * (J - 1.0) * J * G])


MOONEY_RIVLIN = numpy_material(mooney_rivlin_W, mooney_rivlin_P, mooney_rivlin_A, mooney_rivlin_P_q, 3)
