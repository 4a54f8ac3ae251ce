"""Hyperelastic solids on finite elements: scikit-fem supplies the geometry, the stored energy W everything else.

    Pi(u, q) = sum over points of W(I + grad u, q) dx - f.u,     R = dPi/du,     R_u = d^2 Pi/du^2

The energy is written once, in jax.numpy. Routes that trace differentiate Pi; NumPy routes get R from the same Pi and
R_u from the moduli A = d^2 W/dF^2 at every point, contracted by BLAS: a tenth of the time XLA takes for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from problems.jax64 import jax, jnp
from problems.materials import Energy
from problems.problem import Array
from problems.sparse import SymmetricPattern, SymmetricSparse

CHUNK = 128  # elements contracted at a time: their arrays stay in cache


@dataclass(frozen=True, eq=False)
class Geometry:
    """What scikit-fem knows of a mesh, read once.

    dN (n_e, n_q, n_a, 3)  gradients of the shape functions [1/m]
    dx (n_e, n_q)          quadrature weights [m^3]
    nodes (n_e, n_a)       nodes of every element
    free (n_nodes, 3)      number of the unknown 0..n_u-1, -1 where constrained to zero
    rigid (n_u, 6)         rigid motions of the unknowns, if known
    """

    dN: Array
    dx: Array
    nodes: Array
    free: Array
    rigid: Array | None = None

    @classmethod
    def of_mesh(cls, mesh: Any, element: Any, intorder: int, free: Array) -> Geometry:
        """From a scikit-fem mesh and scalar element; `free` numbers the unknowns of every node."""
        from skfem import Basis

        basis = Basis(mesh, element, intorder=intorder)
        dN = np.stack([basis.basis[a][0].grad for a in range(basis.Nbfun)])  # (n_a, 3, n_e, n_q)
        rigid = rigid_motions(basis.doflocs, free)
        return cls(np.ascontiguousarray(dN.transpose(2, 3, 0, 1)), basis.dx, basis.element_dofs.T, free, rigid)

    @property
    def n_u(self) -> int:
        return int(self.free.max()) + 1

    @cached_property
    def unknowns(self) -> Array:
        """(n_e, 3 n_a), numbers of every element's unknowns, -1 where constrained."""
        return self.free[self.nodes].reshape(len(self.nodes), -1)


def rigid_motions(x: Array, free: Array) -> Array:
    """(n_u, 6): translations along and rotations about the three axes of the nodes x (3, n_nodes), linearized."""
    e, r = np.eye(3), x - x.mean(axis=1, keepdims=True)
    motions = [np.broadcast_to(e[i], r.T.shape) for i in range(3)] + [np.cross(e[i], r.T) for i in range(3)]
    rigid = np.empty((int(free.max()) + 1, 6))
    rigid[free[free >= 0]] = np.stack(motions, axis=-1)[free >= 0]
    return rigid


