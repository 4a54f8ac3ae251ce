"""The block: a hyperelastic body on a clamped face, loaded on another; the problem people have."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data import probes
from gradient_routes.problems.data.displacement_data import DisplacementData
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import WIDTH as JUMP
from gradient_routes.problems.data.regularization import Phi, Prior
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem import mesh as bodies
from gradient_routes.problems.fem.boundary_conditions import Supports, check_clamp
from gradient_routes.problems.fem.elements import ElementName
from gradient_routes.problems.fem.prolongation import inherited
from gradient_routes.problems.mechanics import design_variables as unknowns
from gradient_routes.problems.mechanics.block_options import check, lengths
from gradient_routes.problems.mechanics.design_variables import FIELDS, MATERIAL, Setting, Unknown, UnknownName
from gradient_routes.problems.mechanics.loaded_solid import Load, Mechanics
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
DIRECTIONS = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # of load case 1, 2, 3
ACROSS = 0.25  # of the traction: pushed sideways a block bends, and far
TARGET = 0.2  # of the body's height: how far the top should go, where nobody has measured
NEARLY_INCOMPRESSIBLE = 0.495


class Block(Problem):
    """A block of compressible rubber, pulled at its top: moduli, loads or its shape sought from displacements.

    State u (n_u,) [m], free displacement components, node by node, one load case after the other. Without data, J asks
    for the displacement (0, 0, 0.2 z) in units of the height, along x in the second load case and y in the third.
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
        unknown: Annotated[UnknownName, "what p is"] = "modulus",
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
        phi_width: Annotated[float, "jump of log E below which total variation is rounded"] = JUMP,
    ) -> None:
        self._given = {name: value for name, value in locals().items() if name not in ("self", "__class__")}
        check(SimpleNamespace(**self._given))
        from gradient_routes.problems.mechanics.materials import LAWS

        chosen, by_hand = LAWS[law], derivatives == "hand"
        if by_hand and chosen.hand is None:
            raise InputError(f"block: derivatives=hand exist for neo-hookean and mooney-rivlin, not {law} - take ad")
        chosen.check(chosen.of_modulus(1.0, nu))
        cells = nx or n, ny or n, nz or n
        self._cells = None if mesh else cells
        self.body = bodies.read("block", mesh) if mesh else bodies.box("block", element, cells, lengths(size))
        body, top = self.body, self.body.surface(loaded)
        clamp = body.surface(clamped).node_set if clamped != "none" else np.zeros(0, dtype=int)
        check_clamp(body, clamp)
        if not np.setdiff1d(top.node_set, clamp).size:
            raise InputError(f"block: loaded={loaded}: all its nodes are clamped - choose another face")
        grip = np.setdiff1d(top.node_set, clamp) if load == "displacement" else np.zeros(0, dtype=int)
        directions = DIRECTIONS[:cases] * (np.array([[1.0], [ACROSS], [ACROSS]])[:cases] if load == "traction" else 1.0)
        self.log, blank = parametrization != "raw", data == "twin"
        amplitude, unit = (displacement, "m") if load == "displacement" else (traction, "Pa")
        choices: dict[UnknownName, Callable[[], Unknown]] = {
            "modulus": lambda: unknowns.moduli(body, chosen, nu, self.log, blank),
            "layers": lambda: unknowns.layers(body, chosen, nu, self.log, blank, layers),
            "constants": lambda: unknowns.constants(body, chosen, nu),
            "traction": lambda: unknowns.tractions(body, top, traction),
            "shape": lambda: unknowns.shape(body, surface, np.union1d(clamp, top.node_set)),
            "load": lambda: unknowns.amplitude(load, amplitude, unit),
        }
        E = unknowns.default_modulus(body.relative(body.geometry.centres))
        at_rest = Setting(chosen.of_modulus(E, nu), body.geometry.X, np.float64(amplitude))
        supports = Supports.of(body, clamp, grip, directions)
        self.mechanics = Mechanics(body, chosen, supports, top, load, directions, choices[unknown](), at_rest, by_hand)
        self.parameters = self.mechanics.unknown.parameters
        self.regularization = self._prior(alpha, phi, phi_width, unknown)
        self.n_state = supports.n_u
        self.linear = law == "linear" and load != "follower"
        self.affine = self.linear and unknown in ("traction", "load")
        self.structure = "spd" if self.mechanics.symmetric else "general"
        self.offset = float(np.ptp(body.box, axis=0).max())  # grad u is added to 1, u to nothing larger than the body
        self.matrix_free = not by_hand
        self.noise, self.seed, self.twin_data = noise, seed, data == "twin"
        if nu > NEARLY_INCOMPRESSIBLE:
            self.notes += (f"nu={nu:.6g} is nearly incompressible: these elements lock, and digits are lost",)
        if amplitude == 0.0 and unknown in MATERIAL:
            self.notes += ("zero load: u = 0, and no gradient tells anything about the material",)
        if data is not None and data != "twin":
            self.data = self._measured(data)
        elif markers:
            self.data = self._unmeasured(probes.markers(body, face, markers, components == "in-plane", seed))
        else:
            where = "right" if load == "displacement" and sensors is None else sensors
            facets = top if where is None else body.surface(where)
            self.data = self._unmeasured(probes.at_nodes(body, facets.node_set))
        if self.data.reads_nothing():
            raise InputError("block: all sensors sit on clamped nodes and read zero - choose other points")

    def _measured(self, path: str) -> DisplacementData:
        """From a file."""
        points, d = probes.measured(self.body, path)
        greatest, size = float(np.abs(d).max()), self.body.size
        if greatest > size:
            self.notes += (f"data up to {greatest:.3g} m for a body of {size:.3g} m: are the units right?",)
        return DisplacementData(self.mechanics, points, d[None])

    def _unmeasured(self, points: probes.Probes) -> DisplacementData:
        """The target, or none yet for a twin."""
        height = TARGET * (points.x[:, 2] - self.body.box[0, 2])
        directions = self.mechanics.directions
        if self.mechanics.load == "follower":  # along the normal in every case, only less
            directions = directions[:1] / (1.0 + np.arange(len(directions)))[:, None]
        target = height[None, :, None] * directions[:, None]
        return DisplacementData(self.mechanics, points, None if self.twin_data else target, self.noise)

    def _prior(self, alpha: float, phi: Phi | None, width: float, unknown: UnknownName) -> Prior:
        """Neighbours are cells with a facet in common, and layers one above the other."""
        kind = phi or ("tikhonov" if unknown in FIELDS else "amplitude")
        f2t = self.body.mesh.f2t
        pairs = np.asarray(f2t.T[f2t[1] >= 0]) if unknown == "modulus" else None
        prior = Prior(alpha, kind, width, pairs, self.parameters.start, self.parameters.scale)
        if kind == "amplitude" and unknown in FIELDS:
            prior = replace(prior, origin=self._theta(self.parameters.start), scale=1.0)
        prior.check("block")
        return prior

    # --- the contract

    def initial(self, p: Array) -> Array:
        return self.mechanics.initial(p)

    def residual(self, u: Array, p: Array) -> Array:
        return self.mechanics.residual(u, p)

    def tangent(self, u: Array, p: Array) -> Any:
        return self.mechanics.tangent(u, p)

    def tangent_operator(self, u: Array, p: Array) -> Operator:
        return self.mechanics.tangent_operator(u, p)

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 sum over load cases of |S u - d|^2, and alpha Phi [m^2]."""
        J = self.data.misfit(u, p, xp)
        return J + self.regularization.value(xp, self._theta(p, xp)) if self.alpha else J

    def _theta(self, p: Any, xp: Any = np) -> Any:
        """What is regularized: log E of moduli, p itself of others."""
        return p if self.log or self.mechanics.unknown.group is None else xp.log(p)

    def observation(self, u: Array, p: Array) -> Observation:
        return self.data.observation(u, p)

    def candidates(self) -> Candidates:
        return self.data.candidates()

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        theta = self._theta(p)
        return self.regularization, theta, np.ones_like(p) if theta is p else 1.0 / p

    def linearize(self, u: Array, p: Array) -> Linearization:
        J_u, J_a = self.data.misfit_gradient(u, p)
        J_p = np.full_like(p, J_a if self.mechanics.moves_grip else 0.0)
        if self.alpha:
            prior, theta, by_p = self.prior(p)
            J_p = J_p + prior.gradient(theta) * by_p
        return Linearization(self.mechanics.by_p(u, p), J_u, J_p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=self.mechanics.traced_residual, objective=lambda u, p: self.objective(u, p, jnp))

    def refined(self, p: Array) -> tuple[Block, Array] | None:
        """Every cell of a box in eight, for unknowns that a finer box has, too; a twin is still to be solved for."""
        unknown = self._given["unknown"]
        if self._cells is None or unknown in ("traction", "shape"):
            return None
        nx, ny, nz = (2 * n for n in self._cells)
        layers = len(p) if unknown == "layers" else None
        finer = Block(**self._given | {"n": 4, "nx": nx, "ny": ny, "nz": nz, "layers": layers})
        if unknown != "modulus":
            return finer, p
        return finer, inherited(p, self.body.geometry.centres, finer.body.geometry.centres)

    # --- synthetic data

    def truth(self) -> Array | None:
        return self.mechanics.unknown.truth if self.twin_data else None

    def twin(self) -> Block | None:
        return self._with(self.data.blank()) if self.data.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Block:
        setting = self.mechanics.setting(self.mechanics.unknown.truth)
        rng = np.random.default_rng(self.seed if seed is None else seed)
        return self._with(self.data.made(u, setting, rng))

    def load_cases(self) -> list[Problem]:
        """Each with the whole of Phi."""
        cases = len(self.mechanics.directions)
        return [self._with(self.data.alone(case)) for case in range(cases)] if cases > 1 else []

    def _with(self, data: DisplacementData) -> Block:
        other = copy.copy(self)  # shares the geometry and what is compiled: no data in it
        other.data, other.mechanics = data, data.mechanics
        other.n_state = data.mechanics.supports.n_u
        return other

    # --- what a person looks at

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u and lam (n_nodes, 3) of every load case; E and dJ/dE of every cell, dJ/dX of every node, as p has them."""
        mechanics, unknown, geometry = self.mechanics, self.mechanics.unknown, self.body.geometry
        s, every, cases = mechanics.setting(p), np.arange(len(geometry.X)), len(mechanics.directions)
        vectors = {"u": (u, s)} if lam is None else {"u": (u, s), "lambda": (lam, replace(s, load=0.0 * s.load))}
        point_data, cell_data = {}, {}
        for case in range(cases):
            for name, (v, at) in vectors.items():
                numbered = f"{name}_{case + 1}" if cases > 1 else name
                point_data[numbered] = mechanics.displacements(v, at, case, every)
        if unknown.group is not None:
            E = np.exp(p) if self.log else p
            cell_data = {"E": E[unknown.group], "dJ_dE": (gradient / E if self.log else gradient)[unknown.group]}
        if unknown.nodes is not None:
            point_data["dJ_dX"] = np.zeros_like(s.X)
            point_data["dJ_dX"][unknown.nodes] = gradient.reshape(-1, 3)
        return Fields(s.X, *geometry.for_meshio(), point_data, cell_data)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x = self.parameters.position
        return ParameterView() if x is None else ParameterView(dict(zip("xyz", x.T, strict=True)))
