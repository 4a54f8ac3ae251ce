"""The rotation R of F = R U by Higham's iteration, with exact derivatives, in jax.numpy.

dR = R [w]x with (tr U I - U) w = axial(R^T dF - dF^T R): to any order, and where stretches coincide, which the
derivatives of singular vectors do not allow. Transposes, not conjugates, keep everything holomorphic.
"""

from __future__ import annotations

from typing import Any

from gradient_routes.problems.jax64 import jax, jnp

AT_MOST, CLOSE = 40, 1e-8  # iterations; the change after which one more is exact, convergence being quadratic


def inverse_transposed(X: Any) -> Any:
    """X^-T of a 3 x 3 array; its transpose in place of a conjugate."""
    a, b, c = X
    cofactor = jnp.stack([jnp.cross(b, c), jnp.cross(c, a), jnp.cross(a, b)])
    return cofactor / (a * cofactor[0]).sum()


@jax.custom_jvp
def rotation(H: Any) -> Any:
    """R (3, 3) of F = I + H, det F > 0 (Higham 1986: X <- (X + X^-T) / 2 from F)."""

    def step(state: Any) -> Any:
        X, _, k = state
        new = (X + inverse_transposed(X)) / 2.0
        return new, jnp.abs(new - X).max(), k + 1

    start = jnp.eye(3, dtype=H.dtype) + H
    X, _, _ = jax.lax.while_loop(lambda s: (s[1] > CLOSE) & (s[2] < AT_MOST), step, (start, jnp.inf, 0))
    return (X + inverse_transposed(X)) / 2.0


@rotation.defjvp
def _(primals: Any, tangents: Any) -> Any:
    (H,), (dH,) = primals, tangents
    R = rotation(H)
    U = R.T @ (jnp.eye(3) + H)
    A = R.T @ dH
    axial = jnp.stack([A[2, 1] - A[1, 2], A[0, 2] - A[2, 0], A[1, 0] - A[0, 1]])
    w = inverse_transposed(jnp.trace(U) * jnp.eye(3) - U).T @ axial
    zero = jnp.zeros_like(w[0])
    cross = jnp.stack([zero, -w[2], w[1], w[2], zero, -w[0], -w[1], w[0], zero]).reshape(3, 3)
    return R, R @ cross


@jax.custom_jvp
def stretched(H: Any) -> Any:
    """F - R = R (U - I), U - I = (U + I)^-1 2 E: with all digits of the strain E."""
    R = rotation(H)
    U = R.T @ (jnp.eye(3) + H)
    return R @ (inverse_transposed(U + jnp.eye(3)).T @ (H + H.T + H.T @ H))


@stretched.defjvp
def _(primals: Any, tangents: Any) -> Any:
    dR = jax.jvp(rotation, primals, tangents)[1]
    return stretched(*primals), tangents[0] - dR


@jax.custom_jvp
def distance(H: Any) -> Any:
    """|F - R|^2, whose derivative is 2 (F - R) : dF."""
    return (stretched(H) ** 2).sum()


@distance.defjvp
def _(primals: Any, tangents: Any) -> Any:
    return distance(*primals), 2.0 * (stretched(*primals) * tangents[0]).sum()
