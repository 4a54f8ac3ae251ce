"""Heat conduction in time, in a rectangle that is heated at x = 0 and loses heat through its other sides.

rho c T' - div(k grad T) = f,    k dT/dn = h (T_inf - T) on the sides,    T = T_b at x = 0,    T = T_0 at t = 0
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data.histories import Histories, check_within, read_histories
from gradient_routes.problems.data.observation import Candidates
from gradient_routes.problems.data.placing import place
from gradient_routes.problems.data.regularization import PHI_WIDTH, FieldPhi, Prior
from gradient_routes.problems.data.thermocouples import check_celsius
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.dynamics.first_order import FirstOrder, Probe, SchemeName, check_march
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.heat.body import Body
from gradient_routes.problems.heat.conducting import Conducting
from gradient_routes.problems.heat.unknowns import Unknowns
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.sparse import SymmetricSparse
from gradient_routes.problems.problem import Array, Fields, ParameterView

Unknown = Literal[
    "diffusivity", "film", "source", "initial", "diffusivity+film", "diffusivity+source", "diffusivity+initial",
    "film+source", "film+initial", "source+initial",
]  # fmt: skip
DT = 30.0  # [s]


class Heat(FirstOrder):
    """A body heated up: its diffusivity, film coefficient, source or initial temperature from thermocouples in time.

    State (T n_u,) [K]: temperatures above the surroundings after every step, of the nodes where none is prescribed.
    Bilinear elements, k = a rho c; p is a, log a, .. of parts of the body. R is in W/m: per metre of depth.
    J = 1/2 sum_k (T(x_k, t_k) - d_k)^2 + alpha Phi [K2]: linear in time between steps, bilinear between nodes.
    Synthetic data are those of 0.8 a, 1.3 h, 1.2 f and 1.05 T_0, of parts with a wave of 30 % (of T_0, 2 %).
    """

    name = "heat"
    typical = 0
    from_rest = True
    regularization: Prior
    _recorded: tuple[Array, Array] | None = None  # t [s], T [K] of a file

    def __init__(
        self,
        *,
        n: Annotated[int, "cells along x"] = 8,
        ny: Annotated[int | None, "cells along y [n]; 1: heat flows along x alone"] = None,
        size: Annotated[float | str | None, "lengths Lx,Ly or one for both [m], or 100mm [0.1; see data]"] = None,
        steps: Annotated[int, "of time, T"] = 20,
        dt: Annotated[float | str | None, "length of a step [s], or 0.5min [30; a file's, to its last datum]"] = None,
        scheme: Annotated[SchemeName, "of order 1, or 2"] = "backward-euler",
        conductivity: Annotated[float | None, "k [W/m/K], if a is unknown of the start [50; see data]"] = None,
        density: Annotated[float | None, "rho [kg/m3] [7800; see data]"] = None,
        heat_capacity: Annotated[float | None, "c [J/kg/K] [470; see data]"] = None,
        film: Annotated[
            float | None, "coefficient h of heat loss [W/m2/K], if unknown the start [100; see data]"
        ] = None,
        exposed: Annotated[
            str, "sides that lose heat: some of left,right,bottom,top, or none [all but the base]"
        ] = "all",
        source: Annotated[float | None, "f in the body [W/m3], if unknown the start [0, if unknown 1e5]"] = None,
        base: Annotated[
            float | str | None, "T at x=0 [K], or 100degC; free: x=0 is like other sides [373.15; see data]"
        ] = None,
        ambient: Annotated[float | str | None, "T_inf of the surroundings [K], or 20degC [293.15; see data]"] = None,
        initial: Annotated[float | str | None, "T_0 at first [K], or 20degC, if unknown the start [ambient]"] = None,
        unknown: Annotated[Unknown, "what p is: diffusivity a = k/(rho c), .."] = "diffusivity",
        parts: Annotated[int, "along every edge, each with a value of its own"] = 1,
        parametrization: Annotated[Literal["log", "raw"], "of a and h: p = log a or p = a"] = "log",
        sensors: Annotated[int, "along every edge, thermocouples of synthetic data, amid as many equal parts"] = 2,
        data: Annotated[str | None, "file of thermocouples, columns t,x,y,T: state the body, too [synthetic]"] = None,
        columns: Annotated[str | None, "of the file, t:NAME,T:NAME [by its header]"] = None,
        units: Annotated[str | None, "of the file, such as min,mm,degC [the header's, else s, m and K]"] = None,
        noise: Annotated[
            float | str | None, "standard deviation of a file's data, added to others [K], or 0.1K"
        ] = None,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi"] = 0.0,
        phi: Annotated[FieldPhi, "1/2 |D log a|^2, D between neighbouring parts, or total variation"] = "tikhonov",
        phi_width: Annotated[float, "jump of log a below which total variation is rounded"] = PHI_WIDTH,
    ) -> None:
        given = {key: option for key, option in locals().items() if key not in ("self", "__class__")}
        names = unknown.split("+")
        check_applies(
            self.name,
            ("data=FILE", data is not None, True, {"columns": columns, "units": units}),
            ("parts=2 or more", parts > 1, True, {"alpha": alpha != 0.0}),
            ("phi=tv", phi == "tv", True, {"phi_width": phi_width != PHI_WIDTH}),
        )
        if sensors < 1 or seed < 0:
            raise InputError(f"heat: sensors={sensors},seed={seed} - choose at least one sensor, and a seed >= 0")
        self._given, self.seed = given, seed
        self.noise = standard_deviation(noise, data is not None, self.name, "temperature change")
        self.body = body = Body.of(given, names)
        h = check_march(self.name, steps, dt, body.cells[0] * body.cells[1])
        self.solid = Conducting.of(body.cells, body.size, body.base is not None, body.exposed, parts)
        if data is None:
            h = DT if h is None else h
            m = np.array([sensors, sensors if body.cells[1] > 1 else 1])
            x = np.stack(np.meshgrid(*((np.arange(k) + 0.5) / k for k in m), indexing="ij"), axis=-1).reshape(-1, 2)
            sizes = body.sizes(given, names, None, None)
            placed, between = place(self.solid.mesh, x * body.size, self.name), False
        else:
            read = read_histories(data, self.solid.mesh, columns, units, self.noise)
            if read.celsius:
                check_celsius(self.name, given, ("ambient", "base", "initial"), data)
            h = float(read.t.max()) / steps if h is None else h
            if h <= 0.0:
                raise InputError(f"{data}: no datum is later than t = 0, where the march starts - state dt=, or units")
            check_within(data, read, steps * h)
            self.histories = Histories.at_times(read.sensor, read.t, read.T - body.T_inf, h, steps)
            placed, between, self.measured = read.placed, self.histories.between, True
            self.noise = read.sigma
            self._recorded = read.t, read.T
            sizes = body.sizes(given, names, *self._recorded)
            self.read_as = (*read.notes, f"start: {', '.join(f'{name}={sizes[name]:.4g}' for name in names)}")
        dofs = np.where(self.solid.free, np.cumsum(self.solid.free) - 1, -1)[placed.nodes]
        probe = Probe(dofs, placed.N, placed.x, body.excess)
        self.set_march(len(self.solid.volume), steps, h, scheme, probe, between)
        self.row = body.rho_c * float(self.solid.volume.mean()) / h
        cells = dict.fromkeys(("diffusivity", "source", "initial"), self.solid.parts)
        self.parts = cells | {"film": self.solid.sides}
        self.sizes = sizes
        self.unknowns = Unknowns.of(names, self.sizes, self.parts, parametrization == "log")
        self.parameters = self.unknowns.parameters(np.array(body.size))
        self.regularization = Prior(alpha, phi, phi_width, self.unknowns.neighbours)
        self.regularization.check(self.name)
        known = self._recorded[1] if self._recorded is not None and not {"source", "initial"} & {*names} else None
        self.notes = (*body.doubts(sizes, self.h, self.a < 1.0, known), *self.read_as)

    # --- the equations

    def coefficients(self, p: Any, xp: Any = np) -> tuple[Any, Any, Any]:
        """k (n_e,) [W/m/K], h (n_f,) [W/m2/K], f (n_e,) [W/m3]."""
        values = self._values(p, xp)
        k = values["diffusivity"][self.solid.cell_part] * self.body.rho_c
        return k, values["film"][self.solid.edge_part], values["source"][self.solid.cell_part]

    def _values(self, p: Any, xp: Any = np) -> dict[str, Any]:
        """a, h, f and T_0 of their parts, by name."""
        known = {name: xp.full(len(self.parts[name].x), size) for name, size in self.sizes.items()}
        return known | self.unknowns.values(p, xp)

    def stored(self, rate: Any, p: Any, xp: Any = np) -> Any:
        return self.body.rho_c * self.solid.volume * rate

    def balance(self, u: Any, p: Any, xp: Any = np) -> Any:
        return self.solid.balance(u, self.body.excess, *self.coefficients(p, xp), xp)

    def matrix(self, p: Array, of_rate: float, of_state: float) -> SymmetricSparse:
        k, h, _ = self.coefficients(p)
        return self.solid.matrix(of_state * k.astype(p.dtype), of_state * h, of_rate * self.body.rho_c)

    def by_p(self, rate: Array, u: Array, p: Array) -> ByProducts:
        each = [c for c in self.unknowns.each if c.name != "initial"]
        by = [self.solid.by(c.name, u, self.body.excess) for c in each]
        slopes = [c.slope(p) * (self.body.rho_c if c.name == "diffusivity" else 1.0) for c in each]

        def forward(dp: Array) -> Array:
            terms = (A @ (slope * dp[c.at]) for c, A, slope in zip(each, by, slopes, strict=True))
            return sum(terms, np.zeros(self.n_field))

        def reverse(lam: Array) -> Array:
            g = np.zeros_like(p)
            for c, A, slope in zip(each, by, slopes, strict=True):
                g[c.at] = slope * (A.T @ lam)
            return g

        return ByProducts(forward, reverse)

    def field_at_start(self, p: Any, xp: Any = np) -> Any:
        """At every node the mean of the parts about it."""
        T_0 = self._values(p, xp)["initial"] - self.body.T_inf
        return self.solid.cells.means(T_0[self.solid.cell_part], xp).astype(p.dtype)

    def initial_by(self, p: Array) -> Any:
        at = next((c.at for c in self.unknowns.each if c.name == "initial"), None)
        if at is None:
            return None
        return self.below(self.solid.cells.means_by(at.start + self.solid.cell_part, len(p)))

    def phi(self, p: Any, xp: Any = np) -> Any:
        return self.regularization.value(xp, self.unknowns.theta(p, xp)) if self.alpha else 0.0

    def phi_by(self, p: Array) -> Array:
        if not self.alpha:
            return np.zeros_like(p)
        return self.regularization.gradient(self.unknowns.theta(p)) * self.unknowns.theta_slope(p)

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, self.unknowns.theta(p), self.unknowns.theta_slope(p)

    # --- data and output

    def candidates(self) -> Candidates:
        return self.candidates_at(self.solid.mesh.geometry.X[self.solid.free])

    def told_by_data(self, p: Array) -> tuple[Heat, float] | None:
        """As where no start is stated, see `Body.sizes`; a temperature has no factor to be off by."""
        each = [c for c in self.unknowns.each if c.of.positive]
        if self._recorded is None or not each:
            return None
        names = [c.name for c in self.unknowns.each]
        unstated = self._given | dict.fromkeys(["conductivity" if name == "diffusivity" else name for name in names])
        other = copy.copy(self)
        other.sizes = self.body.sizes(unstated, names, *self._recorded)
        log = self._given["parametrization"] == "log"
        other.unknowns = Unknowns.of(names, other.sizes, self.parts, log)
        other.parameters = other.unknowns.parameters(np.array(self.body.size))
        ratios = [float(np.mean(c.value(p))) / other.sizes[c.name] for c in each]
        return other, max(max(r, 1.0 / r) if r > 0.0 else math.inf for r in ratios)

    def halved(self) -> Heat | None:
        return type(self)(**self._given | {"steps": 2 * self.steps, "dt": self.h / 2.0}) if self.measured else None

    def truth(self) -> Array | None:
        return None if self.measured else self.unknowns.truth

    def fields(self, p: Array, u: Array, lam: Array | None, gradient: Array) -> Fields:
        """T after the last step per node; a, f or T_0, and derivatives by a, log a, .., per cell."""
        last, body = u.reshape(self.steps, -1)[-1, : self.n_field], self.body
        of_cells = [c for c in self.unknowns.each if c.name != "film"]
        values = {c.name: c.value(p) for c in of_cells}
        values |= {f"dJ_d{'log_' * c.log}{c.of.symbol}": gradient[c.at] for c in of_cells}
        return self.solid.fields(body.T_inf + last, body.T_inf + body.excess, values)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        x = self.parameters.position
        assert x is not None
        shown = super().view(p, u, lam)
        values = np.concatenate([*self.unknowns.values(p).values()])
        return replace(shown, columns={"x": x[:, 0], "y": x[:, 1], "value": values, **shown.columns})
