"""Advection and diffusion of heat in a given flow: linear, with a nonsymmetric R_u.

b . grad u - div(kappa grad u) = f   on the unit square,     |b| = 1 m/s
"""

from __future__ import annotations

import copy
import math
from functools import cached_property, partial
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data.observation import Candidates, Observation, selection
from gradient_routes.problems.data.regularization import PHI_WIDTH, FieldPhi, Prior
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.fem.prolongation import prolongate
from gradient_routes.problems.fem.supg import Supg, on_inflow, unit_vector
from gradient_routes.problems.problem import (
    Array,
    Discretization,
    Fields,
    Linearization,
    Offers,
    Operator,
    Parameters,
    ParameterView,
    Problem,
    Traced,
)

TARGET = 0.5  # data at the sensors [K]
N_MAX = 3000  # about 10^7 cells
KAPPA_MAX = 1e12  # kappa is at least its inverse: (kappa / h^2)^3 stays in float64's range
THETA_MAX = 100.0  # bound of |log kappa|
CENTRE = np.array([0.5, 0.5])

Cells = Annotated[int, "cells along every edge"]
Angle = Annotated[float, "between the flow and the x axis [degrees]"]
Kappa = Annotated[float, "mean diffusivity; 1 / (2 n kappa) is the mesh Peclet number [m2/s]"]
Parametrization = Annotated[Literal["log", "raw"] | None, "of kappa: p = log kappa or p = kappa [log]"]
SensorsOf = Annotated[Literal["outflow", "everywhere"], "nodes measured"]
Noise = Annotated[float, "standard deviation added to a twin's data [K]"]
Seed = Annotated[int, "of that noise"]
Alpha = Annotated[float, "weight of Phi"]
PhiOf = Annotated[FieldPhi, "of theta = log kappa or f: 1/2 |D theta|^2 or total variation"]
PhiWidth = Annotated[float, "jump of theta below which total variation is rounded"]


def plume(x: Array, b: Array) -> Array:
    """The source f(x) = 4 exp(-|x - x_0|^2 / (2 0.15^2)) [K/s], x_0 0.2 m upstream of the middle, at x (..., 2)."""
    return np.asarray(4.0 * np.exp(-((x - CENTRE + 0.2 * b) ** 2).sum(axis=-1) / (2.0 * 0.15**2)))


def wavy(x: Array) -> Array:
    """1 + 0.4 sin(2 pi x) cos(2 pi y) at points x (..., 2)."""
    return np.asarray(1.0 + 0.4 * np.sin(2.0 * np.pi * x[..., 0]) * np.cos(2.0 * np.pi * x[..., 1]))


def inclusion(x: Array) -> Array:
    """4 in a disc of radius 0.25 about the centre, at least at the point nearest to it, else 1."""
    r = np.linalg.norm(x - CENTRE, axis=-1)
    return np.where(r < max(0.25, 1.001 * r.min()), 4.0, 1.0)


