"""The impact block: the hyperelastic block with mass, thrown against a rigid plane, marched in time.

u' = v,    M v' = -f(u, p) - those of the plane, by the trapezoidal rule (Newmark, beta = 1/4, gamma = 1/2)
"""

from __future__ import annotations

import copy
import math
from collections.abc import Hashable
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.block import Block
from gradient_routes.problems.contact import STOP_WIDTH, CompliantStop, make_stop
from gradient_routes.problems.data.every_step import EveryStep
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.dynamics.impulses import ImpulsesByMaterial
from gradient_routes.problems.dynamics.scheme import moved_on
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions
from gradient_routes.problems.fem.elements import SolidElement
from gradient_routes.problems.fem.mesh import AXES
from gradient_routes.problems.matrices.global_step import GlobalStep
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.matrices.sparse import SymmetricSparse
from gradient_routes.problems.matrices.step_matrix import StepMatrix
from gradient_routes.problems.mechanics import solid_options as options
from gradient_routes.problems.mechanics.global_step import global_step
from gradient_routes.problems.mechanics.mass import Mass, element_masses
from gradient_routes.problems.mechanics.rigid_plane import RigidPlane
from gradient_routes.problems.problem import (
    Array,
    End,
    Linearization,
    Offers,
    ParameterView,
    Traced,
)
from gradient_routes.problems.rates import Rates
from gradient_routes.problems.transient import Transient

STEPS_MAX, STATE_MAX = 10**6, 10**8
GAP, K_C = 0.05, 100.0  # [m], [N/m^3]
Unknown = Literal["modulus", "layers", "constants"]
Contact = Literal["softplus", "quadratic", "penalty"]


class Body(Block):
    """The block itself: its mesh, law, unknowns and prior."""

    name = "impact-block"


