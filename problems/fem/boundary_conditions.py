"""Dirichlet conditions: displacement components that are free, clamped at zero, or prescribed by a grip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class BoundaryConditions:
    """Degrees of freedom in one or more load cases; u concatenates those of all cases.

    n_free                         degrees of freedom of one case
    index (cases, n_nodes, 3)      position of a nodal displacement in (u_case, 0, a), a the grip displacement [m]
    clamped, gripped               node numbers
    """

    n_free: int
    index: Array
    clamped: Array
    gripped: Array

    @classmethod
    def of(cls, mesh: Mesh, clamped: Array, gripped: Array, directions: Array) -> BoundaryConditions:
        """From node numbers and the directions (cases, 3) the grip moves in. Raises InputError if no node is free."""
        X = mesh.geometry.X
        free = np.zeros(len(X), dtype=bool)
        free[np.unique(mesh.geometry.nodes)] = True  # a mesh file may contain nodes of no cell
        free[clamped] = free[gripped] = False
        n_free = 3 * int(free.sum())
        if n_free == 0:
            raise InputError(f"{mesh.who}: no node is free to move - refine the mesh or clamp less")
        index = np.full((len(X), 3), n_free)
        index[free] = np.arange(n_free).reshape(-1, 3)
        cases = np.repeat(index[None], len(directions), axis=0)
        for case, direction in zip(cases, directions, strict=True):
            case[gripped[:, None], np.flatnonzero(direction)] = n_free + 1
        return cls(n_free, cases, clamped, gripped)

    @property
    def n_u(self) -> int:
        return self.n_free * len(self.index)

    def displacements(self, u: Any, a: Any, case: int, nodes: Array, xp: Any) -> Any:
        """Displacements (..., 3) of nodes in a load case, from u (n_u,) and the grip displacement a."""
        u_case = u[case * self.n_free : (case + 1) * self.n_free]
        return xp.concatenate([u_case, xp.stack([0.0 * a, a])])[self.index[case][nodes]]

    def dofs(self, nodes: Array, case: int = 0) -> Array:
        """(n_e, 3 n_a), degrees of freedom of the cells within a case, -1 where constrained; the same in all cases."""
        index = self.index[case][nodes].reshape(len(nodes), -1)
        return np.where(index < self.n_free, index, -1)

    def rigid_body_modes(self, X: Array) -> Array:
        """(n_free, 6), translations along and linearized rotations about the three axes, of nodes at X."""
        e, r = np.eye(3), X - X.mean(axis=0)
        motions = [np.broadcast_to(e[i], r.shape) for i in range(3)] + [np.cross(e[i], r) for i in range(3)]
        free = self.index[0] < self.n_free
        rigid = np.empty((self.n_free, 6))
        rigid[self.index[0][free]] = np.stack(motions, axis=-1)[free]
        return rigid

    def assemble(self, forces: Array, nodes: Array, case: int) -> tuple[Array, Any]:
        """The transpose of `displacements`: nodal forces (..., 3) summed into (n_free,), and their part on a."""
        at, n = self.index[case][nodes].ravel(), self.n_free + 2
        flat = forces.ravel()
        total = np.bincount(at, weights=flat.real, minlength=n)
        if np.iscomplexobj(flat):
            total = total + 1j * np.bincount(at, weights=flat.imag, minlength=n)
        return total[: self.n_free], total[-1]


def check_clamp(mesh: Mesh, clamped: Array) -> None:
    """Raises InputError if a connected part of the mesh keeps rigid-body modes: its clamped nodes lie on a line."""
    parts = mesh.geometry.parts
    for part in range(parts.max() + 1):
        held = clamped[parts[clamped] == part]
        X = mesh.geometry.X[held]
        spread = np.linalg.svd(X - X.mean(axis=0), compute_uv=False) if len(X) else np.zeros(3)
        if (spread > 1e-9 * mesh.diameter).sum() < 2:
            what = "the body" if parts.max() == 0 else f"part {part + 1} of {parts.max() + 1} that share no node"
            raise InputError(
                f"{mesh.who}: {len(held)} clamped nodes leave {what} free to turn: R_u is singular - clamp a face"
            )
