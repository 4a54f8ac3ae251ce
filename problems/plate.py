"""The plate: a hyperelastic body in plane stress, plane strain or of revolution."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Annotated, Literal

import numpy as np

from gradient_routes.problems.data.regularization import PHI_WIDTH, Phi
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.fem.elements import PlaneElement
from gradient_routes.problems.fem.mesh import Mesh
from gradient_routes.problems.fem.mesh_files import read_mesh
from gradient_routes.problems.fem.plane_meshes import hole_mesh, rectangle_mesh
from gradient_routes.problems.mechanics import solid_options as options
from gradient_routes.problems.mechanics.design_variables import PlaneDesign
from gradient_routes.problems.mechanics.solid import Solid

AXES = np.array([[0.0, 1.0], [1.0, 0.0]])  # of load cases 1, 2
DIRECTIONS = {
    "traction": AXES * [[1.0], [0.25]],  # bending is softer than tension
    "displacement": AXES,
    "follower": AXES[:1] / [[1.0], [2.0]],
}
RADIUS = 0.2  # of the hole, in lengths of the shorter edge of its rectangle


class Plate(Solid):
    """A plate of compressible rubber, or a body of revolution, pulled at its top: moduli, thickness or loads sought.

    State u (n_u,) [m], the free displacement components node by node, one load case after the other. Without data, the
    target displacement at height y is 0.2 y times the direction of the load case. In plane stress P_33 = 0 at every
    point; a body of revolution turns about x = 0, x being its radius, and its loads are those of the whole circle.
    """

    name = "plate"

    def __init__(
        self,
        *,
        kind: Annotated[options.Kind, "of state; axisymmetric: about x = 0"] = "plane-stress",
        body: Annotated[
            Literal["rectangle", "hole", "quarter"], "with a hole in its middle, a quarter of that"
        ] = "rectangle",
        n: options.Count = 4,
        nx: options.Along = None,
        ny: options.Along = None,
        size: Annotated[str, "lengths Lx,Ly [m], or one for both"] = "1",
        radius: Annotated[
            float | None, "of the hole [a fifth of its edge]; inner one of a ring, Lx wide [0] [m]"
        ] = None,
        thickness: Annotated[float, "out of the plane [m]"] = 1.0,
        element: Annotated[PlaneElement, "of the body; triangles split each of its quadrilaterals in two"] = "quad4",
        mesh: Annotated[str | None, "mesh file of quadrilaterals or triangles that meshio reads [the body]"] = None,
        mesh_unit: options.MeshUnit = "m",
        clamped: Annotated[
            str, "edges held: bottom, top,left, right, hole, the file's, a line y=0, or none"
        ] = "bottom",
        fixed: options.Fixed = None,
        boundary: options.BoundaryOf = "zero",
        support: options.SupportOf = "clamp",
        loaded: Annotated[str, "edge loaded or gripped"] = "top",
        law: options.Law = "neo-hookean",
        nu: options.Nu = 0.3,
        modulus: options.Modulus = None,
        derivatives: options.Derivatives = None,
        unknown: Annotated[PlaneDesign, "what p is"] = "modulus",
        constants: options.Constants = None,
        parametrization: Annotated[
            Literal["log", "raw"] | None, "of moduli and thickness: p = log E or E [log]"
        ] = None,
        layers: Annotated[int | None, "along y, for unknown=layers [4, fewer on a coarse mesh]"] = None,
        surface: Annotated[str, "edge whose nodes move, for unknown=shape"] = "right",
        load: options.LoadKind = "traction",
        traction: Annotated[float, "on the loaded edge, in y or along the normal [Pa]"] = 0.2,
        force: options.Force = None,
        force_noise: options.ForceNoise = None,
        direction: options.Direction = None,
        displacement: Annotated[float, "of the grip, in y [m]"] = 0.2,
        cases: Annotated[int, "load cases: in y, x (traction across: 1/4); a follower's: 1, 1/2"] = 1,
        sensors: Annotated[
            str | None, "edge whose nodes are measured, or everywhere [loaded; right with a grip]"
        ] = None,
        markers: options.MarkerCount = 0,
        face: Annotated[str, "edge that carries the markers"] = "right",
        components: options.Components = "all",
        data: Annotated[
            str | None, "file with columns x,y,ux,uy, or strains exx,eyy,exy; twin: of a stiff inclusion [the target]"
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
        o = SimpleNamespace(**given)
        options.check("plate", o, "xy")
        _check(o)
        from gradient_routes.problems.mechanics.plane_laws import plane_law

        plane = read_mesh("plate", mesh, mesh_unit, dim=2) if mesh else _built_in(o)
        section = replace(plane.geometry, thickness=float(thickness), axisymmetric=kind == "axisymmetric")
        plane = replace(plane, geometry=section)
        _check_radius(plane)
        self.locks = kind != "plane-stress"
        super().__init__(given, plane, plane_law(law, kind), DIRECTIONS[load][:cases])


def _check(o: SimpleNamespace) -> None:
    """Raises InputError for options of the plate alone."""
    turns, meshed = o.kind == "axisymmetric", o.mesh is not None
    if not 0.0 < o.thickness < math.inf:
        raise InputError(f"plate: thickness={o.thickness:g} - choose a finite one > 0")
    if turns and (o.thickness != 1.0 or o.unknown == "thickness"):
        raise InputError("plate: a body of revolution (kind=axisymmetric) has no thickness - leave it out")
    has_radius = o.body != "rectangle" or turns
    check_applies(
        "plate",
        ("mesh", meshed, False, {"body": o.body != "rectangle", "radius": o.radius is not None}),
        ("body=hole or quarter, or kind=axisymmetric", has_radius, True, {"radius": o.radius is not None}),
    )


def _built_in(o: SimpleNamespace) -> Mesh:
    """The rectangle, with or without its hole. Raises InputError for a radius that does not fit."""
    Lx, Ly = options.lengths("plate", o.size, 2)
    cells = o.nx or o.n, o.ny or o.n
    if o.body == "rectangle":
        inner = o.radius or 0.0
        if not 0.0 <= inner < math.inf:
            raise InputError(f"plate: radius={inner:g} - the inner radius of a ring is finite and >= 0")
        return rectangle_mesh("plate", o.element, cells, (Lx, Ly), inner)
    quarter = o.body == "quarter"
    room = min(Lx, Ly) / (1.0 if quarter else 2.0)
    radius = RADIUS * min(Lx, Ly) if o.radius is None else o.radius
    if not 0.0 < radius < room:
        raise InputError(f"plate: radius={radius:g} - a hole in this plate has a radius > 0 and < {room:g} m")
    odd = [(name, count) for name, count in zip(("nx", "ny"), cells, strict=True) if count % 2]
    if odd:
        raise InputError(f"plate: {odd[0][0]}={odd[0][1]} - around a hole edges have an even number of cells")
    return hole_mesh("plate", o.element, cells, o.n, (Lx, Ly), radius, quarter)


def _check_radius(plane: Mesh) -> None:
    """Raises InputError for a body of revolution that reaches across its axis."""
    least = float(plane.bounding_box[0, 0])
    if plane.geometry.axisymmetric and least < -1e-9 * plane.diameter:
        raise InputError(
            f"plate: kind=axisymmetric, but x goes from {least:g} m: it is the radius, so x >= 0 - move the mesh"
        )
