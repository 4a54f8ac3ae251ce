"""The impact block: the hyperelastic block with mass, thrown against a rigid plane, marched in time.

u' = v,    M v' = -f(u, p) - sum over nodes a of the bottom of w_a q(g_a) dg_a/du,    g_a = -(gap + e . u_a)

by the trapezoidal rule (Newmark, beta = 1/4, gamma = 1/2). f are the internal forces of the block, q [Pa] the law of a
stop, and w_a [m^2] the area that belongs to a node: every node that may touch is an element of its own.
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
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.boundary_conditions import BoundaryConditions
from gradient_routes.problems.fem.elements import SolidElement
from gradient_routes.problems.fem.mesh import AXES
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.matrices.sparse import SymmetricSparse
from gradient_routes.problems.matrices.step_matrix import StepMatrix
from gradient_routes.problems.mechanics import solid_options as options
from gradient_routes.problems.mechanics.mass import Mass, element_masses
from gradient_routes.problems.problem import (
    Array,
    End,
    Linearization,
    Offers,
    Operator,
    ParameterView,
    Traced,
)
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
        self.plane = made
        v = _velocity(velocity, self.name)
        if -v[2] * steps * dt <= gap:
            raise InputError(
                f"{self.name}: velocity={velocity} reaches no plane at gap={gap:g} in {steps} steps of dt={dt:g}, and p"
                " changes nothing - throw faster, or march longer"
            )
        self.v_0 = np.tile(v, self.n // 3)
        self.noise, self.seed = noise, seed
        self.M = self._mass_matrix(density, mass)
        self.row = density * float(mesh.geometry.metric[1].sum()) / (self.n // 3) / dt
        self.touching, self.area = self._nodes_that_touch()
        self.sensors = self._dofs_of(sensors)
        self.d: Array | None = None  # (T, m) [m]
        self._kept: tuple[Array, Array, Array] | None = None
        self.parameters, self.regularization = self.body.parameters, self.body.regularization

    # --- the body

    def _mass_matrix(self, density: float, kind: Mass) -> SymmetricSparse:
        pattern, geometry = self.solid.pattern, self.solid.mesh.geometry
        i, j = np.triu_indices(3 * geometry.nodes.shape[1])
        M: SymmetricSparse = pattern.assemble(element_masses(geometry, density, kind)[:, i, j])  # type: ignore[assignment]
        return M

    def _nodes_that_touch(self) -> tuple[Array, Array]:
        """Of the bottom: the numbers of their displacements u_z in u (m,), and their areas (m,) [m^2]."""
        facets, X = self.solid.mesh.boundary("bottom", surface=True), self.solid.mesh.geometry.X
        area = np.zeros(len(X))
        np.add.at(area, facets.nodes, np.einsum("fqa,fq->fa", facets.N, facets.areas(X, np)))
        nodes = np.flatnonzero(area > 1e-9 * area.max())  # pressure does no work on the corners of tet10
        return np.asarray(self.solid.bc.index[0, nodes, 2]), area[nodes]

    def _dofs_of(self, sensors: str) -> Array:
        mesh = self.solid.mesh
        nodes = np.unique(mesh.geometry.nodes) if sensors == "everywhere" else mesh.boundary(sensors).node_set
        return np.asarray(self.solid.bc.index[0, nodes].ravel())

    # --- the equations

    def penetration(self, u: Any) -> Any:
        """g of displacements u (.., n), (.., m) [m]."""
        return -u[..., self.touching] - self.plane.gap

    def pressed(self, u: Any, xp: Any = np) -> Any:
        """Forces of the plane (n,) [N], as they stand in R."""
        q = -self.area * self.plane.law.force(self.penetration(u), xp)
        return xp.zeros(self.n, dtype=q.dtype).at[self.touching].add(q) if xp is not np else self._spread(q)

    def _spread(self, q: Array) -> Array:
        f = np.zeros(self.n, q.dtype)
        f[self.touching] = q
        return f

    def forces(self, u: Array, p: Array) -> Array:
        """f and those of the plane, (n,) [N]."""
        return np.asarray(self.solid.residual(u, p) + self.pressed(u))

    def stiffness(self, u: Array, p: Array) -> SymmetricSparse:
        """Their derivative by u."""
        K: SymmetricSparse = self.solid.tangent(u, p)
        return K.plus_diagonal(self._spread(self.area * self.plane.law.stiffness(self.penetration(u))))

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        return xp.concatenate([xp.zeros(self.n), xp.asarray(self.v_0)]).astype(p.dtype)

    def rows(self, u: Any, v: Any, f: Any, xp: Any = np) -> Any:
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

    def residual(self, u: Array, p: Array) -> Array:
        x, v = self.history(u, p)
        return np.asarray(self.rows(x, v, np.stack([self.forces(x_t, p) for x_t in x])).ravel())

    def tangent(self, u: Array, p: Array) -> Recurrence:
        K = [self.stiffness(x, p) for x in self.history(u, p)[0]]
        return Recurrence(
            [self._matrix(1.0, K_t) for K_t in K[1:]], [self._matrix(-1.0, K_t) for K_t in K[:-1]], self.steps
        )

    def _matrix(self, sign: float, K: SymmetricSparse) -> StepMatrix:
        half = 0.5 * self.h
        scaled, M = replace(K, data=half * K.data), replace(self.M, data=sign * self.M.data)
        return StepMatrix(sign * self.row, -self.row * half, scaled, M)

    def linearize(self, u: Array, p: Array) -> Linearization:
        J_u = np.zeros((self.steps, 2 * self.n), dtype=u.dtype)
        J_u[:, self.sensors] = self._read(u) - self.data()
        x, _ = self.history(u, p)
        return Linearization(
            ImpulsesByMaterial([self.solid.R_p(x_t, p) for x_t in x], self.h), J_u.ravel(), self.phi_by(p)
        )

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        return 0.5 * xp.sum((self._read(u, xp) - self.data()) ** 2) + self.phi(p, xp)

    def phi(self, p: Any, xp: Any = np) -> Any:
        return self.regularization.value(xp, self.body.theta(p, xp)) if self.alpha else 0.0

    def phi_by(self, p: Array) -> Array:
        prior, theta, by_p = self.prior(p)
        return np.asarray(prior.gradient(theta) * by_p) if self.alpha else np.zeros_like(p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jax, jnp

        def residual(U: Any, p: Any) -> Any:
            u, v = self.history(U, p, jnp)
            return self.rows(u, v, jax.vmap(lambda u: self._traced_forces(u, p))(u), jnp).ravel()

        return Traced(residual, lambda U, p: self.objective(U, p, jnp))

    def _traced_forces(self, u: Any, p: Any) -> Any:
        from gradient_routes.problems.jax64 import jnp

        return self.solid.traced_residual(u, p) + self.pressed(u, jnp)

    # --- one step

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        z = xp.stack([v, u])
        f = (
            [self._forces_before(v[: self.n], p), self.forces(u[: self.n], p)]
            if xp is np
            else [self._traced_forces(one[: self.n], p) for one in (v, u)]
        )
        return self.rows(z[:, : self.n], z[:, self.n :], xp.stack(f), xp).ravel()

    def _forces_before(self, u: Array, p: Array) -> Array:
        """Those of the state that a step starts from: the same in all its iterations."""
        kept = self._kept
        if kept is None or kept[0].dtype != u.dtype or not (np.array_equal(kept[0], u) and np.array_equal(kept[1], p)):
            kept = self._kept = u.copy(), p.copy(), self.forces(u, p)
        return kept[2]

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return 0.5 * xp.sum((u[self.sensors] - xp.asarray(self.data())[t - 1]) ** 2)

    def step_tangent(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self._matrix(1.0, self.stiffness(u[: self.n], p))

    def step_coupling(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self._matrix(-1.0, self.stiffness(v[: self.n], p))

    def step_linearize(self, t: int, u: Array, v: Array, p: Array) -> Linearization:
        J_u = np.zeros_like(u)
        J_u[self.sensors] = u[self.sensors] - self.data()[t - 1]
        by_p = [self.solid.R_p(z[: self.n], p) for z in (v, u)]
        return Linearization(ImpulsesByMaterial(by_p, self.h), J_u, np.zeros_like(p))

    def step_initial(self, t: int, v: Array, p: Array) -> Array:
        """Moved on by the velocity before the step: a state that leaves nothing in the rows of u."""
        x, velocity = v.reshape(2, -1)
        return np.concatenate([x + self.h * velocity, velocity])

    def step_active_set(self, t: int, u: Array, p: Array) -> Hashable | None:
        """The nodes of the bottom, counted from 1, that touch."""
        g = self.penetration(u[: self.n]).real
        if self.plane.law.active_set(0.0) is None:
            return None
        return ",".join(str(node) for node in np.flatnonzero(g > 0.0) + 1) or "open"

    # --- data

    def _read(self, u: Any, xp: Any = np) -> Any:
        """Displacements at the sensors, (T, m) [m]."""
        return xp.reshape(u, (self.steps, -1))[:, self.sensors]

    def observation(self, u: Array, p: Array) -> Observation:
        from scipy import sparse

        at = (2 * self.n * np.arange(self.steps)[:, None] + self.sensors).ravel()
        S = sparse.csr_array((np.ones(len(at)), (np.arange(len(at)), at)), shape=(len(at), self.n_state))
        label = self._label(at)
        return Observation(self._read(u).ravel(), self.data().ravel(), S, sigma=self.noise, label=label)

    def candidates(self) -> Candidates:
        """Every displacement component of every node in every step."""
        at = (2 * self.n * np.arange(self.steps)[:, None] + np.arange(self.n)).ravel()
        return Candidates(at, self._label(at), self.solid.mesh.geometry.X[at % (2 * self.n) // 3])

    def _label(self, at: Array) -> Any:
        X = self.solid.mesh.geometry.X

        def label(k: int) -> str:
            t, i = divmod(int(at[k]), 2 * self.n)
            where = ", ".join(f"{x:.3g}" for x in X[i // 3])
            return f"u_{AXES[i % 3]} at ({where}), {(t + 1) * self.h:.3g} s"

        return label

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        _, theta, by_p = self.body.prior(p)
        return self.regularization, theta, by_p

    def data(self) -> Array:
        """d (T, m) [m]. Raises InputError where synthetic data are not made yet."""
        if self.d is None:
            raise InputError(
                f"{self.name}: synthetic data are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(block)"
            )
        return self.d

    def truth(self) -> Array | None:
        return self.body.truth()

    def twin(self) -> ImpactBlock | None:
        return self._with_data(np.zeros((self.steps, len(self.sensors)))) if self.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> ImpactBlock:
        rng = np.random.default_rng(self.seed if seed is None else seed)
        d = self._read(u)
        return self._with_data(d + self.noise * rng.standard_normal(d.shape))

    def _with_data(self, d: Array) -> ImpactBlock:
        other = copy.copy(self)
        other.d = d
        return other

    def stated(self, p: Array) -> dict[str, Any]:
        return self.body.stated(p)

    def ends(self, p: Array) -> list[End]:
        return self.body.ends(p)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x = self.parameters.position
        return ParameterView({} if x is None else dict(zip(AXES, x.T, strict=True)))


class ImpulsesByMaterial:
    """R_p of m steps, (m 2 n, n_p): h/2 (f_p + f_p before) in the rows of v, from f_p of the m + 1 states."""

    def __init__(self, f_p: list[Operator], h: float, transposed: bool = False) -> None:
        self.f_p, self.h, self.transposed = f_p, h, transposed

    @property
    def T(self) -> ImpulsesByMaterial:
        return ImpulsesByMaterial(self.f_p, self.h, not self.transposed)

    def __matmul__(self, x: Array) -> Array:
        m, half = len(self.f_p) - 1, 0.5 * self.h
        if self.transposed:
            lam = x.reshape(m, 2, -1)[:, 1]
            none = np.zeros_like(lam[:1])
            along = half * (np.concatenate([none, lam]) + np.concatenate([lam, none]))
            return np.asarray(sum(f_p.T @ w for f_p, w in zip(self.f_p, along, strict=True)))
        f = np.stack([f_p @ x for f_p in self.f_p])
        driven = half * (f[1:] + f[:-1])
        return np.stack([np.zeros_like(driven), driven], axis=1).ravel()


def _velocity(text: str, who: str) -> Array:
    """(3,) [m/s] from `-vz` or `vx,vy,vz`. Raises InputError."""
    try:
        v = [float(part) for part in str(text).split(",")]
    except ValueError:
        v = []
    if len(v) not in (1, 3) or not np.isfinite(v).all() or not any(v):
        raise InputError(f"{who}: velocity={text} - give that towards the plane, 0.2 say, or vx,vy,vz, not all 0 [m/s]")
    return np.array([0.0, 0.0, -v[0]] if len(v) == 1 else v)
