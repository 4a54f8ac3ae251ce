"""A hyperelastic body held on one face and loaded on another: what all problems of solids share."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.data.displacement_data import DisplacementData
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.errors import InputError, NotOffered
from gradient_routes.problems.fem.mesh import AXES, Mesh
from gradient_routes.problems.fem.prolongation import prolongate
from gradient_routes.problems.mechanics.boundary_noise import boundary_noise
from gradient_routes.problems.mechanics.chosen_design import base_of, design_of
from gradient_routes.problems.mechanics.constants import Constants
from gradient_routes.problems.mechanics.design_variables import FITTED, MATERIAL
from gradient_routes.problems.mechanics.loaded_solid import LoadedSolid
from gradient_routes.problems.mechanics.loading import Loading
from gradient_routes.problems.mechanics.solid_data import data_of, read_file
from gradient_routes.problems.mechanics.solid_fields import fields_of
from gradient_routes.problems.mechanics.solid_notes import doubts, setting
from gradient_routes.problems.mechanics.solid_prior import prior_of
from gradient_routes.problems.mechanics.supports import Supports
from gradient_routes.problems.problem import (
    Array,
    End,
    Fields,
    Linearization,
    Nuisance,
    Offers,
    Operator,
    ParameterView,
    Problem,
    Traced,
)

if TYPE_CHECKING:
    from gradient_routes.problems.mechanics.materials import MaterialLaw

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
        self._options, self.mesh, self.seed = options, mesh, o.seed
        self.log, self.synthetic = o.parametrization != "raw", o.data == "twin"
        self.measured = o.data is not None and not self.synthetic
        use_numpy = _by_hand(o, law, self.name)
        law.check(law.of_modulus(1.0, o.nu))

        supports = Supports.of(mesh, o, self.log)
        loading = Loading.of(mesh, o, supports, directions)
        self.noise = standard_deviation(o.noise, self.measured, self.name)
        found = read_file(mesh, o, self.noise, supports.known) if self.measured else None
        if found is not None:
            loading = loading.of_file(o, supports, found.loads, self.name)
        self.constants = Constants.of(o.constants, law, self.name) if o.unknown == "constants" else None

        base = base_of(o, mesh, law, loading, self.measured)
        self.boundary = () if found is None else found.boundary
        bc = supports.boundary_conditions(mesh, loading.directions, self.boundary)
        design = design_of(o, self.log, mesh, law, base, supports, loading, self.constants)
        on, along, springs = supports.loaded, loading.directions, supports.springs
        self.solid = LoadedSolid(mesh, law, bc, on, o.load, along, design, base, springs, use_numpy)
        self.n_state, self.parameters = bc.n_u, design.parameters
        self.regularization = self._prior(o.alpha)
        self._classify(o)

        self.data, said = data_of(o, self.solid, supports, found, loading.forces, self.noise)
        self.start_from_data = self.measured and self._is_told_by_data(o, loading)
        if o.mesh or self.measured:
            self.read_as = (*said, *setting(o, self.solid, supports))
        self.notes = (*doubts(o, self.solid, self.locks, found), *self.read_as)
        self.drive = "displacement" if supports.gripped else "load and displacement" if supports.known.size else "load"

    def _classify(self, o: SimpleNamespace) -> None:
        """What routes and solvers may rely on of R."""
        self.linear = o.law == "linear" and o.load != "follower"
        self.affine = self.linear and o.unknown in ("traction", "load")
        self.affine_at_rest = o.load == "traction" and o.unknown in ("traction", "load")
        self.structure = "spd" if self.solid.symmetric else "general"
        self.matrix_free = self.solid.symmetric or not self.solid.use_numpy

    def _is_told_by_data(self, o: SimpleNamespace, loading: Loading) -> bool:
        """Whether a file's data tell the size of p, and no option does."""
        told = o.modulus is not None or (self.constants is not None and bool({*self.constants.start} - {"nu"}))
        return not told and o.unknown in FITTED and (o.load != "displacement" or loading.forces is not None)

    def _prior(self, alpha: float) -> Prior:
        theta = self.theta(self.parameters.start)
        return prior_of(alpha, SimpleNamespace(**self._options), self.solid, self.parameters, theta)

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
        return J + self.regularization.value(xp, self.theta(p, xp)) if self.alpha else J

    def theta(self, p: Any, xp: Any = np) -> Any:
        """The regularized quantity: log E or log t of fields, else p."""
        return p if self.log or self.solid.design.field is None else xp.log(p)

    def observation(self, u: Array, p: Array) -> Observation:
        return self.data.observation(u, p)

    def taken_as_exact(self, u: Array, p: Array) -> Nuisance | None:
        """Measured displacements of the boundary."""
        return boundary_noise(self.data, self.boundary, u, p)

    def candidates(self) -> Candidates:
        return self.data.candidates()

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        theta = self.theta(p)
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
        springs = self.solid.springs
        layers = len(p) - (0 if springs is None else springs.count) if unknown == "layers" else None
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
            of_k = slice(-self.solid.springs.count, None)
            q[of_k] = p[of_k] + np.log(factor)
        return q

    def stiffened(self, factor: float) -> Solid:
        start, o = self.scaled(self.parameters.start, factor), self._options
        if start is None:
            raise NotOffered(f"{self.name}: unknown={o['unknown']} with load={o['load']} has no stiffness to multiply")
        other = copy.copy(self)
        scale = self.parameters.scale * (1.0 if self._is_log else factor)
        if self.solid.springs is not None and self.log:
            scale[-self.solid.springs.count :] = 1.0
        other.parameters = replace(self.parameters, start=start, scale=scale)
        other.regularization = other._prior(self.alpha)
        return other

    def completed(self, given: Mapping[str, float]) -> Array | None:
        """Constants [Pa] of the law by name; of a material of constant volume without the last, which nu tells.

        Raises InputError for nu that is far from constant volume.
        """
        law, nu, constants = self.solid.law, self._options["nu"], self.constants
        if (
            constants is None
            or self.solid.springs is not None
            or set(given) not in ({*law.constants}, {*law.constants[:-1]})
        ):
            return None
        q = [given[name] for name in law.constants if name in given]
        if len(q) < len(law.constants):
            if nu < NEARLY_CONSTANT_VOLUME:
                raise InputError(
                    f"{self.name}: the constants {', '.join(given)} are of a material of constant volume, beside"
                    f" nu={nu:g} - set nu={NEARLY_CONSTANT_VOLUME:g} or more, it tells {law.constants[-1]}"
                )
            q.append(law.of_volume(q, nu))
        return constants.of_law(q)

    @property
    def _is_log(self) -> bool:
        design = self.solid.design
        return (self.log and design.field is not None) or design.by_stiffness is not None

    def stated(self, p: Array) -> dict[str, Any]:
        """Constants as people state them, E and nu besides, of laws that have them; the stiffness of springs."""
        k = {} if self.solid.springs is None else self.solid.springs.stated(p)
        return (self.constants.stated(p[:2]) if self.constants is not None and self.constants.paired else {}) | k

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
        return fields_of(self.solid, self.log, p, u, lam, gradient)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x, moved = self.parameters.position, self.data.moved(u, p)
        columns = {} if x is None else dict(zip(AXES[: x.shape[1]], x.T, strict=True))
        motion = ", ".join(f"{name} {value:.4g}" for name, value in moved.items())
        return ParameterView(columns, remarks=(f"eliminated from J: {motion}",) if motion else ())


def _by_hand(o: SimpleNamespace, law: MaterialLaw, who: str) -> bool:
    """Whether to take hand-derived NumPy code. Raises InputError where there is none."""
    exist = law.numpy is not None and o.unknown in MATERIAL and o.load != "follower"
    use_numpy = exist if o.derivatives is None else o.derivatives == "hand"
    if use_numpy and law.numpy is None:
        raise InputError(
            f"{who}: derivatives=hand exist for neo-hookean, mooney-rivlin and arap, not {o.law} - take ad"
        )
    return use_numpy
