"""Heat released into a flow, in time: diffusivities, sources or the temperatures at first from those downstream.

u' + b . grad u - div(kappa grad u) = f,    u = 0 at the inflow,    u(0) = 0 or unknown

Streamline-upwind Petrov-Galerkin with the test functions v + tau b . grad v in all terms, u' among them (Brooks &
Hughes 1982); tau is that of the steady equation.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems import advection as options
from gradient_routes.problems.advection import Advection, plume
from gradient_routes.problems.data.observation import Candidates
from gradient_routes.problems.data.regularization import PHI_WIDTH, Prior
from gradient_routes.problems.dynamics.first_order import FirstOrder, Probe, SchemeName, check_march
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.sparse import GeneralSparse
from gradient_routes.problems.problem import Array, Parameters, ParameterView


class AdvectionInTime(FirstOrder):
    """Heat in a flow after every step: one kappa, one f or one u(0) per cell, sought from histories downstream.

    State (T n_u,) [K], temperatures of the nodes that are not on the inflow. The mesh, the coefficients and Phi are
    those of `advection`; J = 1/2 c sum of (u_i(t) - d_i(t))^2 over sensor nodes and steps, with c = h dt for the
    outflow and h^2 dt for all nodes, approximates an integral. Data are synthetic: of an inclusion, a plume or a cloud.
    """

    name = "advection-in-time"
    regularization: Prior

    def __init__(
        self,
        *,
        n: options.Cells = 8,
        angle: options.Angle = 30.0,
        kappa: options.Kappa = 0.05,
        steps: Annotated[int, "of time, T"] = 20,
        dt: Annotated[float, "length of a step [s]; the flow crosses the square in 1 s"] = 0.05,
        scheme: Annotated[SchemeName, "of order 1, or 2"] = "backward-euler",
        unknown: Annotated[Literal["diffusivity", "source", "initial"], "what p is, cell by cell"] = "diffusivity",
        parametrization: options.Parametrization = None,
        sensors: options.SensorsOf = "outflow",
        noise: options.Noise = 0.0,
        seed: options.Seed = 0,
        alpha: options.Alpha = 0.0,
        phi: options.PhiOf = "tikhonov",
        phi_width: options.PhiWidth = PHI_WIDTH,
    ) -> None:
        h = check_march(self.name, steps, dt, n**2)
        assert h is not None
        self.initial_unknown = unknown == "initial"
        try:
            self.steady = Advection(
                n=n, angle=angle, kappa=kappa, unknown="diffusivity" if unknown == "diffusivity" else "source",
                parametrization=parametrization, sensors=sensors, data="twin", noise=noise, seed=seed, alpha=alpha,
                phi=phi, phi_width=phi_width,
            )  # fmt: skip
        except InputError as error:
            raise InputError(str(error).replace("advection", self.name, 1)) from error
        self.supg, self.noise, self.seed = self.steady.supg, noise, seed
        nodes = self.steady.sensor_nodes
        probe = Probe(nodes[:, None], np.ones((len(nodes), 1)), self.supg.x[nodes])
        self.set_march(len(self.supg.free), steps, h, scheme, probe, between=False)
        self.c = self.steady.w * h
        q = self.steady.parameters
        if self.initial_unknown:
            q = Parameters(q.start, q.scale, unit="K", label=lambda e: f"u_0 of cell {e + 1}", position=q.position)
        self.parameters = q
        self.regularization = self.steady.regularization

    # --- the equations

    def coefficients(self, p: Any, xp: Any = np) -> tuple[Any, Any]:
        """kappa (n_e,) [m2/s] and f (n_e,) [K/s]."""
        if self.initial_unknown:
            return xp.asarray(self.steady.kappa), xp.zeros(len(self.steady.kappa))
        return self.steady.coefficients(p, xp)

    def stored(self, rate: Any, p: Any, xp: Any = np) -> Any:
        U, tau = self.supg.cells.gather(rate, xp), self.supg.tau(self.coefficients(p, xp)[0])
        return self.supg.cells.scatter(U @ self.supg.M.T + tau[:, None] * (U @ self.supg.C), xp)

    def balance(self, u: Any, p: Any, xp: Any = np) -> Any:
        return self.supg.residual(u, *self.coefficients(p, xp), xp)

    def matrix(self, p: Array, of_rate: float, of_state: float) -> GeneralSparse:
        kappa, supg = self.coefficients(p)[0].astype(p.dtype), self.supg
        mass = supg.M + supg.tau(kappa)[:, None, None] * supg.C.T
        return supg.pattern.assemble(of_state * supg.cell_matrices(kappa) + of_rate * mass)

    def by_p(self, rate: Array, u: Array, p: Array) -> ByProducts:
        kappa, f = self.coefficients(p)
        supg, cells = self.supg, self.supg.cells
        if self.initial_unknown:
            by_e = np.zeros(cells.dofs.shape)
        elif self.steady.source_unknown:
            by_e = supg.dR_df(kappa)
        else:
            stored = supg.tau_kappa(kappa)[:, None] * (cells.gather(rate) @ supg.C)
            by_e = supg.dR_dkappa(u, kappa, f) + stored
            by_e = by_e * kappa[:, None] if self.steady.log else by_e
        return cells.products(by_e, np.arange(len(p)), len(p))

    def field_at_start(self, p: Any, xp: Any = np) -> Any:
        if not self.initial_unknown:
            return super().field_at_start(p, xp)
        return self.supg.cells.means(p, xp)

    def initial_by(self, p: Array) -> Any:
        return self.supg.cells.means_by(np.arange(len(p)), len(p)) if self.initial_unknown else None

    def phi(self, p: Any, xp: Any = np) -> Any:
        return self.regularization.value(xp, self.steady.theta(p, xp)) if self.alpha else 0.0

    def phi_by(self, p: Array) -> Array:
        if not self.alpha:
            return np.zeros_like(p)
        prior, theta, slope = self.prior(p)
        return prior.gradient(theta) * slope

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        _, theta, slope = self.steady.prior(p)
        return self.regularization, theta, slope

    # --- data and output

    def candidates(self) -> Candidates:
        return self.candidates_at(self.supg.x)

    def truth(self) -> Array | None:
        """The inclusion or the plume of `advection`; the cloud that is as large as the plume, 4 K in its middle."""
        return plume(self.supg.centres, self.supg.b) if self.initial_unknown else self.steady.truth()

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        shown, x = super().view(p, u, lam), self.supg.centres
        kappa, f = self.coefficients(p)
        value = p if self.initial_unknown else f if self.steady.source_unknown else kappa
        return replace(shown, columns={"x": x[:, 0], "y": x[:, 1], "value": value, **shown.columns})
