"""Stored energies of plane and axisymmetric bodies in jax.numpy: see `plane_laws`."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.mechanics.materials import LAWS, Energy
from gradient_routes.problems.mechanics.plane_laws import AT_MOST, CLOSE, E_33, newton_step, placement
from gradient_routes.problems.mechanics.solid_options import Kind
from gradient_routes.problems.problem import Array


@cache
def plane_energy(name: str, kind: Kind) -> Energy:
    """W(H, q) of H (2, m) of the law `name` of solids."""
    W, T = LAWS[name].W, placement(kind)
    if kind != "plane-stress":
        return _placed(W, T)
    return linear_plane_stress(_placed(W, T)) if name == "linear" else plane_stress(W, T)


def placed(H: Any, T: Array) -> Any:
    """T H, (3, 3), every entry of which is one of H or 0.

    By its index, as JAX 0.10 refuses to linearize a compiled custom_jvp of a product with a NumPy array.
    """
    index = np.where(T.any(axis=1), T.argmax(axis=1), T.shape[1])
    return jnp.append(H.ravel(), 0.0)[index].reshape(3, 3)


def _placed(W: Energy, T: Array) -> Energy:
    return lambda H, q: W(placed(H, T), q)


def linear_plane_stress(W: Energy) -> Energy:
    """h = -lam/(lam + 2 mu) (H_11 + H_22): the energy of a solid with lam replaced by 2 lam mu/(lam + 2 mu)."""

    def condensed(H: Any, q: Any) -> Any:
        mu, lam = q
        return W(H, (mu, 2.0 * lam * mu / (lam + 2.0 * mu)))

    return condensed


def plane_stress(W: Energy, T: Array) -> Energy:
    """min over h of W(T H + h e), differentiable to any order."""

    def at(H: Any, h: Any, q: Any) -> Any:
        return W(placed(H, T) + h * E_33, q)

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
