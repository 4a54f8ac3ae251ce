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

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.mechanics.materials import LAWS, Energy, MaterialLaw
from gradient_routes.problems.mechanics.materials_numpy import NumpyMaterial
from gradient_routes.problems.mechanics.solid_options import Kind
from gradient_routes.problems.problem import Array

IN_PLANE, HOOP = [0, 1, 3, 4], [0, 1, 8, 3, 4]  # flat positions in (3, 3) of the entries of H; u_y/r is in none
E_33 = np.diag([0.0, 0.0, 1.0])
CLOSE = 1e-9  # of |H|: after a step this small, another one is exact to rounding, in real and imaginary part
AT_MOST = 60


@cache
def plane_law(name: str, kind: Kind) -> MaterialLaw:
    """The law `name` of solids for bodies of a kind."""
    law = LAWS[name]
    T = _placement(kind)
    if kind != "plane-stress":
        return replace(law, W=_placed(law.W, T), numpy=law.numpy and _placed_by_hand(law.numpy, T))
    W = linear_plane_stress(law.W) if name == "linear" else plane_stress(law.W, T)
    return replace(law, W=W, numpy=law.numpy and _plane_stress_by_hand(law.numpy, T))


def _placement(kind: Kind) -> Array:
    """T (9, 2 m)."""
    if kind != "axisymmetric":
        return np.eye(9)[:, IN_PLANE]
    return np.insert(np.eye(9)[:, HOOP], 5, 0.0, axis=1)


def _placed(W: Energy, T: Array) -> Energy:
    return lambda H, q: W((T @ H.ravel()).reshape(3, 3), q)


def linear_plane_stress(W: Energy) -> Energy:
    """h = -lam/(lam + 2 mu) (H_11 + H_22): the energy of a solid with lam replaced by 2 lam mu/(lam + 2 mu)."""

    def condensed(H: Any, q: Any) -> Any:
        mu, lam = q
        return W(H, (mu, 2.0 * lam * mu / (lam + 2.0 * mu)))

    return condensed


def plane_stress(W: Energy, T: Array) -> Energy:
    """min over h of W(T H + h e), differentiable to any order."""

    def at(H: Any, h: Any, q: Any) -> Any:
        return W((T @ H.ravel()).reshape(3, 3) + h * E_33, q)

    def P_33(H: Any, h: Any, q: Any) -> Any:
        return jax.jvp(lambda h: at(H, h, q), (h,), (jnp.ones_like(h),))[1]

    def stress_and_modulus(H: Any, h: Any, q: Any) -> tuple[Any, Any]:
        """P_33 and A_3333."""
        return jax.jvp(lambda h: P_33(H, h, q), (h,), (jnp.ones_like(h),))

    @jax.custom_jvp
    def thinning(H: Any, q: Any) -> Any:
        close = CLOSE * jnp.abs(H).max()

        def step(state: Any) -> Any:
            h, size, _, k = state
            return *newton_step(h, *stress_and_modulus(H, h, q), jnp), size, k + 1

        def far(state: Any) -> Any:
            return (state[2] > close) & (state[3] < AT_MOST)  # the last step but one was not small

        zero = jnp.zeros((), jnp.result_type(H, *q))
        h, size, *_ = jax.lax.while_loop(far, step, (zero, jnp.inf, jnp.inf, 0))
        return jnp.where(size <= close, h, jnp.nan)  # no such h: the point can bear no plane stress

    @thinning.defjvp
    def _(primals: Any, tangents: Any) -> tuple[Any, Any]:
        (H, q), h = primals, thinning(*primals)
        dP_33 = jax.jvp(lambda H, q: P_33(H, h, q), primals, tangents)[1]
        return h, -dP_33 / stress_and_modulus(H, h, q)[1]

    @jax.custom_jvp
    def condensed(H: Any, q: Any) -> Any:
        return at(H, thinning(H, q), q)

    @condensed.defjvp
    def _(primals: Any, tangents: Any) -> tuple[Any, Any]:
        """dW at fixed h, as dW/dh = P_33 = 0; this h depends on H and q in further derivatives."""
        h = thinning(*primals)
        return jax.jvp(lambda H, q: at(H, h, q), primals, tangents)

    return condensed


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


def _placed_by_hand(material: NumpyMaterial, T: Array) -> NumpyMaterial:
    def solid(H: Array) -> Array:
        return np.asarray(H.reshape(*H.shape[:-2], -1) @ T.T).reshape(*H.shape[:-2], 3, 3)

    def plane(P: Array) -> Array:
        return np.asarray(P.reshape(*P.shape[:-2], 9) @ T).reshape(*P.shape[:-2], 2, -1)

    def moduli(A: Array) -> Array:
        points, m = A.shape[:-4], T.shape[1] // 2
        return np.asarray(T.T @ A.reshape(*points, 9, 9) @ T).reshape(*points, 2, m, 2, m)

    return NumpyMaterial(
        lambda H, q: material.W(solid(H), q),
        lambda H, q: plane(material.P(solid(H), q)),
        lambda H, q: moduli(material.A(solid(H), q)),
        lambda H, q: tuple(plane(P_c) for P_c in material.P_q(solid(H), q)),
    )


def _plane_stress_by_hand(material: NumpyMaterial, T: Array) -> NumpyMaterial:
    def solid(H: Array, q: tuple[Any, ...]) -> Array:
        """T H + h e."""
        points = np.broadcast_shapes(H.shape[:-2], *map(np.shape, q))
        H_3D = np.zeros((*points, 3, 3), np.result_type(H, *q))
        H_3D[..., :2, :2] = H
        h, size, close = H_3D[..., 2, 2], np.array(np.inf), CLOSE * np.abs(H).max(axis=(-2, -1))
        with np.errstate(all="ignore"):  # NaN is a result here, as in JAX
            for _ in range(AT_MOST):
                P, A = material.P(H_3D, q)[..., 2, 2], material.A(H_3D, q)[..., 2, 2, 2, 2]
                if not (size > close).any():
                    h -= P / A
                    break
                h[...], size = newton_step(h, P, A, np)
            h[~(size <= close)] = np.nan  # no such h: the point can bear no plane stress
        return H_3D

    def moduli(A: Array) -> Array:
        a = A[..., :2, :2, 2, 2]
        return np.asarray(
            A[..., :2, :2, :2, :2] - a[..., None, None] * a[..., None, None, :, :] / A[..., 2:, 2:, 2:, 2:]
        )

    def by_constants(H: Array, q: tuple[Any, ...]) -> tuple[Array, ...]:
        A = material.A(H, q)
        dh = A[..., :2, :2, 2, 2] / A[..., 2:, 2:, 2, 2]
        return tuple(P_c[..., :2, :2] - dh * P_c[..., 2:, 2:] for P_c in material.P_q(H, q))

    return NumpyMaterial(
        lambda H, q: material.W(solid(H, q), q),
        lambda H, q: material.P(solid(H, q), q)[..., :2, :2],
        lambda H, q: moduli(material.A(solid(H, q), q)),
        lambda H, q: by_constants(solid(H, q), q),
    )
