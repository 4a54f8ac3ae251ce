"""A hyperelastic body held on one face and loaded on another: what all problems of solids share."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.data import probes
from gradient_routes.problems.data.displacement_data import DisplacementData
from gradient_routes.problems.data.load_cases import LoadCases
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import Phi, Prior
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.errors import InputError, NotOffered
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions, held_components, nodes_of_faces
from gradient_routes.problems.fem.mesh import AXES, Mesh
from gradient_routes.problems.fem.prolongation import prolongate
from gradient_routes.problems.mechanics import design_variables
from gradient_routes.problems.mechanics.constants import Constants
from gradient_routes.problems.mechanics.design_variables import (
    CELLWISE,
    FIELDS,
    FITTED,
    MATERIAL,
    MODULI,
    AnyDesign,
    DesignVariables,
    Setup,
)
from gradient_routes.problems.mechanics.in_words import load_in_words, support_in_words
from gradient_routes.problems.mechanics.load_direction import load_direction
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.mechanics.measured_boundary import force_data, forces, in_words, measured_nodes
from gradient_routes.problems.mechanics.springs import Springs
from gradient_routes.problems.problem import (
    Array,
    End,
    Fields,
    Linearization,
    Offers,
    Operator,
    ParameterView,
    Problem,
    Traced,
)

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.materials import MaterialLaw

TARGET = 0.2  # displacement wanted at the top, per height
NEARLY_INCOMPRESSIBLE = 0.495
NEARLY_CONSTANT_VOLUME = 0.45


class Solid(Problem):
    """State u (n_u,) [m], the free displacement components node by node, one load case after the other.

    Without data, the target displacement at a height is 0.2 of it times the direction of the load case.
    """

    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    load_steps = True
    locks = True
    regularization: Prior

    def __init__(self, options: dict[str, Any], mesh: Mesh, law: MaterialLaw, directions: Array) -> None:
        """`options` of the problem, which its checks have passed; directions (cases, d) of its loads."""
        o = SimpleNamespace(**options)
        self._options, self.mesh = options, mesh
        exist = law.numpy is not None and o.unknown in MATERIAL and o.load != "follower"
        use_numpy = exist if o.derivatives is None else o.derivatives == "hand"
        if use_numpy and law.numpy is None:
            raise InputError(
                f"{self.name}: derivatives=hand exist for neo-hookean and mooney-rivlin, not {o.law} - take ad"
            )
        law.check(law.of_modulus(1.0, o.nu))
        top, known, gripped = mesh.boundary(o.loaded, surface=True), measured_nodes(mesh, o), o.load == "displacement"
        self.log = o.parametrization != "raw"
        springs = Springs.on(mesh, o.clamped, self.log) if o.support == "springs" else None
        supported = known if springs is None else springs.facets.node_set
        held = held_components(mesh, "none" if supported.size else o.clamped, o.fixed, supported)
        clamp = np.flatnonzero(held.all(axis=1))
        if known.size:
            clamp = np.union1d(clamp, np.setdiff1d(known, top.node_set) if gripped else known)
        moved = np.setdiff1d(top.node_set, clamp)
        if not moved.size:
            raise InputError(f"{self.name}: loaded={o.loaded}: all its nodes are clamped - choose another face")
        area = float(top.areas(mesh.geometry.X, np).sum())
        if not gripped and not area > 0.0:
            raise InputError(f"{self.name}: loaded={o.loaded} lies on the axis and has no area - choose another face")
        E, measured = o.modulus or 1.0, o.data not in (None, "twin")
        noise = standard_deviation(o.noise, measured, self.name)
        self.measured = measured
        uniform = o.data is not None or o.modulus is not None
        if o.direction is not None:
            directions = load_direction(o.direction, top, self.name)[None]
        strain_noise = standard_deviation(o.strain_noise, True, self.name, "ratio", "strain_noise")
        reading = (o.columns, o.units, o.outside, noise, known, strain_noise)
        found = probes.read_probes(mesh, o.data, *reading) if measured else None
        traction = o.traction if o.force is None else o.force / area
        amplitude, unit = (o.displacement, "m") if gripped else (traction, "Pa")
        loads = None if found is None else found.loads
        F = forces(o, loads, self.name) if gripped and measured else None
        if gripped and known.size:
            amplitude, directions = 0.0, np.repeat(directions[:1], 1 if loads is None else len(loads.values), axis=0)
        elif loads is not None:
            amplitude, directions = self._by_file(loads, amplitude, directions[0], area)
        self.constants = None if o.constants is None else Constants.parse(o.constants, law, self.name)
        field = design_variables.default_modulus(mesh.normalized(mesh.geometry.centres))
        q = law.of_modulus(np.full_like(field, E) if measured or o.modulus else field, o.nu)
        choices: dict[AnyDesign, Callable[[], DesignVariables]] = {
            "modulus": lambda: design_variables.moduli(mesh, law, o.nu, self.log, uniform, E),
            "layers": lambda: design_variables.layers(mesh, law, o.nu, self.log, uniform, E, o.layers),
            "regions": lambda: design_variables.regions(mesh, law, o.nu, self.log, uniform, E),
            "thickness": lambda: design_variables.thicknesses(mesh, q, self.log, uniform),
            "constants": lambda: (
                self.constants.design(mesh, law, o.nu, E)
                if self.constants
                else design_variables.constants(mesh, law, o.nu, E)
            ),
            "traction": lambda: design_variables.tractions(mesh, top, amplitude * directions[0]),
            "shape": lambda: design_variables.shape(mesh, o.surface, np.union1d([*clamp, *supported], top.node_set)),
            "load": lambda: design_variables.amplitude(o.load, amplitude, unit),
        }
        base = Setup(q, mesh.geometry.X, np.float64(amplitude))
        values = np.zeros((len(directions), 0, directions.shape[1]))
        if found is not None and known.size:
            values = np.stack([of.values for of in found.boundary])
        gripped_nodes = moved if gripped and not known.size else np.zeros(0, dtype=int)
        bc = BoundaryConditions.of(mesh, held, gripped_nodes, directions, known, values)
        design = choices[o.unknown]()
        design = design if springs is None else springs.beside(design, E / mesh.diameter)
        self.solid = LoadedSolid(mesh, law, bc, top, o.load, directions, design, base, springs, use_numpy)
        self.parameters = self.solid.design.parameters
        self.regularization = self._prior(o.alpha, o.phi, o.phi_width, o.unknown)
        self.n_state = bc.n_u
        self.linear = o.law == "linear" and o.load != "follower"
        self.affine = self.linear and o.unknown in ("traction", "load")
        self.affine_at_rest = o.load == "traction" and o.unknown in ("traction", "load")
        self.structure = "spd" if self.solid.symmetric else "general"
        self.matrix_free = self.solid.symmetric or not use_numpy
        self.noise, self.seed = noise, o.seed
        self.synthetic = o.data == "twin"
        if self.locks and o.nu > NEARLY_INCOMPRESSIBLE:
            self.notes += (f"nu={o.nu:.6g} is nearly incompressible: these elements lock, and digits are lost",)
        if amplitude == 0.0 and o.unknown in MATERIAL and not known.size:
            self.notes += ("zero load: u = 0, and no gradient tells anything about the material",)
        if found is not None:
            apart = np.union1d(clamp, nodes_of_faces(mesh, o.clamped))
            self.data, said = self._from_file(found, F, apart)
            self.read_as = (*found.notes, *said)
            told = o.modulus is not None or (self.constants is not None and bool({*self.constants.start} - {"nu"}))
            self.start_from_data = not told and o.unknown in FITTED and (not gripped or F is not None)
        elif o.markers:
            in_plane = o.components == "in-plane"
            self.data = self._without_file(probes.markers(mesh, o.face, o.markers, in_plane, o.seed))
        else:
            where = o.sensors or ("right" if gripped else o.loaded)
            nodes = np.unique(mesh.geometry.nodes) if where == "everywhere" else mesh.boundary(where).node_set
            self.data = self._without_file(probes.at_nodes(mesh, nodes))
        if o.mesh or measured:
            how = "on springs" if springs else "at measured displacements" if known.size else "held"
            words = support_in_words(mesh, o.clamped, o.fixed, how)
            applied = () if gripped and known.size else (load_in_words(self.solid, o.loaded),)
            self.read_as = (*self.read_as, words, *applied)
            self.notes += self.read_as
        self.data = self.data.with_motion(o.motion)
        if gripped:
            self.drive = "displacement"
        elif known.size:
            self.drive = "load and displacement"
        if self.data.reads_nothing():
            raise InputError(
                f"{self.name}: all that is measured is held at zero and tells nothing - choose other points"
            )

    def _by_file(self, loads: LoadCases, amplitude: float, direction: Array, area: float) -> tuple[float, Array]:
        """The amplitude and the directions (cases, d) of a file's load cases."""
        o = self._options
        if o["unknown"] == "traction" and len(loads.values) > 1:
            raise InputError(f"{self.name}: unknown=traction takes one load case, {o['data']} has {len(loads.values)}")
        if o["force"] is not None and loads.kind != "ratio":
            raise InputError(f"{self.name}: force= and column load of {o['data']} both state the load - keep one")
        a = loads.amplitudes(o["load"], amplitude, area, self.name)
        largest = amplitude if loads.kind == "ratio" else float(a[np.abs(a).argmax()])
        return largest, np.outer(a / (largest or 1.0), direction)

    def _from_file(
        self, measured: probes.Measured, F: Array | None, apart: Array
    ) -> tuple[DisplacementData, tuple[str, ...]]:
        """The data, forces F (cases,) [N] among them, and notes; `apart` are nodes that a measured force is not of."""
        o, said = self._options, [in_words(measured.boundary)] if measured.boundary else []
        greatest, size = max(float(np.abs(d).max()) for d in measured.d), self.mesh.diameter
        if greatest > size:
            self.notes += (f"data up to {greatest:.3g} m for a body of {size:.3g} m: are the units right?",)
        if measured.strains is not None and self.solid.design.moved_nodes is not None:
            raise InputError(f"{self.name}: strains are read in a mesh that stands still, not with unknown=shape")
        data = DisplacementData(self.solid, measured.probes, measured.d, measured.sigma, strains=measured.strains)
        if F is not None:
            d = np.concatenate([d[at.measured] for at, d in zip(measured.probes, measured.d, strict=True)])
            if not d.size:
                raise InputError(f"{self.name}: force= of a grip is weighed beside displacements - measure some, too")
            rms = float(np.sqrt(np.mean(d**2)))
            direction = self.solid.directions[0]
            force, note = force_data(self.solid, F, direction, apart, o["force_noise"], measured.sigma, rms)
            return replace(data, force=force), (*said, note)
        if o["force_noise"] is not None:
            raise InputError(f"{self.name}: force_noise= is that of force=, which is not given - give both or none")
        if self.solid.load == "displacement" and o["unknown"] in MATERIAL:
            said.append("displacements alone tell ratios of moduli; their size stays that of the start: give force=")
        return data, tuple(said)

    def _without_file(self, points: probes.Probes) -> DisplacementData:
        """The target displacements; none yet for synthetic data."""
        height = TARGET * (points.x[:, -1] - self.mesh.bounding_box[0, -1])
        target = tuple(height[:, None] * direction for direction in self.solid.directions)
        cases = (points,) * len(self.solid.directions)
        return DisplacementData(self.solid, cases, None if self.synthetic else target, self.noise)

    def _prior(self, alpha: float, phi: Phi | None, width: float, unknown: AnyDesign) -> Prior:
        """Neighbours are cells that share a facet, and adjacent layers."""
        kind = phi or ("tikhonov" if unknown in FIELDS else "amplitude")
        f2t = self.mesh.skfem_mesh.f2t
        pairs = np.asarray(f2t.T[f2t[1] != -1]) if unknown in CELLWISE else None
        n, scale = len(self.parameters), self.parameters.scale.copy()
        if self.solid.springs is not None:  # k has no neighbours, and no prior
            pairs = np.stack([np.arange(1, n - 1), np.arange(n - 2)], axis=1) if unknown == "layers" else pairs
            scale[-1] = np.inf
        prior = Prior(alpha, kind, width, pairs, self.parameters.start, scale)
        if kind == "amplitude" and unknown in MODULI:
            prior = replace(
                prior, origin=self._theta(self.parameters.start), scale=np.where(np.isinf(scale), scale, 1.0)
            )
        prior.check(self.name)
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
        """The regularized quantity: log E or log t of fields, else p."""
        return p if self.log or self.solid.design.field is None else xp.log(p)

    def observation(self, u: Array, p: Array) -> Observation:
        return self.data.observation(u, p)

    def candidates(self) -> Candidates:
        return self.data.candidates()

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        theta = self._theta(p)
        return self.regularization, theta, np.ones_like(p) if theta is p else 1.0 / p

    def linearize(self, u: Array, p: Array) -> Linearization:
        J_u, J_p = self.data.misfit_gradient(u, p)
        if self.alpha:
            prior, theta, by_p = self.prior(p)
            J_p = J_p + prior.gradient(theta) * by_p
        return Linearization(self.solid.R_p(u, p), J_u, J_p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=self.solid.traced_residual, objective=lambda u, p: self.objective(u, p, jnp))

    def refined(self, p: Array) -> tuple[Solid, Array] | None:
        """Twice as many cells along every edge of a built-in mesh; None for mesh files and for p that depends on the
        mesh. Synthetic data have to be computed anew.
        """
        o, unknown = self._options, self._options["unknown"]
        if o["mesh"] is not None or unknown in ("traction", "shape"):
            return None
        doubled = {name: 2 * (o[name] or o["n"]) for name in ("nx", "ny", "nz") if name in o}
        layers = len(p) - (self.solid.springs is not None) if unknown == "layers" else None
        finer = type(self)(**o | doubled | {"n": 2 * o["n"], "layers": layers})
        if unknown not in ("modulus", "thickness"):
            return finer, p
        n = len(self.mesh.geometry.centres)
        fine = prolongate(p[:n], self.mesh.geometry.centres, finer.mesh.geometry.centres)
        return finer, np.append(fine, p[n:])

    # --- a start of the size of the data

    def scaled(self, p: Array, factor: float) -> Array | None:
        """Where p sets the material, and a load is given or measured rather than displacements alone."""
        displaced = self.solid.load == "displacement" and self.data.force is None
        if self._options["unknown"] not in MATERIAL or displaced:
            return None
        if self.solid.design.by_stiffness is not None:
            return np.asarray(p + np.log(factor) * self.solid.design.by_stiffness)
        q = p + np.log(factor) if self._is_log else factor * p
        if self.solid.springs is not None and self.log:
            q[-1] = p[-1] + np.log(factor)
        return q

    def stiffened(self, factor: float) -> Solid:
        start, o = self.scaled(self.parameters.start, factor), self._options
        if start is None:
            raise NotOffered(f"{self.name}: unknown={o['unknown']} with load={o['load']} has no stiffness to multiply")
        other = copy.copy(self)
        scale = self.parameters.scale * (1.0 if self._is_log else factor)
        if self.solid.springs is not None and self.log:
            scale[-1] = 1.0
        other.parameters = replace(self.parameters, start=start, scale=scale)
        other.regularization = other._prior(self.alpha, o["phi"], o["phi_width"], o["unknown"])
        return other

    def completed(self, given: Mapping[str, float]) -> Array | None:
        """Constants of the law by name, of a material of constant volume: the last of them is told by nu.

        Raises InputError for nu that is far from constant volume.
        """
        law, nu = self.solid.law, self._options["nu"]
        if self._options["unknown"] != "constants" or set(given) != set(law.constants[:-1]):
            return None
        if nu < NEARLY_CONSTANT_VOLUME:
            raise InputError(
                f"{self.name}: the constants {', '.join(given)} are of a material of constant volume, beside nu={nu:g}"
                f" - set nu={NEARLY_CONSTANT_VOLUME:g} or more, it tells {law.constants[-1]}"
            )
        q = [given[name] for name in law.constants[:-1]]
        return np.array([*q, law.of_volume(q, nu)])

    @property
    def _is_log(self) -> bool:
        design = self.solid.design
        return (self.log and design.field is not None) or design.by_stiffness is not None

    def stated(self, p: Array) -> dict[str, Any]:
        """Constants as people state them, E and nu besides, of laws that have them; the stiffness of springs."""
        k = {} if self.solid.springs is None else {"k [Pa/m]": self.solid.springs.k(p)}
        if self.constants is not None and self.constants.paired:
            return self.constants.stated(p[:2]) | k
        if self._options["unknown"] != "constants" or self.solid.law.constants != ("mu", "lam"):
            return k
        mu, lam = p[:2]
        return {"E [Pa]": mu * (3.0 * lam + 2.0 * mu) / (lam + mu), "nu": 0.5 * lam / (lam + mu)} | k

    def ends(self, p: Array) -> list[End]:
        return self.constants.ends(p[:2]) if self.constants is not None and self.constants.paired else []

    # --- synthetic data

    def truth(self) -> Array | None:
        return self.solid.design.truth if self.synthetic else None

    def twin(self) -> Solid | None:
        return self._with(self.data.zeros()) if self.data.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Solid:
        setup = self.solid.setup(self.solid.design.truth)
        rng = np.random.default_rng(self.seed if seed is None else seed)
        return self._with(self.data.synthesized(u, setup, rng))

    def load_cases(self) -> list[Problem]:
        """Each includes the whole of alpha Phi."""
        cases = len(self.solid.directions)
        return [self._with(self.data.single_case(case)) for case in range(cases)] if cases > 1 else []

    def _with(self, data: DisplacementData) -> Solid:
        other = copy.copy(self)  # shares the mesh and the compiled functions
        other.data, other.solid = data, data.solid
        other.n_state = data.solid.bc.n_u
        return other

    # --- output

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u, lam (n_nodes, 3) per load case; E, dJ/dE per cell if p are moduli, t and dJ/dt if it is the thickness;
        dJ/dX per node if p is a shape.
        """
        solid, design, geometry = self.solid, self.solid.design, self.mesh.geometry
        s, every, cases = solid.setup(p), np.arange(len(geometry.X)), len(solid.directions)
        point_data, cell_data = {}, {}
        for case in range(cases):
            number = f"_{case + 1}" if cases > 1 else ""
            point_data[f"u{number}"] = solid.displacements(u, s, case, every)
            if lam is not None:
                point_data[f"lambda{number}"] = solid.bc.variations(lam, case, every)
        if design.field is not None:
            name, cells = design.field, design.parameter_of_cell
            value = np.exp(p) if self.log else p
            by_value = gradient / value if self.log else gradient
            cell_data = {name: value[cells], f"dJ_d{name}": by_value[cells]}
        if design.moved_nodes is not None:
            point_data["dJ_dX"] = np.zeros_like(s.X)
            moved = design.moved_nodes
            point_data["dJ_dX"][moved] = gradient[: moved.size * geometry.dim].reshape(-1, geometry.dim)
        return Fields(in_space(s.X), *geometry.for_meshio(), {k: in_space(v) for k, v in point_data.items()}, cell_data)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x, moved = self.parameters.position, self.data.moved(u, p)
        columns = {} if x is None else dict(zip(AXES[: x.shape[1]], x.T, strict=True))
        motion = ", ".join(f"{name} {value:.4g}" for name, value in moved.items())
        return ParameterView(columns, remarks=(f"eliminated from J: {motion}",) if motion else ())


def in_space(x: Array) -> Array:
    """Points or vectors (n, d) as (n, 3)."""
    return np.pad(x, ((0, 0), (0, 3 - x.shape[1])))