class ImpactBlock(Transient):
    """A block thrown against a rigid plane, whose moduli are sought from histories of displacements.

    State (T 2 n,): displacements [m] and velocities [m/s] of all nodes after every step, n = 3 n_nodes. J = 1/2 sum_t
    |S u_t - d_t|^2 + alpha Phi [m^2]. Synthetic data are those of a stiff inclusion. The rows of R for u are multiplied
    by the mean mass of a node over h, so that all of R is an impulse [N s].
    """

    name = "impact-block"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    regularization: Prior

    def __init__(
        self,
        *,
        n: options.Count = 2,
        nx: options.Along = None,
        ny: options.Along = None,
        nz: options.Along = None,
        size: Annotated[str, "lengths Lx,Ly,Lz [m], or one for all"] = "1",
        element: Annotated[SolidElement, "of the box; tetrahedra split each of its bricks in six"] = "hex8",
        law: options.Law = "neo-hookean",
        nu: options.Nu = 0.3,
        modulus: Annotated[float | None, "Young's, to start from [1 Pa]"] = None,
        derivatives: options.Derivatives = None,
        unknown: Annotated[Unknown, "what p is"] = "modulus",
        constants: options.Constants = None,
        parametrization: Annotated[Literal["log", "raw"] | None, "of moduli: p = log E or p = E [log]"] = None,
        layers: Annotated[int | None, "along z, for unknown=layers [4, fewer on a coarse mesh]"] = None,
        density: Annotated[float, "rho [kg/m3]"] = 1.0,
        mass: Annotated[Mass, "consistent, or its diagonal scaled to the whole mass"] = "consistent",
        velocity: Annotated[str, "of the throw: towards the plane, or vx,vy,vz [m/s]"] = "0.2",
        gap: Annotated[float, "between the bottom and the plane at first [m]"] = GAP,
        stop: Annotated[Contact, "law of the plane's pressure, node by node"] = "softplus",
        k_c: Annotated[float, "pressure by penetration [Pa/m]"] = K_C,
        width: Annotated[float, "over which softplus and quadratic round the kink of the penalty [m]"] = STOP_WIDTH,
        steps: Annotated[int, "of time, T"] = 40,
        dt: Annotated[float, "length h of a step [s]"] = 0.05,
        sensors: Annotated[str, "face whose nodes are measured, or everywhere"] = "top",
        noise: Annotated[float, "standard deviation added to data [m]"] = 0.0,
        seed: options.Seed = 0,
        alpha: options.Alpha = 0.0,
    ) -> None:
        if not 1 <= steps <= STEPS_MAX:
            raise InputError(f"{self.name}: steps={steps} - choose 1 <= steps <= {STEPS_MAX}")
        for name, amount in {"dt": dt, "density": density}.items():
            if not 0.0 < amount < math.inf:
                raise InputError(f"{self.name}: {name}={amount:g} - choose a finite {name} > 0")
        if not 0.0 <= noise < math.inf:
            raise InputError(f"{self.name}: noise={noise:g} - choose a finite noise >= 0")
        self.body = Body(
            n=n,
            nx=nx,
            ny=ny,
            nz=nz,
            size=size,
            element=element,
            law=law,
            nu=nu,
            modulus=modulus,
            derivatives=derivatives,
            unknown=unknown,
            constants=constants,
            parametrization=parametrization,
            layers=layers,
            data="twin",
            noise=noise,
            seed=seed,
            alpha=alpha,
        )
        mesh = self.body.mesh
        free = np.zeros(mesh.geometry.X.shape, dtype=bool)
        nowhere, still = np.zeros(0, dtype=int), np.zeros((1, 3))
        bc = BoundaryConditions.of(mesh, free, nowhere, still, nowhere, np.zeros((1, 0, 3)))
        self.solid = replace(self.body.solid, bc=bc, load="displacement", directions=still)
        self.n, self.steps, self.h = bc.n_free, steps, dt
        self.n_state = 2 * self.n * steps
        if self.n_state > STATE_MAX:
            raise InputError(
                f"{self.name}: {self.n_state:g} unknowns of all steps - at most {STATE_MAX:g}: fewer cells or steps"
            )
        made = make_stop(stop, gap, k_c, width, self.name, GAP)
        assert isinstance(made, CompliantStop)
        self.plane = RigidPlane.below(mesh, bc, made)
        v = _velocity(velocity, self.name)
        if -v[2] * steps * dt <= gap:
            raise InputError(
                f"{self.name}: velocity={velocity} reaches no plane at gap={gap:g} in {steps} steps of dt={dt:g}, and p"
                " changes nothing - throw faster, or march longer"
            )
        self.v_0 = np.tile(v, self.n // 3)
        self.seed = seed
        i, j = np.triu_indices(3 * mesh.geometry.nodes.shape[1])
        self.masses = element_masses(mesh.geometry, density, mass)
        self.M: Any = self.solid.pattern.assemble(np.kron(self.masses, np.eye(3))[:, i, j])
        self.projective, self.of_velocity = law == "arap", dt / 2.0
        self.row = density * float(mesh.geometry.metric[1].sum()) / (self.n // 3) / dt
        self.histories = EveryStep(self.name, steps, 2 * self.n, dt, self._dofs_of(sensors), self._name_of, noise)
        self._kept: tuple[Array, Array, Array] | None = None
        self.parameters, self.regularization = self.body.parameters, self.body.regularization

    # --- the equations

    def forces(self, u: Array, p: Array) -> Array:
        """f and those of the plane, (n,) [N]."""
        return np.asarray(self.solid.residual(u, p) + self.plane.forces(u))

    def stiffness(self, u: Array, p: Array) -> SymmetricSparse:
        """Their derivative by u."""
        K: SymmetricSparse = self.solid.tangent(u, p)
        return K.plus_diagonal(self.plane.stiffness(u))

    def global_step(self, p: Array) -> GlobalStep:
        c, plane = self.h**2 / 4.0, self.plane
        return global_step(self.solid, p, c, self.masses, plane.at, lambda u: c * plane.stiffness(u)[plane.at])

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        return xp.concatenate([xp.zeros(self.n), xp.asarray(self.v_0)]).astype(p.dtype)

    def impulses(self, u: Any, v: Any, f: Any, xp: Any = np) -> Any:
        """R (m, 2, n) of m steps, from displacements, velocities and forces (m + 1, n) before and after them."""
        moved = self.row * (u[1:] - u[:-1] - 0.5 * self.h * (v[1:] + v[:-1]))
        driven = self._times_mass(v[1:] - v[:-1], xp) + 0.5 * self.h * (f[1:] + f[:-1])
        return xp.stack([moved, driven], axis=1)

    def _times_mass(self, v: Any, xp: Any) -> Any:
        """M v of every row (m, n)."""
        if xp is np:
            return np.stack([self.M @ one for one in v])
        M = self.M.full().tocoo()
        return xp.zeros_like(v).at[:, M.row].add(M.data * v[:, M.col])

    def history(self, U: Any, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """Displacements and velocities, (T + 1, n) each, those before the first step included."""
        z = xp.concatenate([self.initial_state(p, xp)[None], xp.reshape(U, (self.steps, -1))])
        return z[:, : self.n], z[:, self.n :]

    def rows(self, t_0: int, states: Array, p: Array) -> Array:
        u, v = states[:, : self.n], states[:, self.n :]
        f = np.stack([self._forces_before(u[0], p), *(self.forces(u_t, p) for u_t in u[1:])])
        return np.asarray(self.impulses(u, v, f).reshape(len(u) - 1, -1))

    def tangent(self, u: Array, p: Array) -> Recurrence:
        K = [self.stiffness(x, p) for x in self.history(u, p)[0]]
        return Recurrence(
            [self._matrix(1.0, K_t) for K_t in K[1:]], [self._matrix(-1.0, K_t) for K_t in K[:-1]], self.steps
        )

    def _matrix(self, sign: float, K: SymmetricSparse) -> StepMatrix:
        half = 0.5 * self.h
        scaled, M = replace(K, data=half * K.data), replace(self.M, data=sign * self.M.data)
        return StepMatrix(sign * self.row, -self.row * half, scaled, M)

    def rates(self, t_0: int, states: Array, p: Array) -> Rates:
        J, J_u = self.histories.step_misfits(t_0, states[1:])
        f_p = [self.solid.R_p(u, p) for u in states[:, : self.n]]
        R_p = ImpulsesByMaterial(f_p, self.h)
        return Rates(J, J_u, np.zeros((len(J), len(p))), R_p.each_transposed, R_p)

    def phi(self, p: Any, xp: Any = np) -> Any:
        return self.regularization.value(xp, self.body.theta(p, xp)) if self.alpha else 0.0

    def phi_by(self, p: Array) -> Array:
        prior, theta, by_p = self.prior(p)
        return np.asarray(prior.gradient(theta) * by_p) if self.alpha else np.zeros_like(p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jax, jnp

        def residual(U: Any, p: Any) -> Any:
            u, v = self.history(U, p, jnp)
            return self.impulses(u, v, jax.vmap(lambda u: self._traced_forces(u, p))(u), jnp).ravel()

        return Traced(residual, lambda U, p: self.histories.misfit(U, jnp) + self.phi(p, jnp))

    def _traced_forces(self, u: Any, p: Any) -> Any:
        from gradient_routes.problems.jax64 import jnp

        return self.solid.traced_residual(u, p) + self.plane.forces(u, jnp)

    # --- one step

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        z = xp.stack([v, u])
        if xp is np:
            return self.rows(t - 1, z, p)[0]
        f = xp.stack([self._traced_forces(one[: self.n], p) for one in (v, u)])
        return self.impulses(z[:, : self.n], z[:, self.n :], f, xp).ravel()

    def _forces_before(self, u: Array, p: Array) -> Array:
        """Those of the state that a step starts from: the same in all its iterations."""
        kept = self._kept
        if kept is None or kept[0].dtype != u.dtype or not (np.array_equal(kept[0], u) and np.array_equal(kept[1], p)):
            kept = self._kept = u.copy(), p.copy(), self.forces(u, p)
        return kept[2]

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return self.histories.step_misfit(t, u, xp)

    def step_tangent(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self._matrix(1.0, self.stiffness(u[: self.n], p))

    def step_coupling(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self._matrix(-1.0, self.stiffness(v[: self.n], p))

    def step_linearize(self, t: int, u: Array, v: Array, p: Array) -> Linearization:
        return self.rates(t - 1, np.stack([v, u]), p).single

    def step_initial(self, t: Any, v: Any, p: Any, xp: Any = np) -> Any:
        return moved_on(v, self.h, xp)

    def step_active_set(self, t: int, u: Array, p: Array) -> Hashable | None:
        return self.plane.active_set(u[: self.n])

    # --- data

    def _dofs_of(self, sensors: str) -> Array:
        mesh = self.solid.mesh
        nodes = np.unique(mesh.geometry.nodes) if sensors == "everywhere" else mesh.boundary(sensors).node_set
        return np.asarray(self.solid.bc.index[0, nodes].ravel())

    def _name_of(self, i: int) -> str:
        x = ", ".join(f"{c:.3g}" for c in self.solid.mesh.geometry.X[i // 3])
        return f"u_{AXES[i % 3]} at ({x})"

    def observation(self, u: Array, p: Array) -> Observation:
        return self.histories.observation(u)

    def candidates(self) -> Candidates:
        """Every displacement component of every node in every step."""
        return self.histories.candidates(np.arange(self.n), np.repeat(self.solid.mesh.geometry.X, 3, axis=0))

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        _, theta, by_p = self.body.prior(p)
        return self.regularization, theta, by_p

    def truth(self) -> Array | None:
        return self.body.truth()

    def twin(self) -> ImpactBlock | None:
        return self._with(self.histories.zeros()) if self.histories.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> ImpactBlock:
        return self._with(self.histories.synthesized(u, self.seed if seed is None else seed))

    def _with(self, histories: EveryStep) -> ImpactBlock:
        other = copy.copy(self)
        other.histories = histories
        return other

    def stated(self, p: Array) -> dict[str, Any]:
        return self.body.stated(p)

    def ends(self, p: Array) -> list[End]:
        return self.body.ends(p)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x = self.parameters.position
        return ParameterView({} if x is None else dict(zip(AXES, x.T, strict=True)))


def _velocity(text: str, who: str) -> Array:
    """(3,) [m/s] from `-vz` or `vx,vy,vz`. Raises InputError."""
    try:
        v = [float(part) for part in str(text).split(",")]
    except ValueError:
        v = []
    if len(v) not in (1, 3) or not np.isfinite(v).all() or not any(v):
        raise InputError(f"{who}: velocity={text} - give that towards the plane, 0.2 say, or vx,vy,vz, not all 0 [m/s]")
    return np.array([0.0, 0.0, -v[0]] if len(v) == 1 else v)
