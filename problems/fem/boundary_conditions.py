"""Dirichlet conditions: displacement components that are free, clamped at zero, or prescribed by a grip."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.elements import Geometry
from gradient_routes.problems.fem.mesh import AXES, Mesh
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class BoundaryConditions:
    """Degrees of freedom in one or more load cases; u concatenates those of all cases.

    n_free                     degrees of freedom of one case
    index (cases, n_nodes, d)  position of a nodal displacement in (u_case, 0, displacement (d,) of the grip, values)
    held (n_nodes, d)          components that are zero
    gripped                    node numbers
    directions (cases, d)      displacement of the grip per unit amplitude
    known (n_k,)               numbers of other nodes whose displacements are known
    values (cases, n_k d)      these [m]
    """

    n_free: int
    index: Array
    held: Array
    gripped: Array
    directions: Array
    known: Array
    values: Array

    @classmethod
    def of(
        cls, mesh: Mesh, held: Array, gripped: Array, directions: Array, known: Array, values: Array
    ) -> BoundaryConditions:
        """From the components that are held, the directions (cases, d) the grip moves in, and the nodes (n_k,) with
        known displacements, values (cases, n_k, d). What is held is held there, too.

        Raises InputError if no node is free.
        """
        free = np.zeros(held.shape, dtype=bool)
        free[np.unique(mesh.geometry.nodes)] = True  # a mesh file may contain nodes of no cell
        free[held] = free[gripped] = free[known] = False
        n_free = int(free.sum())
        if n_free == 0:
            raise InputError(f"{mesh.who}: no node is free to move - refine the mesh or clamp less")
        index = np.full(held.shape, n_free)
        index[free] = np.arange(n_free)
        index[gripped] = n_free + 1 + np.arange(held.shape[1])
        index[known] = n_free + 1 + held.shape[1] + np.arange(values[0].size).reshape(values[0].shape)
        index[held] = n_free
        for direction in directions:
            if gripped.size and direction.any() and not (index > n_free)[:, direction != 0.0].any():
                raise InputError(f"{mesh.who}: the grip moves nothing: what it would move is held - free it")
        every_case = np.repeat(index[None], len(directions), axis=0)
        return cls(n_free, every_case, held, gripped, directions, known, values.reshape(len(values), -1))

    def single_case(self, case: int) -> BoundaryConditions:
        """Those of one load case."""
        of = slice(case, case + 1)
        return replace(self, index=self.index[of], directions=self.directions[of], values=self.values[of])

    @property
    def clamped(self) -> Array:
        """The nodes that are held in any component."""
        return np.flatnonzero(self.held.any(axis=1))

    @property
    def n_u(self) -> int:
        return self.n_free * len(self.index)

    @property
    def size(self) -> int:
        """How many numbers `index` points to."""
        return int(self.n_free + 1 + self.directions.shape[1] + self.values.shape[1])

    @property
    def grip(self) -> slice:
        """Where the grip's displacement is among them."""
        return slice(self.n_free + 1, self.n_free + 1 + self.directions.shape[1])

    def displacements(self, u: Any, a: Any, case: int, nodes: Array, xp: Any) -> Any:
        """Displacements (..., d) of nodes in a load case, from u (n_u,) and the amplitude a of the grip."""
        grip = a * self.directions[case]
        return self._spread(u, (xp.reshape(0.0 * a, 1), grip, self.values[case]), case, nodes, xp)

    def variations(self, v: Array, case: int, nodes: Array) -> Array:
        """Displacements (..., d) of nodes by a change v (n_u,) of u."""
        return np.asarray(self._spread(v, (np.zeros(self.size - self.n_free),), case, nodes, np))

    def _spread(self, u: Any, prescribed: tuple[Any, ...], case: int, nodes: Array, xp: Any) -> Any:
        u_case = u[case * self.n_free : (case + 1) * self.n_free]
        return xp.concatenate([u_case, *prescribed])[self.index[case][nodes]]

    def dofs(self, nodes: Array, case: int = 0) -> Array:
        """(n_e, d n_a), degrees of freedom of the cells within a case, -1 where constrained; the same in all cases."""
        index = self.index[case][nodes].reshape(len(nodes), -1)
        return np.where(index < self.n_free, index, -1)

    def near_nullspace(self, geometry: Geometry) -> Array:
        """(n_free, k), the rigid-body modes in the free components."""
        free = self.index[0] < self.n_free
        rigid = np.empty((self.n_free, rigid_body_modes(geometry).shape[-1]))
        rigid[self.index[0][free]] = rigid_body_modes(geometry)[free]
        return rigid

    def assemble(self, forces: Array, nodes: Array, case: int) -> tuple[Array, Any]:
        """The transpose of `displacements`: nodal forces (..., d) summed into (n_free,), and their part on a."""
        at, flat = self.index[case][nodes].ravel(), forces.ravel()
        total = np.bincount(at, weights=flat.real, minlength=self.size)
        if np.iscomplexobj(flat):
            total = total + 1j * np.bincount(at, weights=flat.imag, minlength=self.size)
        return total[: self.n_free], total[self.grip] @ self.directions[case]


