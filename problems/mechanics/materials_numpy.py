"""Hand-derived derivatives of stored energies in NumPy: W -> P = dW/dF -> A = dP/dF, and dP/dq.

The formulas take the components first, H = grad u (3, 3, m) at m points, q numbers or (m,). The public functions take
the points first, H (..., 3, 3), and work in chunks that fit the cache. With F = I + H, G = F^-T,

    dJ/dF_kL = J G_kL,     dG_iJ/dF_kL = -G_iL G_kJ,     F - G = 2 G E,     E = (H + H^T + H^T H)/2.

W, P and dP/dq contain no differences of numbers near 1: they keep their digits at any small strain.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gradient_routes.problems.problem import Array

POINTS_PER_CHUNK = 1000  # stays in cache; with a power of two, transposed arrays share few cache sets
IDENTITY = np.eye(3)[..., None]  # (3, 3, 1)

Constants = tuple[Any, ...]
Function = Callable[[Array, Constants], Array]
Product = Callable[[Array, Array, Constants], Array]


@dataclass(frozen=True)
class NumpyMaterial:
    """A stored energy W(H, q) and its derivatives in NumPy, real or complex, for H (..., 3, 3), F = I + H.

    q is a tuple of constants that broadcast against H.shape[:-2]; P (..., 3, 3) first Piola-Kirchhoff stress,
    A (..., 3, 3, 3, 3) with A[..., i, J, k, L] = dP_iJ/dF_kL, P_q a tuple of dP/dq (..., 3, 3), one per constant.
    `first` are the same functions for components first. Law: P = dW/dF, A = dP/dF, symmetric under (i, J) <-> (k, L);
    NaN for Re det F <= 0.
    """

    W: Function
    P: Function
    A: Function
    P_q: Callable[[Array, Constants], tuple[Array, ...]]
    first: ComponentsFirst
    n_q: int


@dataclass(frozen=True)
class ComponentsFirst:
    """W (m,), P (3, 3, m), A (3, 3, 3, 3, m), P_q (n_q, 3, 3, m) of H (3, 3, m); dP(H, dH, q) = A dH (3, 3, m).

    Of a plane body (2, k, m) and so on, k as many columns as H has.
    """

    W: Function
    P: Function
    A: Function
    P_q: Function
    dP: Product


def at_points(f: Function, *shape: int) -> Function:
    """Turns f of H (d, k, m), (*shape, m), into a function of H (..., d, k), (..., *shape)."""
    components_last = (len(shape), *range(len(shape)))

    def at_every_point(H: Array, q: Constants) -> Array:
        points, entries = np.broadcast_shapes(H.shape[:-2], *map(np.shape, q)), H.shape[-2:]
        m = int(np.prod(points))
        H = np.broadcast_to(H, (*points, *entries)).reshape(m, *entries)
        q = tuple(np.broadcast_to(c, points).reshape(m) if np.ndim(c) else c for c in q)
        values = np.empty((m, *shape), np.result_type(H, *q, np.float64))
        for first in range(0, m, POINTS_PER_CHUNK):
            chunk = slice(first, first + POINTS_PER_CHUNK)
            piece = tuple(c[chunk] if np.ndim(c) else c for c in q)
            with np.errstate(all="ignore"):  # NaN and infinity are results here, as in JAX
                values[chunk] = f(np.ascontiguousarray(H[chunk].transpose(1, 2, 0)), piece).transpose(components_last)
        return values.reshape((*points, *shape))

    return at_every_point


def numpy_material(first: ComponentsFirst, n_q: int, shape: tuple[int, int] = (3, 3)) -> NumpyMaterial:
    """From functions that take the components first, H (*shape, m), of n_q constants."""
    stacked = at_points(first.P_q, n_q, *shape)
    return NumpyMaterial(
        at_points(first.W),
        at_points(first.P, *shape),
        at_points(first.A, *shape, *shape),
        lambda H, q: tuple(np.moveaxis(stacked(H, q), -3, 0)),
        first,
        n_q,
    )


@dataclass(frozen=True)
class Kinematics:
    """F = I + H, j = J - 1 (m,), G and E (3, 3, m)."""

    H: Array
    F: Array
    j: Array
    G: Array

    @cached_property
    def E(self) -> Array:
        H_T = self.H.swapaxes(0, 1)
        return np.asarray((self.H + H_T + product(H_T, self.H)) / 2.0)

    @property
    def log_J(self) -> Array:
        if np.isrealobj(self.j):
            return np.asarray(np.log1p(self.j))
        return np.asarray(2.0 * np.arctanh(self.j / (2.0 + self.j)))  # log1p drops small real parts of complex numbers

    @property
    def x(self) -> Array:
        """I1 - 3 - 2 j."""
        return np.asarray(2.0 * (trace(self.E) - self.j))


def kinematics(H: Array) -> Kinematics:
    """NaN where Re J <= 0: inverted elements are not admissible. j = tr H + ((tr H)^2 - H : H^T)/2 + det H."""
    F, tr = IDENTITY + H, trace(H)
    j = tr + (tr**2 - (H * H.swapaxes(0, 1)).sum(axis=(0, 1))) / 2.0 + det(H)
    j = np.where(j.real > -1.0, j, np.nan)
    return Kinematics(H, F, j, cofactor(F) / (1.0 + j))


def cofactor(F: Array) -> Array:
    cyclic = np.empty((5, 5, *F.shape[2:]), F.dtype)
    cyclic[:3, :3] = F
    cyclic[3:, :3] = F[:2]
    cyclic[:, 3:] = cyclic[:, :2]
    a, b = cyclic[1:4], cyclic[2:5]
    return np.asarray(a[:, 1:4] * b[:, 2:5] - a[:, 2:5] * b[:, 1:4])


def det(F: Array) -> Array:
    (a, b, c), (d, e, f), (g, h, i) = F
    return np.asarray(a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g))


def trace(E: Array) -> Array:
    return np.asarray(E[0, 0] + E[1, 1] + E[2, 2])


def inner(A: Array, B: Array) -> Array:
    """A : B, (m,)."""
    return np.asarray((A * B).sum(axis=(0, 1)))


def product(A: Array, B: Array) -> Array:
    """A_iK B_KJ, (3, 3, m)."""
    return np.asarray(np.einsum("iKm,KJm->iJm", A, B))


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


def neo_hookean_W(H: Array, q: Constants) -> Array:
    """W = mu/2 (I1 - 3) - mu ln J + lam/2 (ln J)^2, q = (mu, lam) [Pa]."""
    (mu, lam), k = q, kinematics(H)
    return np.asarray(mu * (k.x / 2.0 + k.j - k.log_J) + lam / 2.0 * k.log_J**2)


def neo_hookean_P(H: Array, q: Constants) -> Array:
    """P = mu (F - G) + lam ln J G = G (2 mu E + lam ln J I)."""
    (mu, lam), k = q, kinematics(H)
    return product(k.G, 2.0 * mu * k.E + lam * k.log_J * IDENTITY)


def neo_hookean_A(H: Array, q: Constants) -> Array:
    """A_iJkL = mu 1_ik 1_JL + lam G_iJ G_kL - (lam ln J - mu) G_iL G_kJ."""
    (mu, lam), k = q, kinematics(H)
    A = dyad(lam * k.G, k.G)
    A -= swapped(dyad((lam * k.log_J - mu) * k.G, k.G))
    add_in_rows(A, mu * IDENTITY)
    return A


def neo_hookean_dP(H: Array, dH: Array, q: Constants) -> Array:
    """A dH = mu dH + lam (G : dH) G - (lam ln J - mu) G dH^T G."""
    (mu, lam), k = q, kinematics(H)
    turned = product(k.G, product(dH.swapaxes(0, 1), k.G))
    return np.asarray(mu * dH + lam * inner(k.G, dH) * k.G - (lam * k.log_J - mu) * turned)


def neo_hookean_P_q(H: Array, q: Constants) -> Array:
    """dP/dmu = 2 G E, dP/dlam = ln J G."""
    k = kinematics(H)
    return np.stack([2.0 * product(k.G, k.E), k.log_J * k.G])


NEO_HOOKEAN = numpy_material(
    ComponentsFirst(neo_hookean_W, neo_hookean_P, neo_hookean_A, neo_hookean_P_q, neo_hookean_dP), n_q=2
)


def mooney_rivlin_W(H: Array, q: Constants) -> Array:
    """W = c (J - 1)^2 - d ln J + c1 (I1 - 3) + c2 (I2 - 3), d = 2 (c1 + 2 c2), q = (c1, c2, c) [Pa]."""
    (c1, c2, c), k = q, kinematics(H)
    d, y = 2.0 * (c1 + 2.0 * c2), 2.0 * (k.x + trace(k.E) ** 2 - (k.E * k.E).sum(axis=(0, 1)))  # I2 - 3 - 4 j
    return np.asarray(c * k.j**2 + d * (k.j - k.log_J) + c1 * k.x + c2 * y)


def gradient_of_I2(k: Kinematics) -> Array:
    """dI2/dF - 4 G = 2 (I1 F - F C - 2 G) = 8 G E + 4 F (tr E I - E)."""
    return 8.0 * product(k.G, k.E) + 4.0 * product(k.F, trace(k.E) * IDENTITY - k.E)


def mooney_rivlin_P(H: Array, q: Constants) -> Array:
    """P = 2 c1 (F - G) + c2 (dI2/dF - 4 G) + 2 c (J - 1) J G."""
    return np.asarray(sum(c * P_c for c, P_c in zip(q, mooney_rivlin_P_q(H, q), strict=True)))


def mooney_rivlin_A(H: Array, q: Constants) -> Array:
    """A_iJkL = 2 c1 1_ik 1_JL + 2 c2 (2 F_iJ F_kL - F_iL F_kJ + 1_ik (I1 1_JL - C_JL) - B_ik 1_JL)
    + 2 c (2 J - 1) J G_iJ G_kL - h G_iL G_kJ, h = 2 c (J - 1) J - d, C = F^T F, B = F F^T.
    """
    (c1, c2, c), k = q, kinematics(H)
    F, G, J = k.F, k.G, 1.0 + k.j
    C = IDENTITY + 2.0 * k.E
    h = 2.0 * c * k.j * J - 2.0 * (c1 + 2.0 * c2)
    A = dyad(4.0 * c2 * F, F)
    A += dyad(2.0 * c * (2.0 * J - 1.0) * J * G, G)
    A -= swapped(dyad(2.0 * c2 * F, F))
    A -= swapped(dyad(h * G, G))
    add_in_rows(A, 2.0 * (c1 + c2 * trace(C)) * IDENTITY - 2.0 * c2 * C)
    add_in_columns(A, -2.0 * c2 * product(F, F.swapaxes(0, 1)))
    return A


def mooney_rivlin_dP(H: Array, dH: Array, q: Constants) -> Array:
    """A dH, term by term as in A."""
    (c1, c2, c), k = q, kinematics(H)
    F, G, J, dH_T = k.F, k.G, 1.0 + k.j, dH.swapaxes(0, 1)
    C, h = IDENTITY + 2.0 * k.E, 2.0 * c * k.j * J - 2.0 * (c1 + 2.0 * c2)
    dP = 2.0 * (c1 + c2 * trace(C)) * dH - 2.0 * c2 * product(dH, C)
    dP += 2.0 * c2 * (2.0 * inner(F, dH) * F - product(F, product(dH_T, F) + product(F.swapaxes(0, 1), dH)))
    dP += 2.0 * c * (2.0 * J - 1.0) * J * inner(G, dH) * G - h * product(G, product(dH_T, G))
    return np.asarray(dP)


def mooney_rivlin_P_q(H: Array, q: Constants) -> Array:
    """dP/dc1 = 2 (F - G), dP/dc2 = dI2/dF - 4 G, dP/dc = 2 (J - 1) J G."""
    k = kinematics(H)
    return np.stack([4.0 * product(k.G, k.E), gradient_of_I2(k), 2.0 * k.j * (1.0 + k.j) * k.G])


MOONEY_RIVLIN = numpy_material(
    ComponentsFirst(mooney_rivlin_W, mooney_rivlin_P, mooney_rivlin_A, mooney_rivlin_P_q, mooney_rivlin_dP), n_q=3
)
