"""The load of a solid: the option's own in one or more directions, or that of every load case of a file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from gradient_routes.problems.data.load_cases import LoadCases
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.mechanics.load_direction import load_direction
from gradient_routes.problems.mechanics.measured_boundary import forces
from gradient_routes.problems.mechanics.supports import Supports
from gradient_routes.problems.problem import Array


@dataclass(frozen=True, eq=False)
class Loading:
    """A traction or the displacement of a grip, the amplitude times a direction in every load case.

    unit                   of the amplitude, Pa or m
    directions (cases, d)  per unit amplitude
    area                   of the loaded face [m^2]
    forces (cases,)        measured on a grip [N], None where none are
    """

    amplitude: float
    unit: str
    directions: Array
    area: float
    forces: Array | None = None

    @classmethod
    def of(cls, mesh: Mesh, o: SimpleNamespace, supports: Supports, directions: Array) -> Loading:
        """From the options `o` of a solid; their direction, if it is given, in place of `directions` (cases, d).

        Raises InputError.
        """
        area = float(supports.loaded.areas(mesh.geometry.X, np).sum())
        if not supports.gripped and not area > 0.0:
            raise InputError(f"{mesh.who}: loaded={o.loaded} lies on the axis and has no area - choose another face")
        if o.direction is not None:
            directions = load_direction(o.direction, supports.loaded, mesh.who)[None]
        if supports.gripped:
            return cls(o.displacement, "m", directions, area)
        return cls(o.traction if o.force is None else o.force / area, "Pa", directions, area)

    def of_file(self, o: SimpleNamespace, supports: Supports, loads: LoadCases | None, who: str) -> Loading:
        """With the load cases of a file, if it tells any. Raises InputError."""
        F = forces(o, loads, who) if supports.gripped else None
        if supports.grip_is_measured:
            cases = 1 if loads is None else len(loads.values)
            return replace(self, amplitude=0.0, directions=np.repeat(self.directions[:1], cases, axis=0), forces=F)
        if loads is None:
            return replace(self, forces=F)
        if o.unknown == "traction" and len(loads.values) > 1:
            raise InputError(f"{who}: unknown=traction takes one load case, {o.data} has {len(loads.values)}")
        if o.force is not None and loads.kind != "ratio":
            raise InputError(f"{who}: force= and column load of {o.data} both state the load - keep one")
        a = loads.amplitudes(o.load, self.amplitude, self.area, who)
        if a.ndim == 2:
            if o.load == "follower" or o.direction is not None:
                other = "load=follower" if o.load == "follower" else f"direction={o.direction}"
                raise InputError(f"{who}: {other} and columns load_x.. of {o.data} both state a direction - keep one")
            largest = self.amplitude if loads.kind == "ratio" else float(np.linalg.norm(a, axis=1).max())
            return replace(self, amplitude=largest, directions=a / (largest or 1.0), forces=F)
        largest = self.amplitude if loads.kind == "ratio" else float(a[np.abs(a).argmax()])
        return replace(self, amplitude=largest, directions=np.outer(a / (largest or 1.0), self.directions[0]), forces=F)
