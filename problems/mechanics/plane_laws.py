"""Stored energies of plane and axisymmetric bodies, from those of solids: W(H, q) of H (2, m).

H has the columns du/dx and du/dy; of a body of revolution about x = 0 also u/x, whose first entry is the hoop component
of H. With T, which puts the entries of H where they belong in the (3, 3) one, and e the direction of H_33,

    plane strain, axisymmetric    W(T H)
    plane stress                  W(T H + h e) where P_33(T H + h e) = 0

The h(H, q) of plane stress is found at each point by Newton's method, and differentiated by the implicit function
theorem: dh = -dP_33/A_3333 at fixed h, thus A = A_2D - a a^T/A_3333 with a = dP/dh.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from gradient_routes.problems.mechanics.materials import LAWS, Energy, MaterialLaw
from gradient_routes.problems.mechanics.materials_numpy import (
    ComponentsFirst,
    Constants,
    NumpyMaterial,
    numpy_material,
)
from gradient_routes.problems.mechanics.solid_options import Kind
from gradient_routes.problems.problem import Array

IN_PLANE, HOOP = [0, 1, 3, 4], [0, 1, 8, 3, 4]  # flat positions in (3, 3) of the entries of H; u_y/r is in none
E_33 = np.diag([0.0, 0.0, 1.0])
CLOSE = 1e-9  # of |H|: after a step this small, another one is exact to rounding, in real and imaginary part
AT_MOST = 60


@cache
def plane_law(name: str, kind: Kind) -> MaterialLaw:
    """The law `name` of solids for bodies of a kind. JAX is imported with its energy only."""
    law = LAWS[name]

    def energy() -> Energy:
        from gradient_routes.problems.mechanics.plane_energies import plane_energy

        return plane_energy(name, kind)

    by_hand = None
    if law.numpy is not None:
        stress = kind == "plane-stress"
        by_hand = _plane_stress_by_hand(law.numpy) if stress else _placed_by_hand(law.numpy, placement(kind))
    return replace(law, numpy=by_hand, energy=energy)


def placement(kind: Kind) -> Array:
    """T (9, 2 m)."""
    if kind != "axisymmetric":
        return np.eye(9)[:, IN_PLANE]
    return np.insert(np.eye(9)[:, HOOP], 5, 0.0, axis=1)


def newton_step(h: Any, P: Any, A: Any, xp: Any) -> tuple[Any, Any]:
    """h after a step of Newton's method for F_33 P_33 = 0 in x = ln F_33, and |dx|, here at most 1.

    F_33 P_33 of the neo-Hookean law is convex in x, and F_33 = exp(x) > 0. The factor exp(dx) is approximated by
    (1 + dx/2)/(1 - dx/2).
    """
    F = 1.0 + h
    slope = P + F * A
    dx = -P / (slope * xp.sign(slope.real))
    dx = dx / xp.maximum(1.0, xp.abs(dx))
    return h + F * dx / (1.0 - dx / 2.0), xp.abs(dx)


def _placed_by_hand(law: NumpyMaterial, T: Array) -> NumpyMaterial:
    solid, shape = law.first, (2, T.shape[1] // 2)

    def placed(H: Array) -> Array:
        return np.asarray(T @ H.reshape(T.shape[1], -1)).reshape(3, 3, -1)

    def plane(P: Array) -> Array:
        return np.asarray(T.T @ P.reshape(9, -1)).reshape(*shape, -1)

    def moduli(A: Array) -> Array:
        return np.asarray(np.einsum("ax,abm,by->xym", T, A.reshape(9, 9, -1), T)).reshape(*shape, *shape, -1)

    first = ComponentsFirst(
        W=lambda H, q: solid.W(placed(H), q),
        P=lambda H, q: plane(solid.P(placed(H), q)),
        A=lambda H, q: moduli(solid.A(placed(H), q)),
        P_q=lambda H, q: np.stack([plane(P) for P in solid.P_q(placed(H), q)]),
        dP=lambda H, dH, q: plane(solid.dP(placed(H), placed(dH), q)),
    )
    return numpy_material(first, law.n_q, shape)


def _plane_stress_by_hand(law: NumpyMaterial) -> NumpyMaterial:
    solid = law.first

    def by_h(H: Array, q: Constants) -> Array:
        """dP/dh = A e, (3, 3, m)."""
        return solid.dP(H, np.broadcast_to(E_33[..., None], H.shape), q)

    def placed(H: Array, q: Constants) -> Array:
        """T H + h e."""
        H_3D = np.zeros((3, 3, H.shape[2]), np.result_type(H, *q))
        H_3D[:2, :2] = H
        h, size, close = H_3D[2, 2], np.array(np.inf), CLOSE * np.abs(H).max(axis=(0, 1))
        with np.errstate(all="ignore"):  # NaN is a result here, as in JAX
            for _ in range(AT_MOST):
                P, A = solid.P(H_3D, q)[2, 2], by_h(H_3D, q)[2, 2]
                if not (size > close).any():
                    h -= P / A
                    break
                h[...], size = newton_step(h, P, A, np)
            h[~(size <= close)] = np.nan  # no such h: the point can bear no plane stress
        return H_3D

    def moduli(H: Array, q: Constants) -> Array:
        A = solid.A(H, q)
        a = A[:2, :2, 2, 2]
        return np.asarray(A[:2, :2, :2, :2] - a[:, :, None, None] * (a / A[2, 2, 2, 2]))

    def by_constants(H: Array, q: Constants) -> Array:
        a, P_q = by_h(H, q), solid.P_q(H, q)
        return np.asarray(P_q[:, :2, :2] - P_q[:, 2, 2][:, None, None] * (a[:2, :2] / a[2, 2]))

    def by_direction(H: Array, dH: Array, q: Constants) -> Array:
        a, dH_3D = by_h(H, q), np.zeros(H.shape, np.result_type(H, dH))
        dH_3D[:2, :2] = dH
        dH_3D[2, 2] = -(a[:2, :2] * dH).sum(axis=(0, 1)) / a[2, 2]
        return solid.dP(H, dH_3D, q)[:2, :2]

    first = ComponentsFirst(
        W=lambda H, q: solid.W(placed(H, q), q),
        P=lambda H, q: solid.P(placed(H, q), q)[:2, :2],
        A=lambda H, q: moduli(placed(H, q), q),
        P_q=lambda H, q: by_constants(placed(H, q), q),
        dP=lambda H, dH, q: by_direction(placed(H, q), dH, q),
    )
    return numpy_material(first, law.n_q, (2, 2))