class Solid:
    """Internal energy of a solid with the energy W(F, q); q is a tuple of arrays (n_e,) or numbers."""

    def __init__(self, geometry: Geometry, W: Energy) -> None:
        self.geometry = geometry
        self.pattern = SymmetricPattern.of_elements(geometry.unknowns, geometry.n_u, geometry.rigid)
        at_points = jax.vmap(W, (0, None))  # over the points of an element, which share q
        self._energies = jax.vmap(at_points)
        self._moduli = jax.jit(jax.vmap(jax.vmap(_second_derivative(W), (0, None))))
        self._dN, self._dx = jnp.asarray(geometry.dN), jnp.asarray(geometry.dx)
        # constrained displacements are read from one more entry of u, a zero
        self._gather = jnp.asarray(np.where(geometry.unknowns < 0, geometry.n_u, geometry.unknowns))

    def deformation_gradients(self, u: Any) -> Any:
        """F = I + grad u at every point, (n_e, n_q, 3, 3); traceable."""
        n_e, _, n_a, _ = self._dN.shape
        u_e = jnp.append(u, 0.0)[self._gather].reshape(n_e, n_a, 3)
        return jnp.einsum("eai,eqaj->eqij", u_e, self._dN) + jnp.eye(3)

    def energy(self, u: Any, q: Any) -> Any:
        """Sum of W dx; traceable, holomorphic in u and q where W is."""
        return (self._energies(self.deformation_gradients(u), q) * self._dx).sum()

    @cached_property
    def moduli(self) -> Callable[[Any, Any], Any]:
        """(u, q) -> A_iJjL dx, (n_e, n_q, 3, 3, 3, 3) in the order J i j L."""
        dx = self._dx[..., None, None, None, None]
        return jax.jit(lambda u, q: jnp.swapaxes(self._moduli(self.deformation_gradients(u), q) * dx, 2, 3))

    def tangent(self, u: Array, q: Any) -> SymmetricSparse:
        """R_u: K_(ai)(bj) = sum over points of dN_a,J A_iJjL dN_b,L dx, assembled."""
        A, dN = np.asarray(self.moduli(u, q)), self.geometry.dN
        n_e, n_q, n_a, _ = dN.shape
        upper = np.empty((n_e, len(self._upper)), A.dtype)
        for first in range(0, n_e, CHUNK):
            chunk = slice(first, first + CHUNK)
            G = np.ascontiguousarray(dN[chunk].transpose(0, 1, 3, 2))  # (chunk, n_q, 3, n_a)
            AG = A[chunk].reshape(-1, n_q, 27, 3) @ G  # (chunk, n_q, J i j, b)
            K = G.reshape(-1, 3 * n_q, n_a).transpose(0, 2, 1) @ AG.reshape(-1, 3 * n_q, 9 * n_a)  # (chunk, a, i j b)
            np.take(K.reshape(-1, 9 * n_a * n_a), self._upper, axis=1, out=upper[chunk])
        return self.pattern.assemble(upper)

    @cached_property
    def _upper(self) -> Array:
        """Where in a i j b the upper triangle of an element matrix (ai)(bj) stands, row by row."""
        n_a = self.geometry.dN.shape[2]
        row, column = np.triu_indices(3 * n_a)
        return np.asarray((3 * row + column % 3) * n_a + column // 3)


@dataclass(frozen=True)
class TracedJacobian:
    """A Jacobian known by its products: forward(v) and reverse(lam), compiled."""

    forward: Callable[[Array], Any]
    reverse: Callable[[Array], Any]

    @property
    def T(self) -> TracedJacobian:
        return TracedJacobian(self.reverse, self.forward)

    def __matmul__(self, v: Array) -> Array:
        return np.asarray(self.forward(v))


class CompiledResidual:
    """A traced R = dPi/du - f, f free of p, compiled, with products of its Jacobians for NumPy callers.

    R_u is a Hessian, hence its own transpose, and R_p^T w = d/dp (dPi/du . w): both take half the time of a vjp of R.
    """

    def __init__(self, R: Callable[[Any, Any], Any], Pi: Callable[[Any, Any], Any]) -> None:
        self._R = jax.jit(R)
        self._R_u_v = jax.jit(lambda u, p, v: jax.jvp(lambda u: R(u, p), (u,), (v,))[1])
        self._R_p_v = jax.jit(lambda u, p, v: jax.jvp(lambda p: R(u, p), (p,), (v,))[1])
        self._R_p_T_w = jax.jit(jax.grad(lambda u, p, w: jax.jvp(lambda u: Pi(u, p), (u,), (w,))[1], 1))

    def __call__(self, u: Array, p: Array) -> Array:
        return np.asarray(self._R(u, p))

    def by_u(self, u: Array, p: Array) -> TracedJacobian:
        return TracedJacobian(lambda v: self._R_u_v(u, p, v), lambda w: self._R_u_v(u, p, w))

    def by_p(self, u: Array, p: Array) -> TracedJacobian:
        return TracedJacobian(lambda v: self._R_p_v(u, p, v), lambda w: self._R_p_T_w(u, p, w))


def gradient(f: Callable[..., Any], argument: int) -> Callable[..., Any]:
    """The derivative of a scalar function by one of its arguments, holomorphic where any of them is complex."""

    def derivative(*arguments: Any) -> Any:
        complex_ = any(jnp.iscomplexobj(leaf) for leaf in jax.tree.leaves(arguments))
        if complex_:
            arguments = jax.tree.map(lambda a: jnp.asarray(a, jnp.complex128), arguments)
        return jax.grad(f, argument, holomorphic=complex_)(*arguments)

    return derivative


def _second_derivative(W: Energy) -> Callable[[Any, Any], Any]:
    """A(F, q) = d^2 W / dF^2, (3, 3, 3, 3), forward over reverse."""

    def A(F: Any, q: Any) -> Any:
        P = gradient(W, 0)
        directions = jnp.eye(9, dtype=F.dtype).reshape(9, 3, 3)
        columns = jax.vmap(lambda D: jax.jvp(lambda F: P(F, q), (F,), (D,))[1])(directions)  # (9, 3, 3), by jL
        return jnp.moveaxis(columns.reshape(3, 3, 3, 3), (0, 1), (2, 3))

    return A