def rigid_body_modes(geometry: Geometry) -> Array:
    """(n_nodes, d, k), translations along and linearized rotations about the axes; of a body of revolution, along y."""
    e, r = np.eye(3)[:, : geometry.dim], geometry.X - geometry.X.mean(axis=0)
    if geometry.axisymmetric:
        return np.broadcast_to(e[1], r.shape)[..., None]
    turns = [np.cross(e_i, r) for e_i in e] if geometry.dim == 3 else [r[:, ::-1] * [-1.0, 1.0]]
    motions = [*e[: geometry.dim], *turns]
    return np.stack([np.broadcast_to(motion, r.shape) for motion in motions], axis=-1)


def nodes_of_faces(mesh: Mesh, faces: str) -> Array:
    """The nodes of one face or of several, such as left,top; `none` has none. Raises InputError."""
    if faces == "none":
        return np.zeros(0, dtype=int)
    return np.unique(np.concatenate([mesh.boundary(face.strip()).node_set for face in faces.split(",")]))


def held_components(mesh: Mesh, clamped: str, fixed: str | None, supported: Array) -> Array:
    """(n_nodes, d), the components held at zero: all on the faces `clamped`, those of `fixed` such as x@left,y@bottom,
    and the radial one on the axis of a body of revolution.

    Raises InputError for what names no face or component, or leaves a part of the body a rigid motion, which the nodes
    that are `supported` otherwise may prevent.
    """
    geometry = mesh.geometry
    held = np.zeros(geometry.X.shape, dtype=bool)
    held[nodes_of_faces(mesh, clamped)] = True
    for item in fixed.split(",") if fixed else ():
        axis, at, face = (part.strip() for part in item.partition("@"))
        if not at or axis not in [*AXES[: geometry.dim]]:
            what = f"a component {', '.join(AXES[: geometry.dim])} at a face"
            raise InputError(f"{mesh.who}: fixed={fixed}: '{item}' is not {what} - write x@left,y@bottom")
        held[mesh.boundary(face).node_set, AXES.index(axis)] = True
    if geometry.axisymmetric:
        held[np.abs(geometry.X[:, 0]) <= 1e-9 * mesh.diameter, 0] = True
    restrained = held.copy()
    restrained[supported] = True
    _check_held(mesh, restrained)
    return held


def _check_held(mesh: Mesh, held: Array) -> None:
    """Raises InputError if a connected part of the mesh keeps rigid-body modes: those of its held components have not
    full rank.
    """
    geometry, parts = mesh.geometry, mesh.geometry.parts
    modes = rigid_body_modes(geometry)
    modes = modes / np.abs(modes).max(axis=(0, 1))
    for part in range(parts.max() + 1):
        in_part = held & (parts == part)[:, None]
        if np.linalg.matrix_rank(modes[in_part], tol=1e-9) < modes.shape[-1]:
            what = "the body" if parts.max() == 0 else f"part {part + 1} of {parts.max() + 1} that share no node"
            count = int(in_part.any(axis=1).sum())
            raise InputError(
                f"{mesh.who}: {count} clamped nodes leave {what} free to move or turn: R_u is singular"
                " - clamp a face, or fix more of its components"
            )
