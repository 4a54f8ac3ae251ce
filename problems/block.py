"""The block: a hyperelastic body clamped on one face and loaded on another."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data.regularization import PHI_WIDTH, Phi
from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.fem.elements import SolidElement
from gradient_routes.problems.fem.mesh import box_mesh
from gradient_routes.problems.fem.mesh_files import read_mesh
from gradient_routes.problems.mechanics import solid_options as options
from gradient_routes.problems.mechanics.design_variables import DesignName
from gradient_routes.problems.mechanics.solid import Solid

AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # of load cases 1, 2, 3
DIRECTIONS = {
    "traction": AXES * [[1.0], [0.25], [0.25]],  # bending is softer than tension
    "displacement": AXES,
    "follower": AXES[:1] / [[1.0], [2.0], [3.0]],
}


class Block(Solid):
    """A block of compressible rubber, pulled at its top: moduli, loads or its shape sought from displacements.

    State u (n_u,) [m], the free displacement components node by node, one load case after the other. Without data, the
    target displacement at height z is 0.2 z times the direction of the load case.
    """

    name = "block"

    def __init__(
        self,
        *,
        n: options.Count = 4,
        nx: options.Along = None,
        ny: options.Along = None,
        nz: options.Along = None,
        size: Annotated[str, "lengths Lx,Ly,Lz [m], or one for all"] = "1",
        element: Annotated[SolidElement, "of the box; tetrahedra split each of its bricks in six"] = "hex8",
        mesh: Annotated[str | None, "mesh file of hexahedra or tetrahedra that meshio reads [the box]"] = None,
        mesh_unit: options.MeshUnit = "m",
        clamped: Annotated[str, "faces held: names (bottom, top,left, ... or the file's) or a plane, z=0"] = "bottom",
        fixed: options.Fixed = None,
        boundary: options.BoundaryOf = "zero",
        support: options.SupportOf = "clamp",
        loaded: Annotated[str, "face loaded or gripped"] = "top",
        law: options.Law = "neo-hookean",
        nu: options.Nu = 0.3,
        modulus: options.Modulus = None,
        derivatives: options.Derivatives = None,
        unknown: Annotated[DesignName, "what p is"] = "modulus",
        constants: options.Constants = None,
        parametrization: Annotated[Literal["log", "raw"] | None, "of moduli: p = log E or p = E [log]"] = None,
        layers: Annotated[int | None, "along z, for unknown=layers [4, fewer on a coarse mesh]"] = None,
        surface: Annotated[str, "face whose nodes move, for unknown=shape"] = "right",
        load: options.LoadKind = "traction",
        traction: Annotated[float, "on the loaded face, in z or along the normal [Pa]"] = 0.2,
        force: options.Force = None,
        force_noise: options.ForceNoise = None,
        direction: options.Direction = None,
        displacement: Annotated[float, "of the grip, in z [m]"] = 0.2,
        cases: Annotated[int, "load cases: in z, x, y (tractions across: 1/4); a follower's: 1, 1/2, 1/3"] = 1,
        sensors: Annotated[
            str | None, "face whose nodes are measured, or everywhere [loaded; right with a grip]"
        ] = None,
        markers: options.MarkerCount = 0,
        face: Annotated[str, "that carries the markers"] = "right",
        components: options.Components = "all",
        data: Annotated[
            str | None,
            "file with columns x,y,z,ux,uy,uz, or strains exx,eyy..; twin: of a stiff inclusion [the target]",
        ] = None,
        columns: options.Columns = None,
        units: options.Units = None,
        outside: options.OutsideOf = "refuse",
        motion: options.MotionOf = "none",
        noise: options.Noise = None,
        strain_noise: options.StrainNoise = None,
        seed: options.Seed = 0,
        alpha: options.Alpha = 0.0,
        phi: Annotated[Phi | None, "1/2 |D log E|^2 or total variation; amplitude: 1/2 |p - p_0|^2"] = None,
        phi_width: options.PhiWidth = PHI_WIDTH,
    ) -> None:
        given = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        options.check(self.name, SimpleNamespace(**given), "xyz")
        from gradient_routes.problems.mechanics.materials import LAWS

        if mesh:
            body = read_mesh(self.name, mesh, mesh_unit)
        else:
            Lx, Ly, Lz = options.lengths(self.name, size, 3)
            body = box_mesh(self.name, element, (nx or n, ny or n, nz or n), (Lx, Ly, Lz))
        super().__init__(given, body, LAWS[law], DIRECTIONS[load][:cases])

    def case(self) -> dict[str, Any]:
        """With one dead load on moduli, read at nodes."""
        solid, probes, options = self.solid, self.data.probes[0], self._options
        undescribed = {
            "load": solid.load != "traction",
            "fixed": options["fixed"] is not None,
            "cases": options["cases"] > 1,
            "boundary": options["boundary"] != "zero",
            "support": options["support"] != "clamp",
            "unknown": solid.design.parameter_of_cell is None,
            "markers" if options["markers"] else "data": probes.nodes.shape[1] > 1 or not probes.measured.all(),
            "data": len(solid.directions) > options["cases"],
            "motion": self.data.motions is not None,
            "alpha": self.alpha > 0.0,
        }
        for name in (name for name, holds in undescribed.items() if holds):
            raise NotOffered(f"block: {name}={options[name]} is not described to other codes - leave it out")
        geometry = self.mesh.geometry
        cell_type, cells = geometry.for_meshio()
        forces = np.zeros_like(geometry.X)
        np.add.at(forces, solid.loaded.nodes, solid.dead_forces(solid.base, 0, np))
        return {
            "kind": "hyperelastic",
            "points": geometry.X,
            "cell_type": cell_type,
            "cells": cells,
            "clamped": solid.bc.clamped,
            "forces": forces,
            "sensors": probes.nodes[:, 0],
            "data": self.data.require_data()[0],
            "law": solid.law.name,
            "nu": options["nu"],
            "modulus": solid.design.parameter_of_cell,
            "parametrization": "log" if self.log else "raw",
        }
