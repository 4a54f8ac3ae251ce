"""Heat carried off by a flow, diffusing on its way: linear, and R_u is not symmetric.

b . grad u - div(kappa grad u) = f   on the unit square,     |b| = 1 m/s
"""

from __future__ import annotations

import copy
import math
from functools import partial
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data.observation import Candidates, Observation, selection
from gradient_routes.problems.data.regularization import WIDTH as JUMP
from gradient_routes.problems.data.regularization import FieldPhi, Prior
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.fem.prolongation import inherited
from gradient_routes.problems.fem.supg import Supg, direction, inflow
from gradient_routes.problems.problem import (
    Array,
    Fields,
    Linearization,
    Offers,
    Operator,
    Parameters,
    ParameterView,
    Problem,
    Traced,
)

TARGET = 0.5  # temperature wanted where the flow is observed [K]
N_MAX = 3000  # 10^7 cells: more fit in no memory
KAPPA_MAX = 1e12  # and its inverse: squares and cubes of kappa / h^2 stay far from float64's ends
THETA_MAX = 100.0  # the same of log kappa
MIDDLE = np.array([0.5, 0.5])


def plume(x: Array, b: Array) -> Array:
    """The source f(x) = 4 exp(-|x - x_0|^2 / (2 0.15^2)) [K/s], x_0 0.2 m upstream of the middle, at x (..., 2)."""
    return np.asarray(4.0 * np.exp(-((x - MIDDLE + 0.2 * b) ** 2).sum(axis=-1) / (2.0 * 0.15**2)))


def wavy(x: Array) -> Array:
    """1 + 0.4 sin(2 pi x) cos(2 pi y) at points x (..., 2)."""
    return np.asarray(1.0 + 0.4 * np.sin(2.0 * np.pi * x[..., 0]) * np.cos(2.0 * np.pi * x[..., 1]))


def inclusion(x: Array) -> Array:
    """4 in a disc of radius 0.25 in the middle, or at the point next to it, else 1."""
    r = np.linalg.norm(x - MIDDLE, axis=-1)
    return np.where(r < max(0.25, 1.001 * r.min()), 4.0, 1.0)


