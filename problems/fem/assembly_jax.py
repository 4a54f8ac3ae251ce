"""Internal energy, residual and tangent of a hyperelastic solid, by JAX from the stored energy W.

    Pi(u, q) = sum over points of W(grad u, q) dx,     f_int = dPi/du,     K = d^2 Pi/du^2

Routes that trace differentiate Pi. For NumPy callers f_int comes from the same Pi, and K from the moduli
A = d^2 W/dH^2, H = grad u, at every point, contracted by BLAS in a tenth of the time that XLA needs for it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from gradient_routes.problems.fem.element_matrices import element_matrices
from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.mechanics.materials import Energy
from gradient_routes.problems.problem import Array


class JaxAssembly:
    """Element integrals of the energy W(H, q).

    Arguments: u_e (n_e, n_a, d) displacements of the cells' nodes [m]; q a tuple of material constants, numbers or
    (n_e,); dN (n_e, n_q, n_a, m), or (1, n_q, n_a, m) if the cells are congruent, and dx (n_e, n_q), their metric.
    H is d x m.
    """

    def __init__(self, W: Energy) -> None:
        at_points = jax.vmap(W, (0, None))  # over the points of a cell, which share q
        self._W = jax.jit(jax.vmap(at_points))
        self._A = jax.vmap(jax.vmap(_second_derivative(W), (0, None)))
        self._H = jax.jit(displacement_gradients)
        self._A_dx = jax.jit(self._moduli)

    def energy(self, u_e: Any, q: Any, dN: Any, dx: Any) -> Any:
        """Sum of W dx; traceable, holomorphic if W is."""
        return (self._W(displacement_gradients(u_e, dN), _per_cell(q, dx)) * dx).sum()

    def _moduli(self, H: Any, q: Any, dx: Any) -> Any:
        """A_iJjL dx, (n_e, n_q, m, d, d, m) in the order J i j L."""
        A = self._A(H, _per_cell(q, dx))
        return jnp.swapaxes(A * dx[..., None, None, None, None], 2, 3)

    def element_tangents(self, u_e: Array, q: Any, dN: Array, dx: Array, selected: Array) -> Array:
        """Entries `pick` of the element matrices K_(ai)(bj) = sum over points of dN_a,J A_iJjL dN_b,L dx: (n_e, k)."""
        return element_matrices(np.asarray(self._A_dx(self._H(u_e, dN), q, dx)), dN, selected)


@cache
def assembly(W: Energy) -> JaxAssembly:
    """One for all solids of a law: what was traced and compiled for one serves the others."""
    return JaxAssembly(W)


def displacement_gradients(u_e: Any, dN: Any) -> Any:
    """H = grad u at every point, (n_e, n_q, d, m); one matrix product if the cells are congruent."""
    n_e, n_a, d = u_e.shape
    if len(dN) > 1:
        return jnp.einsum("eai,eqaj->eqij", u_e, dN)
    B = jnp.einsum("qaj,ik->akqij", dN[0], jnp.eye(d)).reshape(d * n_a, -1)
    return (u_e.reshape(n_e, -1) @ B).reshape(n_e, -1, d, dN.shape[-1])


def _per_cell(q: Any, dx: Any) -> Any:
    """Every constant as an array (n_e,)."""
    return jax.tree.map(lambda c: jnp.broadcast_to(jnp.asarray(c), dx.shape[:1]), q)


class CompiledResidual:
    """R = dPi/du + g, compiled, with products of its Jacobians for NumPy callers.

    Pi(u, p) is the potential of the solid and of dead loads; g(u, p) contains the loads without potential, or is None.
    The Hessian of Pi is symmetric, and its part of R_p^T w is d/dp (dPi/du . w): both take half the time of a vjp of R.
    Only g needs a vjp.
    """

    def __init__(self, Pi: Callable[[Any, Any], Any], g: Callable[[Any, Any], Any] | None = None) -> None:
        Pi_u = gradient(Pi, 0)

        def R(u: Any, p: Any) -> Any:
            return Pi_u(u, p) if g is None else Pi_u(u, p) + g(u, p)

        def R_u_T(u: Any, p: Any, w: Any) -> Any:
            product = jax.jvp(lambda u: Pi_u(u, p), (u,), (w,))[1]
            return product if g is None else product + jax.vjp(lambda u: g(u, p), u)[1](w)[0]

        def R_p_T(u: Any, p: Any, w: Any) -> Any:
            product = jax.grad(lambda p: jax.jvp(lambda u: Pi(u, p), (u,), (w,))[1])(p)
            return product if g is None else product + jax.vjp(lambda p: g(u, p), p)[1](w)[0]

        self.R = R
        self._R = jax.jit(R)
        self._R_u_v = jax.jit(lambda u, p, v: jax.jvp(lambda u: R(u, p), (u,), (v,))[1])
        self._R_u_T_w = self._R_u_v if g is None else jax.jit(R_u_T)
        self._R_p_v = jax.jit(lambda u, p, v: jax.jvp(lambda p: R(u, p), (p,), (v,))[1])
        self._R_p_T_w = jax.jit(R_p_T)

    def __call__(self, u: Array, p: Array) -> Array:
        return np.asarray(self._R(u, p))

    def R_u(self, u: Array, p: Array) -> ByProducts:
        return ByProducts(lambda v: self._R_u_v(u, p, v), lambda w: self._R_u_T_w(u, p, w))

    def R_p(self, u: Array, p: Array) -> ByProducts:
        return ByProducts(lambda v: self._R_p_v(u, p, v), lambda w: self._R_p_T_w(u, p, w))


def gradient(f: Callable[..., Any], argument: int) -> Callable[..., Any]:
    """The derivative of a scalar function with respect to one argument, holomorphic if any argument is complex."""

    def derivative(*arguments: Any) -> Any:
        complex_ = any(jnp.iscomplexobj(leaf) for leaf in jax.tree.leaves(arguments))
        if complex_:
            arguments = jax.tree.map(lambda a: jnp.asarray(a, jnp.complex128), arguments)
        return jax.grad(f, argument, holomorphic=complex_)(*arguments)

    return derivative


def _second_derivative(W: Energy) -> Callable[[Any, Any], Any]:
    """A(H, q) = d^2 W / dH^2, (d, m, d, m), forward over reverse."""

    def A(H: Any, q: Any) -> Any:
        P = gradient(W, 0)
        directions = jnp.eye(H.size, dtype=H.dtype).reshape(-1, *H.shape)
        columns = jax.vmap(lambda D: jax.jvp(lambda H: P(H, q), (H,), (D,))[1])(directions)  # (d m, d, m), by jL
        return jnp.moveaxis(columns.reshape(*H.shape, *H.shape), (0, 1), (2, 3))

    return A
