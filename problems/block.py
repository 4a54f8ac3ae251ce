"""The block: a hyperelastic body clamped on one face and loaded on another."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.block_options import check, lengths
from gradient_routes.problems.data import probes
from gradient_routes.problems.data.displacement_data import DisplacementData
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import PHI_WIDTH, Phi, Prior
from gradient_routes.problems.errors import InputError, NotOffered
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions, check_clamp
from gradient_routes.problems.fem.elements import ElementName
from gradient_routes.problems.fem.mesh import box_mesh, read_mesh
from gradient_routes.problems.fem.prolongation import prolongate
from gradient_routes.problems.mechanics import design_variables
from gradient_routes.problems.mechanics.design_variables import FIELDS, MATERIAL, DesignName, DesignVariables, Setup
from gradient_routes.problems.mechanics.loaded_solid import Load, LoadedSolid
from gradient_routes.problems.problem import (
    Array,
    Fields,
    Linearization,
    Offers,
    Operator,
    ParameterView,
    Problem,
    Traced,
)

LawName = Literal["neo-hookean", "mooney-rivlin", "yeoh", "ogden", "linear"]
AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # of load cases 1, 2, 3
DIRECTIONS = {
    "traction": AXES * [[1.0], [0.25], [0.25]],  # bending is softer than tension
    "displacement": AXES,
    "follower": AXES[:1] / [[1.0], [2.0], [3.0]],
}
TARGET = 0.2  # displacement wanted at the top, per height
NEARLY_INCOMPRESSIBLE = 0.495


class Block(Problem):
    """A block of compressible rubber, pulled at its top: moduli, loads or its shape sought from displacements.

    State u (n_u,) [m], the free displacement components node by node, one load case after the other. Without data, the
    target displacement at height z is 0.2 z times the direction of the load case.
    """

    name = "block"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    load_steps = True
    regularization: Prior

    def __init__(
        self,
        *,
        n: Annotated[int, "cells along every edge"] = 4,
        nx: Annotated[int | None, "cells along x [n]"] = None,
        ny: Annotated[int | None, "cells along y [n]"] = None,
        nz: Annotated[int | None, "cells along z [n]"] = None,
        size: Annotated[str, "lengths Lx,Ly,Lz [m], or one for all"] = "1",
        element: Annotated[ElementName, "of the box; tetrahedra split each of its bricks in six"] = "hex8",
        mesh: Annotated[str | None, "mesh file of hexahedra or tetrahedra that meshio reads [the box]"] = None,
        clamped: Annotated[str, "face held: a name (bottom, top, left, ... or the file's) or a plane, z=0"] = "bottom",
        loaded: Annotated[str, "face loaded or gripped"] = "top",
        law: Annotated[LawName, "stored energy"] = "neo-hookean",
        nu: Annotated[float, "Poisson's ratio at small strain"] = 0.3,
        derivatives: Annotated[Literal["ad", "hand"], "P, dP/dF, dP/dq by JAX or hand-derived in NumPy"] = "ad",
        unknown: Annotated[DesignName, "what p is"] = "modulus",
        parametrization: Annotated[Literal["log", "raw"] | None, "of moduli: p = log E or p = E [log]"] = None,
        layers: Annotated[int | None, "along z, for unknown=layers [4, fewer on a coarse mesh]"] = None,
        surface: Annotated[str, "face whose nodes move, for unknown=shape"] = "right",
        load: Annotated[Load, "dead; a grip's; along the deformed normal"] = "traction",
        traction: Annotated[float, "on the loaded face, in z or along the normal [Pa]"] = 0.2,
        displacement: Annotated[float, "of the grip, in z [m]"] = 0.2,
        cases: Annotated[int, "load cases: in z, x, y (tractions across: 1/4); a follower's: 1, 1/2, 1/3"] = 1,
        sensors: Annotated[str | None, "face whose nodes are measured [loaded; right where a grip holds it]"] = None,
        markers: Annotated[int, "points measured instead, at random on `face`"] = 0,
        face: Annotated[str, "that carries the markers"] = "right",
        components: Annotated[Literal["all", "in-plane"], "of a marker's displacement"] = "all",
        data: Annotated[str | None, "CSV file x,y,z,ux,uy,uz; twin: made by a stiff inclusion [the target]"] = None,
        noise: Annotated[float, "standard deviation added to a twin's data [m]"] = 0.0,
        seed: Annotated[int, "of noise and markers"] = 0,
        alpha: Annotated[float, "weight of Phi"] = 0.0,
        phi: Annotated[Phi | None, "1/2 |D log E|^2 or total variation; amplitude: 1/2 |p - p_0|^2"] = None,
        phi_width: Annotated[float, "jump of log E below which total variation is rounded"] = PHI_WIDTH,
    ) -> None:
        self._options = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        check(SimpleNamespace(**self._options))
        from gradient_routes.problems.mechanics.materials import LAWS

        chosen, use_numpy = LAWS[law], derivatives == "hand"
        if use_numpy and chosen.numpy is None:
            raise InputError(f"block: derivatives=hand exist for neo-hookean and mooney-rivlin, not {law} - take ad")
        chosen.check(chosen.of_modulus(1.0, nu))
        cells = nx or n, ny or n, nz or n
        self._cells = None if mesh else cells
        self.mesh = read_mesh("block", mesh) if mesh else box_mesh("block", element, cells, lengths(size))
        top = self.mesh.boundary(loaded)
        clamp = self.mesh.boundary(clamped).node_set if clamped != "none" else np.zeros(0, dtype=int)
        check_clamp(self.mesh, clamp)
        if not np.setdiff1d(top.node_set, clamp).size:
            raise InputError(f"block: loaded={loaded}: all its nodes are clamped - choose another face")
        grip = np.setdiff1d(top.node_set, clamp) if load == "displacement" else np.zeros(0, dtype=int)
        directions = DIRECTIONS[load][:cases]
        self.log, uniform = parametrization != "raw", data == "twin"
        amplitude, unit = (displacement, "m") if load == "displacement" else (traction, "Pa")
        choices: dict[DesignName, Callable[[], DesignVariables]] = {
            "modulus": lambda: design_variables.moduli(self.mesh, chosen, nu, self.log, uniform),
            "layers": lambda: design_variables.layers(self.mesh, chosen, nu, self.log, uniform, layers),
            "constants": lambda: design_variables.constants(self.mesh, chosen, nu),
            "traction": lambda: design_variables.tractions(self.mesh, top, traction),
            "shape": lambda: design_variables.shape(self.mesh, surface, np.union1d(clamp, top.node_set)),
            "load": lambda: design_variables.amplitude(load, amplitude, unit),
        }
        E = design_variables.default_modulus(self.mesh.normalized(self.mesh.geometry.centres))
        base = Setup(chosen.of_modulus(E, nu), self.mesh.geometry.X, np.float64(amplitude))
        bc = BoundaryConditions.of(self.mesh, clamp, grip, directions)
        self.solid = LoadedSolid(self.mesh, chosen, bc, top, load, directions, choices[unknown](), base, use_numpy)
        self.parameters = self.solid.design.parameters
        self.regularization = self._prior(alpha, phi, phi_width, unknown)
        self.n_state = bc.n_u
        self.linear = law == "linear" and load != "follower"
        self.affine = self.linear and unknown in ("traction", "load")
        self.structure = "spd" if self.solid.symmetric else "general"
        self.matrix_free = not use_numpy
        self.noise, self.seed, self.synthetic = noise, seed, data == "twin"
        if nu > NEARLY_INCOMPRESSIBLE:
            self.notes += (f"nu={nu:.6g} is nearly incompressible: these elements lock, and digits are lost",)
        if amplitude == 0.0 and unknown in MATERIAL:
            self.notes += ("zero load: u = 0, and no gradient tells anything about the material",)
        if data is not None and data != "twin":
            self.data = self._from_file(data)
        elif markers:
            self.data = self._without_file(probes.markers(self.mesh, face, markers, components == "in-plane", seed))
        else:
            where = "right" if load == "displacement" and sensors is None else sensors
            facets = top if where is None else self.mesh.boundary(where)
            self.data = self._without_file(probes.at_nodes(self.mesh, facets.node_set))
        if self.data.reads_nothing():
            raise InputError("block: all sensors sit on clamped nodes and read zero - choose other points")

    def _from_file(self, path: str) -> DisplacementData:
        """Measurements read from a file."""
        points, d = probes.read_probes(self.mesh, path)
        greatest, size = float(np.abs(d).max()), self.mesh.diameter
        if greatest > size:
            self.notes += (f"data up to {greatest:.3g} m for a body of {size:.3g} m: are the units right?",)
        return DisplacementData(self.solid, points, d[None])

    def _without_file(self, points: probes.Probes) -> DisplacementData:
        """The target displacements; none yet for synthetic data."""
        height = TARGET * (points.x[:, 2] - self.mesh.bounding_box[0, 2])
        target = height[None, :, None] * self.solid.directions[:, None]
        return DisplacementData(self.solid, points, None if self.synthetic else target, self.noise)

    def _prior(self, alpha: float, phi: Phi | None, width: float, unknown: DesignName) -> Prior:
        """Neighbours are cells that share a facet, and adjacent layers."""
        kind = phi or ("tikhonov" if unknown in FIELDS else "amplitude")
        f2t = self.mesh.skfem_mesh.f2t
        pairs = np.asarray(f2t.T[f2t[1] != -1]) if unknown == "modulus" else None
        prior = Prior(alpha, kind, width, pairs, self.parameters.start, self.parameters.scale)
        if kind == "amplitude" and unknown in FIELDS:
            prior = replace(prior, origin=self._theta(self.parameters.start), scale=1.0)
        prior.check("block")
        return prior

    # --- the problem contract

    def initial(self, p: Array) -> Array:
        return self.solid.initial(p)

    def residual(self, u: Array, p: Array) -> Array:
        return self.solid.residual(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        return self.solid.tangent(u, p)

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        return self.solid.tangent_operator(u, p)

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 sum over load cases of |S u - d|^2, and alpha Phi [m^2]."""
        J = self.data.misfit(u, p, xp)
        return J + self.regularization.value(xp, self._theta(p, xp)) if self.alpha else J

    def _theta(self, p: Any, xp: Any = np) -> Any:
        """The regularized quantity: log E for moduli, else p."""
        return p if self.log or self.solid.design.modulus_of_cell is None else xp.log(p)

    def observation(self, u: Array, p: Array) -> Observation:
        return self.data.observation(u, p)

    def candidates(self) -> Candidates:
        return self.data.candidates()

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        theta = self._theta(p)
        return self.regularization, theta, np.ones_like(p) if theta is p else 1.0 / p

    def linearize(self, u: Array, p: Array) -> Linearization:
        J_u, J_a = self.data.misfit_gradient(u, p)
        J_p = np.full_like(p, J_a if self.solid.grip_is_parameter else 0.0)
        if self.alpha:
            prior, theta, by_p = self.prior(p)
            J_p = J_p + prior.gradient(theta) * by_p
        return Linearization(self.solid.R_p(u, p), J_u, J_p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=self.solid.traced_residual, objective=lambda u, p: self.objective(u, p, jnp))

    def refined(self, p: Array) -> tuple[Block, Array] | None:
        """Every cell of a box split in eight; None for mesh files and for p that depends on the mesh. Synthetic data
        have to be computed anew.
        """
        unknown = self._options["unknown"]
        if self._cells is None or unknown in ("traction", "shape"):
            return None
        nx, ny, nz = (2 * n for n in self._cells)
        layers = len(p) if unknown == "layers" else None
        finer = Block(**self._options | {"n": 4, "nx": nx, "ny": ny, "nz": nz, "layers": layers})
        if unknown != "modulus":
            return finer, p
        return finer, prolongate(p, self.mesh.geometry.centres, finer.mesh.geometry.centres)

    def case(self) -> dict[str, Any]:
        """With one dead load on moduli, read at nodes."""
        solid, probes, options = self.solid, self.data.probes, self._options
        undescribed = {
            "load": solid.load != "traction",
            "cases": len(solid.directions) > 1,
            "unknown": solid.design.modulus_of_cell is None,
            "markers" if options["markers"] else "data": probes.nodes.shape[1] > 1 or not probes.measured.all(),
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
            "modulus": solid.design.modulus_of_cell,
            "parametrization": "log" if self.log else "raw",
        }

    # --- synthetic data

    def truth(self) -> Array | None:
        return self.solid.design.truth if self.synthetic else None

    def twin(self) -> Block | None:
        return self._with(self.data.zeros()) if self.data.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Block:
        setup = self.solid.setup(self.solid.design.truth)
        rng = np.random.default_rng(self.seed if seed is None else seed)
        return self._with(self.data.synthesized(u, setup, rng))

    def load_cases(self) -> list[Problem]:
        """Each includes the whole of alpha Phi."""
        cases = len(self.solid.directions)
        return [self._with(self.data.single_case(case)) for case in range(cases)] if cases > 1 else []

    def _with(self, data: DisplacementData) -> Block:
        other = copy.copy(self)  # shares the mesh and the compiled functions
        other.data, other.solid = data, data.solid
        other.n_state = data.solid.bc.n_u
        return other

    # --- output

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u, lam (n_nodes, 3) per load case; E, dJ/dE per cell if p are moduli; dJ/dX per node if p is a shape."""
        solid, design, geometry = self.solid, self.solid.design, self.mesh.geometry
        s, every, cases = solid.setup(p), np.arange(len(geometry.X)), len(solid.directions)
        vectors = {"u": (u, s)} if lam is None else {"u": (u, s), "lambda": (lam, replace(s, load=0.0 * s.load))}
        point_data, cell_data = {}, {}
        for case in range(cases):
            for name, (v, at) in vectors.items():
                numbered = f"{name}_{case + 1}" if cases > 1 else name
                point_data[numbered] = solid.displacements(v, at, case, every)
        if design.modulus_of_cell is not None:
            E = np.exp(p) if self.log else p
            by_E = gradient / E if self.log else gradient
            cell_data = {"E": E[design.modulus_of_cell], "dJ_dE": by_E[design.modulus_of_cell]}
        if design.moved_nodes is not None:
            point_data["dJ_dX"] = np.zeros_like(s.X)
            point_data["dJ_dX"][design.moved_nodes] = gradient.reshape(-1, 3)
        return Fields(s.X, *geometry.for_meshio(), point_data, cell_data)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x = self.parameters.position
        return ParameterView() if x is None else ParameterView(dict(zip("xyz", x.T, strict=True)))
