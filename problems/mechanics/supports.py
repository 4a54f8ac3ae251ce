"""Where a solid is held, at rest, at measured displacements or by springs, and which face carries the load."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np

from gradient_routes.problems.data.boundary_values import BoundaryValues
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions, held_components
from gradient_routes.problems.fem.facets import Facets
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.measured_boundary import measured_nodes
from gradient_routes.problems.mechanics.springs import Springs
from gradient_routes.problems.problem import Array

NOWHERE = np.zeros(0, dtype=int)


@dataclass(frozen=True, eq=False)
class Supports:
    """Numbers of nodes, and which of their components are held.

    loaded             the face that is loaded, or gripped
    gripped            whether a grip moves it
    springs            that hold a face in place of a clamp
    known (n_k,)       nodes whose displacements are measured
    supported (n,)     those or, with springs, the nodes that these hold
    held (n_nodes, d)  components that are zero
    clamp (n,)         nodes at rest or at known displacements, but for a grip at known ones
    moved (n,)         nodes of the loaded face that are not of the clamp
    """

    loaded: Facets
    gripped: bool
    springs: Springs | None
    known: Array
    supported: Array
    held: Array
    clamp: Array
    moved: Array

    @classmethod
    def of(cls, mesh: Mesh, o: SimpleNamespace, log: bool) -> Supports:
        """From the options `o` of a solid. Raises InputError for a loaded face of which all is clamped."""
        loaded, gripped = mesh.boundary(o.loaded, surface=True), o.load == "displacement"
        known = measured_nodes(mesh, o)
        springs = None if o.support == "clamp" else Springs.on(mesh, o.clamped, log, o.support == "springs-nt")
        supported = known if springs is None else springs.facets.node_set
        held = held_components(mesh, "none" if supported.size else o.clamped, o.fixed, supported)
        clamp = np.flatnonzero(held.all(axis=1))
        if known.size:
            clamp = np.union1d(clamp, np.setdiff1d(known, loaded.node_set) if gripped else known)
        moved = np.setdiff1d(loaded.node_set, clamp)
        if not moved.size:
            raise InputError(f"{mesh.who}: loaded={o.loaded}: all its nodes are clamped - choose another face")
        return cls(loaded, gripped, springs, known, supported, held, clamp, moved)

    @property
    def grip_is_measured(self) -> bool:
        """Whether the displacements of the grip are known node by node."""
        return self.gripped and bool(self.known.size)

    @property
    def nodes(self) -> Array:
        """All that are held or loaded: where a shape is sought they keep their place."""
        return np.union1d([*self.clamp, *self.supported], self.loaded.node_set)

    def boundary_conditions(
        self, mesh: Mesh, directions: Array, measured: tuple[BoundaryValues, ...]
    ) -> BoundaryConditions:
        """Of grips that move in the directions (cases, d), and of displacements `measured` in every case."""
        values = np.zeros((len(directions), 0, directions.shape[1]))
        if self.known.size:
            values = np.stack([of.values for of in measured])
        grip = self.moved if self.gripped and not self.known.size else NOWHERE
        return BoundaryConditions.of(mesh, self.held, grip, directions, self.known, values)