class Advection(Problem):
    """Heat released into a flow: diffusivities or sources sought from the temperatures downstream.

    State u (n_u,) [K], temperatures of the nodes the flow does not enter by; one kappa or one f a cell, (n_e,).
    J = 1/2 w sum of (u_i - d_i)^2 over the nodes seen, w = h where they are the outflow and h^2 where they are all,
    so that J stands for an integral. Without synthetic data, d = 0.5 K. What is not sought is known: f is a plume, or
    kappa is the same everywhere. SUPG (problems/fem/supg.py) keeps u smooth where cells are too wide for their kappa.
    """

    name = "advection"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    linear = True
    structure = "general"
    regularization: Prior

    def __init__(
        self,
        *,
        n: Annotated[int, "cells along every edge"] = 8,
        angle: Annotated[float, "between the flow and the x axis [degrees]"] = 30.0,
        kappa: Annotated[float, "mean diffusivity; 1 / (2 n kappa) is the mesh Peclet number [m2/s]"] = 0.05,
        unknown: Annotated[Literal["diffusivity", "source"], "what p is, cell by cell"] = "diffusivity",
        parametrization: Annotated[Literal["log", "raw"] | None, "of kappa: p = log kappa or p = kappa [log]"] = None,
        sensors: Annotated[Literal["outflow", "everywhere"], "nodes measured"] = "outflow",
        data: Annotated[Literal["target", "twin"], "0.5 K; twin: of an inclusion, or of the plume"] = "target",
        noise: Annotated[float, "standard deviation added to a twin's data [K]"] = 0.0,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi"] = 0.0,
        phi: Annotated[FieldPhi, "of theta = log kappa or f: 1/2 |D theta|^2 or total variation"] = "tikhonov",
        phi_width: Annotated[float, "jump of theta below which total variation is rounded"] = JUMP,
    ) -> None:
        _check(n, angle, kappa, unknown, parametrization, data, noise, seed)
        check_applies("advection", ("phi=tv", phi == "tv", True, {"phi_width": phi_width != JUMP}))
        self._on_mesh = partial(
            Advection, angle=angle, kappa=kappa, unknown=unknown, parametrization=parametrization, sensors=sensors,
            data=data, noise=noise, seed=seed, alpha=alpha, phi=phi, phi_width=phi_width,
        )  # fmt: skip
        self.n, self.noise, self.seed = n, noise, seed
        self.affine = unknown == "source"
        self.of_source, self.log = unknown == "source", unknown == "diffusivity" and parametrization != "raw"
        b = direction(angle)
        self.supg = Supg.of(n, b)
        self.n_state = len(self.supg.free)
        self.on_outflow = sensors == "outflow"
        self.w = 1.0 / n if self.on_outflow else 1.0 / n**2
        self.seen = np.flatnonzero(inflow(self.supg.x, -b)) if self.on_outflow else np.arange(self.n_state)
        self.d: Array | None = np.full(len(self.seen), TARGET) if data == "target" else None
        self._fields_at(self.supg.centres, b, kappa, blank=data == "twin")
        self.regularization = Prior(alpha, phi, phi_width, self.supg.neighbours)
        self.regularization.check("advection")

    def _fields_at(self, x: Array, b: Array, kappa: float, blank: bool) -> None:
        """What is known, and the parameters: where they start, and what made a twin's data."""
        ones = np.ones(len(x))
        self.kappa, self.f = kappa * ones, plume(x, b)
        if self.of_source:
            start, truth, bounds, unit, name = ones if blank else self.f, self.f, (-np.inf, np.inf), "K/s", "f"
        else:
            start, truth = kappa * (ones if blank else wavy(x)), kappa * inclusion(x)
            bounds, unit, name = (0.0, math.exp(THETA_MAX)), "m2/s", "kappa"
        if self.log:
            start, truth = np.log(start), np.log(truth)
            bounds, unit, name = (-THETA_MAX, THETA_MAX), f"log {unit}", f"log {name}"
        scale = ones if self.log or self.of_source else self.kappa
        self._truth = truth if blank else None
        self.parameters = Parameters(start, scale, *bounds, unit, lambda e: f"{name}_{e + 1}", x)

    def refined(self, p: Array) -> tuple[Advection, Array]:
        """Every cell in four; a twin's data are still to be solved for, on its own mesh."""
        finer = self._on_mesh(n=2 * self.n)
        x, x_fine = self.parameters.position, finer.parameters.position
        assert x is not None
        assert x_fine is not None
        return finer, inherited(p, x, x_fine)

    # --- the physics

    def setting(self, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """kappa (n_e,) [m2/s] and f (n_e,) [K/s]."""
        if self.of_source:
            return xp.asarray(self.kappa), p
        return xp.exp(p) if self.log else p, xp.asarray(self.f)

    def residual(self, u: Any, p: Any, xp: Any = np) -> Any:
        """R (n_u,) [K m2/s]."""
        return self.supg.residual(u, *self.setting(p, xp), xp)

    def tangent(self, u: Array, p: Array) -> Any:
        kappa, _ = self.setting(p)
        return self.supg.tangent(kappa.astype(p.dtype))

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = w/2 |u - d|^2 + alpha Phi [K2 m, K2 m2 where all is seen]."""
        J = 0.5 * self.w * xp.sum((u[self.seen] - self._data()) ** 2)
        return J + self.regularization.value(xp, self._theta(p, xp)) if self.alpha else J

    def _theta(self, p: Any, xp: Any = np) -> Any:
        return p if self.log or self.of_source else xp.log(p)

    def linearize(self, u: Array, p: Array) -> Linearization:
        kappa, f = self.setting(p)
        by_cell = self.supg.by_f(kappa) if self.of_source else self.supg.by_kappa(u, kappa, f)
        J_p = np.zeros_like(p)
        if self.alpha:
            by_theta = self.regularization.gradient(self._theta(p))
            J_p = by_theta if self.log or self.of_source else by_theta / p
        return Linearization(self._by_p(by_cell, kappa), self.w * self._misfit(u), J_p)

    def _by_p(self, by_cell: Array, kappa: Array) -> Any:
        """Columns dR_e/dp_e from dR_e/dkappa_e or dR_e/df_e, (n_e, 4)."""
        return self.supg.columns(by_cell * kappa[:, None] if self.log else by_cell)

    def _misfit(self, u: Array) -> Array:
        """u - d at the nodes seen, 0 at the others, (n_u,)."""
        misfit = np.zeros_like(u)
        misfit[self.seen] = u[self.seen] - self._data()
        return misfit

    def observation(self, u: Array, p: Array) -> Observation:
        root = math.sqrt(self.w)
        S_u = selection(self.seen, self.n_state, root)
        return Observation(root * u[self.seen], root * self._data(), S_u, sigma=root * self.noise, weight=root)

    def candidates(self) -> Candidates:
        """The temperature of every node that the flow does not enter by."""
        x = self.supg.x
        return Candidates(np.arange(len(x)), lambda j: f"u at ({x[j, 0]:.3g}, {x[j, 1]:.3g})", x)

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, self._theta(p), np.ones_like(p) if self.log or self.of_source else 1.0 / p

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=lambda u, p: self.residual(u, p, jnp), objective=lambda u, p: self.objective(u, p, jnp))

    # --- what converges to the same as h -> 0

    def integral(self, u: Array, p: Array) -> tuple[float, Array]:
        """1/2 int (u - d)^2 + alpha Phi with the consistent mass matrix; u - d is 0 at the inflow, as in J."""
        misfit = self._misfit(u)
        by_u = self.supg.mass(self.on_outflow) @ misfit
        return float(0.5 * misfit @ by_u + self.regularization.value(np, self._theta(p))), by_u

    def continuous_adjoint(self, u: Array, p: Array) -> tuple[Any, Operator]:
        """-b . grad lam - div(kappa grad lam) = -J_u, kappa dlam/dn + b . n lam = 0 at the outflow, 0 at the inflow.

        By parts its advection is C^T; its own streamline term, of test functions v - tau b . grad v, is even in b: A
        comes out as R_u^T. What differs is Q: int grad u . grad lam or -int lam in a cell, which know of no tau
        (Collis & Heinkenschloss 2002), by O(tau) = O(h), O(h^2) once cells are narrow.
        """
        kappa, _ = self.setting(p)
        A = self.supg.pattern.assemble(self.supg.cell_matrices(kappa).swapaxes(1, 2))
        by_f = np.broadcast_to(-self.supg.m, self.supg.unknowns.shape)
        return A, self._by_p(by_f if self.of_source else self.supg.at_corners(u) @ self.supg.D, kappa)

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
        return self._with_data(np.zeros(len(self.seen))) if self.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Advection:
        d = u[self.seen]
        rng = np.random.default_rng(self.seed if seed is None else seed)
        return self._with_data(d + self.noise * rng.standard_normal(d.shape))

    def _with_data(self, d: Array) -> Advection:
        other = copy.copy(self)  # shares the mesh: no data in it
        other.d = d
        return other

    # --- what a person looks at

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        kappa, f = self.setting(p)
        x, y = self.supg.centres.T
        return ParameterView({"x": x, "y": y} | ({"f": f} if self.of_source else {"kappa": kappa}))

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """u and lam of every node; kappa and dJ/dkappa, or f and dJ/df, of every cell."""
        kappa, f = self.setting(p)
        points = np.pad(self.supg.mesh.p.T, ((0, 0), (0, 1)))
        point_data = {}
        for label, nodal in ({"u": u} if lam is None else {"u": u, "lambda": lam}).items():
            point_data[label] = np.zeros(len(points))  # 0 at the inflow
            point_data[label][self.supg.free] = nodal
        name, values = ("f", f) if self.of_source else ("kappa", kappa)
        cell_data = {name: values, f"dJ_d{name}": gradient / kappa if self.log else gradient}
        return Fields(points, "quad", self.supg.mesh.t.T[:, ::-1], point_data, cell_data)


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