class Advection(Problem):
    """Heat released into a flow: diffusivities or sources sought from the temperatures downstream.

    State u (n_u,) [K], temperatures of the nodes that are not on the inflow; one kappa or one f per cell, (n_e,).
    J = 1/2 w sum of (u_i - d_i)^2 over the sensor nodes, with w = h for the outflow and h^2 for all nodes, approximates
    an integral. Without synthetic data, d = 0.5 K. The other coefficient is given: f is a plume, or kappa is uniform.
    SUPG (problems/fem/supg.py) prevents oscillations at large mesh Peclet numbers.
    """

    name = "advection"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    linear = True
    structure = "general"
    regularization: Prior

    def __init__(
        self,
        *,
        n: Cells = 8,
        angle: Angle = 30.0,
        kappa: Kappa = 0.05,
        unknown: Annotated[Literal["diffusivity", "source"], "what p is, cell by cell"] = "diffusivity",
        parametrization: Parametrization = None,
        sensors: SensorsOf = "outflow",
        data: Annotated[Literal["target", "twin"], "0.5 K; twin: of an inclusion, or of the plume"] = "target",
        noise: Noise = 0.0,
        seed: Seed = 0,
        alpha: Alpha = 0.0,
        phi: PhiOf = "tikhonov",
        phi_width: PhiWidth = PHI_WIDTH,
    ) -> None:
        _check(n, angle, kappa, unknown, parametrization, data, noise, seed)
        check_applies("advection", ("phi=tv", phi == "tv", True, {"phi_width": phi_width != PHI_WIDTH}))
        self._on_mesh = partial(
            Advection, angle=angle, kappa=kappa, unknown=unknown, parametrization=parametrization, sensors=sensors,
            data=data, noise=noise, seed=seed, alpha=alpha, phi=phi, phi_width=phi_width,
        )  # fmt: skip
        self.n, self.noise, self.seed = n, noise, seed
        self.affine = unknown == "source"
        self.source_unknown, self.log = unknown == "source", unknown == "diffusivity" and parametrization != "raw"
        b = unit_vector(angle)
        self.supg = Supg.of(n, b)
        self.n_state = len(self.supg.free)
        self.on_outflow = sensors == "outflow"
        self.w = 1.0 / n if self.on_outflow else 1.0 / n**2
        self.sensor_nodes = np.flatnonzero(on_inflow(self.supg.x, -b)) if self.on_outflow else np.arange(self.n_state)
        self.d: Array | None = np.full(len(self.sensor_nodes), TARGET) if data == "target" else None
        self._set_parameters(self.supg.centres, b, kappa, uniform=data == "twin")
        self.regularization = Prior(alpha, phi, phi_width, self.supg.neighbours)
        self.regularization.check("advection")

    def _set_parameters(self, x: Array, b: Array, kappa: float, uniform: bool) -> None:
        """Sets the given coefficients, the parameters and the truth; `uniform`: start from constants."""
        ones = np.ones(len(x))
        self.kappa, self.f = kappa * ones, plume(x, b)
        if self.source_unknown:
            start, truth, bounds, unit, name = ones if uniform else self.f, self.f, (-np.inf, np.inf), "K/s", "f"
        else:
            start, truth = kappa * (ones if uniform else wavy(x)), kappa * inclusion(x)
            bounds, unit, name = (0.0, math.exp(THETA_MAX)), "m2/s", "kappa"
        if self.log:
            start, truth = np.log(start), np.log(truth)
            bounds, unit, name = (-THETA_MAX, THETA_MAX), f"log {unit}", f"log {name}"
        scale = ones if self.log or self.source_unknown else self.kappa
        self._truth = truth if uniform else None
        self.parameters = Parameters(start, scale, *bounds, unit, lambda e: f"{name}_{e + 1}", x)

    def refined(self, p: Array) -> tuple[Advection, Array]:
        """Every cell split in four; synthetic data have to be computed anew on the finer mesh."""
        finer = self._on_mesh(n=2 * self.n)
        x, x_fine = self.parameters.position, finer.parameters.position
        assert x is not None
        assert x_fine is not None
        return finer, prolongate(p, x, x_fine)

    # --- the equations

    def coefficients(self, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """kappa (n_e,) [m2/s] and f (n_e,) [K/s]."""
        if self.source_unknown:
            return xp.asarray(self.kappa), p
        return xp.exp(p) if self.log else p, xp.asarray(self.f)

    def residual(self, u: Any, p: Any, xp: Any = np) -> Any:
        """R (n_u,) [K m2/s]."""
        return self.supg.residual(u, *self.coefficients(p, xp), xp)

    def tangent(self, u: Array, p: Array) -> Any:
        kappa, _ = self.coefficients(p)
        return self.supg.tangent(kappa.astype(p.dtype))

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = w/2 |u - d|^2 + alpha Phi [K2 m; K2 m2 for sensors=everywhere]."""
        J = 0.5 * self.w * xp.sum((u[self.sensor_nodes] - self._data()) ** 2)
        return J + self.regularization.value(xp, self.theta(p, xp)) if self.alpha else J

    def theta(self, p: Any, xp: Any = np) -> Any:
        return p if self.log or self.source_unknown else xp.log(p)

    def linearize(self, u: Array, p: Array) -> Linearization:
        kappa, f = self.coefficients(p)
        by_cell = self.supg.dR_df(kappa) if self.source_unknown else self.supg.dR_dkappa(u, kappa, f)
        J_p = np.zeros_like(p)
        if self.alpha:
            by_theta = self.regularization.gradient(self.theta(p))
            J_p = by_theta if self.log or self.source_unknown else by_theta / p
        return Linearization(self._R_p(by_cell, kappa), self.w * self._misfit(u), J_p)

    def _R_p(self, by_cell: Array, kappa: Array) -> Any:
        """Columns dR_e/dp_e from dR_e/dkappa_e or dR_e/df_e, (n_e, 4)."""
        return self.supg.cells.columns(by_cell * kappa[:, None] if self.log else by_cell)

    def _misfit(self, u: Array) -> Array:
        """u - d at the sensor nodes, 0 elsewhere, (n_u,)."""
        misfit = np.zeros_like(u)
        misfit[self.sensor_nodes] = u[self.sensor_nodes] - self._data()
        return misfit

    def observation(self, u: Array, p: Array) -> Observation:
        root = math.sqrt(self.w)
        S_u = selection(self.sensor_nodes, self.n_state, root)
        return Observation(root * u[self.sensor_nodes], root * self._data(), S_u, sigma=root * self.noise, weight=root)

    def candidates(self) -> Candidates:
        """The temperature of every node that is not on the inflow."""
        x = self.supg.x
        return Candidates(np.arange(len(x)), lambda j: f"u at ({x[j, 0]:.3g}, {x[j, 1]:.3g})", x)

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, self.theta(p), np.ones_like(p) if self.log or self.source_unknown else 1.0 / p

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=lambda u, p: self.residual(u, p, jnp), objective=lambda u, p: self.objective(u, p, jnp))

    # --- discretizations that agree as h -> 0

    def integral(self, u: Array, p: Array) -> tuple[float, Array]:
        """1/2 int (u - d)^2 + alpha Phi with the consistent mass matrix; u - d = 0 at the inflow, as in J."""
        misfit = self._misfit(u)
        by_u = self.supg.mass(self.on_outflow) @ misfit
        return float(0.5 * misfit @ by_u + self.regularization.value(np, self.theta(p))), by_u

    def continuous_adjoint(self, u: Array, p: Array) -> tuple[Any, Operator]:
        """-b . grad lam - div(kappa grad lam) = -J_u, kappa dlam/dn + b . n lam = 0 at the outflow, 0 at the inflow.

        Integrated by parts, its advection matrix is C^T; its streamline term, with the test functions
        v - tau b . grad v, is even in b: A equals R_u^T. Q differs from R_p: int grad u . grad lam or -int lam over a
        cell do not contain tau (Collis & Heinkenschloss 2002). The difference is O(tau), hence O(h), and O(h^2) at
        small Peclet numbers.
        """
        kappa, _ = self.coefficients(p)
        A = self.supg.pattern.assemble(_transposed(self.supg, kappa))
        dR_df = np.broadcast_to(-self.supg.m, self.supg.cells.dofs.shape)
        return A, self._R_p(dR_df if self.source_unknown else self.supg.cells.gather(u) @ self.supg.D, kappa)

    def inconsistent_adjoint(self, u: Array, p: Array, other: Discretization) -> tuple[Any, Operator, Array] | None:
        """By the quadrature at corners, without streamline terms, or on a mesh of twice the mesh size (n even)."""
        supg = self._others.get(other)
        if supg is None:
            return None
        kappa, f = self.coefficients(p)
        J_u = self.w * self._misfit(u)
        if other == "mesh":
            I = supg.interpolation(self.supg.x)
            R_p = self.linearize(u, p).R_p
            return supg.pattern.assemble(_transposed(supg, _coarsened(kappa, self.supg, supg))), I.T @ R_p, I.T @ J_u
        by_cell = supg.dR_df(kappa) if self.source_unknown else supg.dR_dkappa(u, kappa, f)
        return supg.pattern.assemble(_transposed(supg, kappa)), self._R_p(by_cell, kappa), J_u

    @cached_property
    def _others(self) -> dict[str, Supg]:
        """Other discretizations of the same equation."""
        b = self.supg.b
        found = {"quadrature": Supg.of(self.n, b, nodal=True), "stabilization": self.supg.unstabilized}
        return found if self.n % 2 else found | {"mesh": Supg.of(self.n // 2, b)}

    # --- synthetic data

    def _data(self) -> Array:
        if self.d is None:
            raise InputError(
                "advection: data=twin are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(advection)"
            )
        return self.d

    def truth(self) -> Array | None:
        return self._truth

    def twin(self) -> Advection | None:
        return self._with_data(np.zeros(len(self.sensor_nodes))) if self.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Advection:
        d = u[self.sensor_nodes]
        rng = np.random.default_rng(self.seed if seed is None else seed)
        return self._with_data(d + self.noise * rng.standard_normal(d.shape))

    def _with_data(self, d: Array) -> Advection:
        other = copy.copy(self)  # shares the mesh
        other.d = d
        return other

    # --- output

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        kappa, f = self.coefficients(p)
        x, y = self.supg.centres.T
        return ParameterView({"x": x, "y": y} | ({"f": f} if self.source_unknown else {"kappa": kappa}))

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u and lam per node; kappa and dJ/dkappa, or f and dJ/df, per cell."""
        kappa, f = self.coefficients(p)
        points = np.pad(self.supg.mesh.p.T, ((0, 0), (0, 1)))
        point_data = {}
        for label, nodal in ({"u": u} if lam is None else {"u": u, "lambda": lam}).items():
            point_data[label] = np.zeros(len(points))  # 0 at the inflow
            point_data[label][self.supg.free] = nodal
        name, values = ("f", f) if self.source_unknown else ("kappa", kappa)
        cell_data = {name: values, f"dJ_d{name}": gradient / kappa if self.log else gradient}
        return Fields(points, "quad", self.supg.mesh.t.T[:, ::-1], point_data, cell_data)


def _transposed(supg: Supg, kappa: Array) -> Array:
    """Element matrices of R_u^T."""
    return np.asarray(supg.cell_matrices(kappa).swapaxes(1, 2))


def _coarsened(values: Array, fine: Supg, coarse: Supg) -> Array:
    """Means over the four cells that make one of the coarse mesh."""
    from scipy.spatial import KDTree

    _, parent = KDTree(coarse.centres).query(fine.centres)
    return np.bincount(parent, values) / 4.0


def _check(
    n: int, angle: float, kappa: float, unknown: str, parametrization: str | None, data: str, noise: float, seed: int,
) -> None:  # fmt: skip
    if not 1 <= n <= N_MAX:
        raise InputError(f"advection: n={n} cells along an edge - choose n >= 1 and <= {N_MAX}")
    if not math.isfinite(angle):
        raise InputError(f"advection: angle={angle:g} - choose a finite one, in degrees")
    if not 1.0 / KAPPA_MAX <= kappa <= KAPPA_MAX:
        raise InputError(f"advection: kappa={kappa:g} - choose a diffusivity from {1 / KAPPA_MAX:g} to {KAPPA_MAX:g}")
    if unknown == "source" and parametrization is not None:
        raise InputError(f"advection: parametrization={parametrization} is of kappa, not of a source - leave it out")
    if not 0 <= noise < math.inf or (noise and data != "twin"):
        raise InputError(f"advection: noise={noise:g} - choose noise >= 0, for synthetic data (data=twin) only")
    if seed < 0:
        raise InputError(f"advection: seed={seed} - choose seed >= 0")
