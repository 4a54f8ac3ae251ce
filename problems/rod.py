"""The rod: steady conduction along x and convection from its surface, N linear elements of length dx.

-(k A T')' + h P (T - T_inf) = 0,    K_e = k_e A/dx [[1, -1], [-1, 1]] + h_e P dx/6 [[2, 1], [1, 2]]

A flux q enters at x = 0, or T is prescribed there; the tip at x = L is insulated, loses heat by h, or has a given T.
"""

from __future__ import annotations

import copy
import math
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import PHI_WIDTH, FieldPhi, Prior
from gradient_routes.problems.data.thermocouples import Line, check_celsius, read_thermocouples
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.errors import InputError, check_applies
from gradient_routes.problems.heat.fin import Fin, check_given, value
from gradient_routes.problems.heat.unknowns import Parts, Unknowns
from gradient_routes.problems.matrices.sparse import SymmetricPattern, SymmetricSparse
from gradient_routes.problems.problem import (
    Array,
    Linearization,
    Offers,
    ParameterView,
    Problem,
    Traced,
)

N_MAX = 10**6
COARSE = 0.01  # relative error of the temperatures from which on a note tells it

Unknown = Literal["film", "conductivity", "flux", "film+conductivity", "film+flux", "conductivity+flux"]


class Rod(Problem):
    """A rod heated at one end: film coefficient, conductivity or flux sought from thermocouples along it.

    State u (n_u,) [K]: temperatures above the surroundings, of the nodes where none is prescribed. So are the data d.
    Synthetic ones are those of 1.3 h, 0.8 k and 1.2 q, of parts with a wave of 30 % along x.
    The elements err by about (m dx)^2/12 with m^2 = h P / (k A); a note says where that is more than 1 %.
    """

    name = "rod"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    linear = True
    structure = "spd"
    typical = 0
    from_rest = True
    regularization: Prior

    def __init__(
        self,
        *,
        n: Annotated[int, "number of elements N"] = 20,
        length: Annotated[float | str | None, "L [m], or 300mm [0.3; a file's rod has no defaults]"] = None,
        diameter: Annotated[float | str | None, "of a round rod [m], or 10mm [0.01]"] = None,
        area: Annotated[float | None, "cross-section A of another one [m2]"] = None,
        perimeter: Annotated[float | str | None, "P of another one [m], or 60mm"] = None,
        conductivity: Annotated[float | None, "k [W/m/K], if unknown the start [50; fitted to a file]"] = None,
        film: Annotated[float | None, "coefficient h of heat loss [W/m2/K], likewise [10; fitted to a file]"] = None,
        flux: Annotated[float | None, "q in place of base [W/m2], likewise [2e4; fitted to a file]"] = None,
        base: Annotated[float | str | None, "T at x=0 [K], or 100degC [373.15]"] = None,
        tip: Annotated[str, "x=L: insulated, convective with the same h, or its T [K], or 27degC"] = "insulated",
        ambient: Annotated[float | str | None, "T_inf of the surroundings [K], or 20degC [293.15]"] = None,
        unknown: Annotated[Unknown, "what p is"] = "film",
        parts: Annotated[int, "of equal length, with one film coefficient or conductivity each"] = 1,
        parametrization: Annotated[Literal["log", "raw"], "of h and k: p = log h or p = h"] = "log",
        sensors: Annotated[int, "thermocouples of synthetic data, in the middles of as many equal lengths"] = 6,
        data: Annotated[str | None, "file of thermocouples, columns x,T [synthetic]"] = None,
        columns: Annotated[str | None, "of the file, x:NAME,T:NAME [by its header]"] = None,
        units: Annotated[str | None, "of the file, such as mm,degC [the header's, else m and K]"] = None,
        noise: Annotated[
            float | str | None, "standard deviation of a file's data, added to others [K], or 0.1K"
        ] = None,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi"] = 0.0,
        phi: Annotated[FieldPhi, "1/2 |D log h|^2, D between neighbouring parts, or total variation"] = "tikhonov",
        phi_width: Annotated[float, "jump of log h below which total variation is rounded"] = PHI_WIDTH,
    ) -> None:
        self._given = {key: option for key, option in locals().items() if key not in ("self", "__class__")}
        check_applies(
            "rod",
            ("data=FILE", data is not None, True, {"columns": columns, "units": units}),
            ("parts=2 or more", parts > 1, True, {"alpha": alpha != 0.0}),
            ("phi=tv", phi == "tv", True, {"phi_width": phi_width != PHI_WIDTH}),
            ("perimeter", perimeter is not None, True, {"area": area is not None}),
            ("area", area is not None, True, {"perimeter": perimeter is not None}),
        )
        if not 1 <= n <= N_MAX or parts < 1 or n % parts:
            raise InputError(f"rod: n={n},parts={parts} - choose 1 <= n <= {N_MAX}, and parts that divide n")
        if sensors < 1 or seed < 0:
            raise InputError(f"rod: sensors={sensors},seed={seed} - choose at least one sensor, and a seed >= 0")
        self.n, self.seed = n, seed
        names, given = unknown.split("+"), self._given
        self.heated = flux is not None or "flux" in names
        if base is not None and self.heated:
            raise InputError(f"rod: base={base} and a flux, both at x=0 - keep one of them")
        self.noise = standard_deviation(noise, data is not None, "rod", "temperature change")
        if data is not None:
            check_given(given, names, self.heated)
        self.fin = Fin.of(given, self.heated)
        self.dx = self.fin.L / n
        self._set_mesh()
        self.sizes = {name: value(name, given) for name in ("film", "conductivity", "flux")}
        self.d: Array | None = None
        x = (np.arange(sensors) + 0.5) * self.fin.L / sensors
        if data is not None:
            x = self._read(data)
            if all(given[name] is None for name in names) and not self.fin.behind.size:
                self.sizes = self.fin.sizes(names, self.sizes, x, self._data())
        self.sensors = Line.through(x, self.fin.L, n)
        self.part = np.arange(n) * parts // n  # (N,) of every element
        each = {"film": Parts.line(parts), "conductivity": Parts.line(parts), "flux": Parts.point()}
        self.unknowns = Unknowns.of(names, self.sizes, each, parametrization == "log")
        self.parameters = self.unknowns.parameters(self.fin.L)
        self.regularization = Prior(alpha, phi, phi_width, self.unknowns.neighbours)
        self.regularization.check("rod")
        self._update_notes()

    def _set_mesh(self) -> None:
        """Sets the free nodes and the pattern of R_u. Raises InputError where there are none."""
        self.free = slice(len(self.fin.before), self.n + 1 - len(self.fin.behind))
        self.n_state = self.free.stop - self.free.start
        if not self.n_state:
            raise InputError("rod: n=1 with T given at both ends leaves no unknown - choose n >= 2")
        dof = np.full(self.n + 1, -1)
        dof[self.free] = np.arange(self.n_state)
        self.pattern = SymmetricPattern.of_elements(np.stack([dof[:-1], dof[1:]], axis=1), self.n_state)

    # --- the equations

    def coefficients(self, p: Any, xp: Any = np) -> tuple[Any, Any, Any]:
        """k (N,) [W/m/K], h (N,) [W/m2/K] and q [W/m2]."""
        values = {name: xp.full(1 + int(self.part[-1]), size) for name, size in self.sizes.items()}
        values |= self.unknowns.values(p, xp)
        return values["conductivity"][self.part], values["film"][self.part], values["flux"][0]

    def excess(self, u: Any, xp: Any = np) -> Any:
        """T - T_inf of all nodes, (N + 1,) [K]."""
        return xp.concatenate([xp.asarray(self.fin.before), u, xp.asarray(self.fin.behind)])

    def residual(self, u: Any, p: Any, xp: Any = np) -> Any:
        """R (n_u,) [W]: the heat that leaves every free node."""
        (k, h, q), theta = self.coefficients(p, xp), self.excess(u, xp)
        a, b = theta[:-1], theta[1:]
        conducted, lost = k * self.fin.A / self.dx * (a - b), h * self.fin.P * self.dx / 6.0
        left, right = lost * (2.0 * a + b) + conducted, lost * (a + 2.0 * b) - conducted
        tip = h[-1:] * self.fin.A * b[-1:] if self.fin.convective else xp.zeros(1)
        R = xp.concatenate([left[:1] - q * self.fin.A, left[1:] + right[:-1], right[-1:] + tip])
        return R[self.free]

    def tangent(self, u: Array, p: Array) -> SymmetricSparse:
        k, h, _ = self.coefficients(p)
        upper = np.outer(k * self.fin.A / self.dx, [1.0, -1.0, 1.0]) + np.outer(
            h * self.fin.P * self.dx / 6.0, [2.0, 1.0, 2.0]
        )
        if self.fin.convective:
            upper[-1, 2] += h[-1] * self.fin.A
        return self.pattern.assemble(upper.astype(p.dtype))

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 |S u - d|^2 + alpha Phi [K2]."""
        J = 0.5 * xp.sum((self.sensors.read(self.excess(u, xp)) - self._data()) ** 2)
        return J + self.regularization.value(xp, self.unknowns.theta(p, xp)) if self.alpha else J

    def linearize(self, u: Array, p: Array) -> Linearization:
        from scipy import sparse

        J_p = np.zeros_like(p)
        if self.alpha:
            J_p = self.regularization.gradient(self.unknowns.theta(p)) * self.unknowns.theta_slope(p)
        S = self.sensors.matrix()
        columns = [self._by(c.name, u) * c.slope(p) for c in self.unknowns.each]
        R_p = sparse.csr_array(sparse.hstack(columns, format="csr")[self.free])
        return Linearization(R_p, (S.T @ self._misfit(u))[self.free], J_p)

    def _by(self, name: str, u: Array) -> Any:
        """Derivatives of R at all nodes (N + 1, m) with respect to k or h of the parts, or q."""
        from scipy import sparse

        if name == "flux":
            return sparse.csr_array(([-self.fin.A], ([0], [0])), shape=(self.n + 1, 1))
        theta = self.excess(u)
        a, b = theta[:-1], theta[1:]
        left, right = self.fin.A / self.dx * (a - b), self.fin.A / self.dx * (b - a)
        if name == "film":
            left, right = self.fin.P * self.dx / 6.0 * (2.0 * a + b), self.fin.P * self.dx / 6.0 * (a + 2.0 * b)
            right[-1] += self.fin.A * b[-1] if self.fin.convective else 0.0
        e = np.arange(self.n)
        at = np.concatenate([e, e + 1]), np.concatenate([self.part, self.part])
        return sparse.csr_array((np.concatenate([left, right]), at), shape=(self.n + 1, 1 + int(self.part[-1])))

    def _misfit(self, u: Array) -> Array:
        return np.asarray(self.sensors.read(self.excess(u)) - self._data())

    def observation(self, u: Array, p: Array) -> Observation:
        x, S = self.sensors.x, self.sensors.matrix()[:, self.free]
        predicted = self.sensors.read(self.excess(u))
        label, at = (lambda k: f"T at {x[k]:.3g}"), x[:, None]
        return Observation(predicted, self._data(), S, sigma=self.noise, label=label, position=at)

    def candidates(self) -> Candidates:
        """The temperature of every free node."""
        x = np.arange(self.n + 1)[self.free] * self.dx
        return Candidates(np.arange(self.n_state), lambda j: f"T at {x[j]:.3g}", x[:, None])

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, self.unknowns.theta(p), self.unknowns.theta_slope(p)

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        return Traced(residual=lambda u, p: self.residual(u, p, jnp), objective=lambda u, p: self.objective(u, p, jnp))

    def refined(self, p: Array) -> tuple[Rod, Array] | None:
        """Every element split in two, the same data."""
        if 2 * self.n > N_MAX:
            return None
        finer = Rod(**self._given | {"n": 2 * self.n})
        finer.d, finer.regularization = self.d, self.regularization
        return finer, p

    # --- data

    def _read(self, path: str) -> Array:
        """Sets the data, their noise and notes from a file; x (m,) of its thermocouples."""
        given = self._given
        read = read_thermocouples(path, self.fin.L, given["columns"], given["units"], self.noise)
        if read.celsius:
            check_celsius("rod", given, ("ambient", "base", "tip"), path)
        self.measured = True
        self.d, self.noise, self.read_as = read.T - self.fin.T_inf, read.sigma, read.notes
        return read.x

    def _data(self) -> Array:
        if self.d is None:
            raise InputError(
                "rod: synthetic data are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(rod)"
            )
        return self.d

    def told_by_data(self, p: Array) -> tuple[Rod, float] | None:
        """The closed form that fits them best."""
        if not self.measured or self.fin.behind.size:
            return None
        each, given = self.unknowns.each, self._given
        sizes = self.fin.sizes([c.name for c in each], self.sizes, self.sensors.x, self._data())
        other = copy.copy(self)
        log = given["parametrization"] == "log"
        other.sizes = sizes
        other.unknowns = Unknowns.of([c.name for c in each], sizes, {c.name: c.parts for c in each}, log)
        other.parameters = other.unknowns.parameters(self.fin.L)
        ratios = [float(np.mean(c.value(p))) / sizes[c.name] for c in each]
        return other, max(max(r, 1.0 / r) if r > 0.0 else math.inf for r in ratios)

    def truth(self) -> Array | None:
        return self.unknowns.truth if self._given["data"] is None else None

    def twin(self) -> Rod | None:
        return self._with_data(np.zeros(len(self.sensors.x))) if self.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> Rod:
        rng = np.random.default_rng(self.seed if seed is None else seed)
        d = self.sensors.read(self.excess(u))
        return self._with_data(d + self.noise * rng.standard_normal(d.shape))

    def _with_data(self, d: Array) -> Rod:
        other = copy.copy(self)  # shares the mesh
        other.d = d
        return other

    def _update_notes(self) -> None:
        notes, names = [], {c.name for c in self.unknowns.each}
        error = self.sizes["film"] * self.fin.P * self.dx**2 / (12.0 * self.sizes["conductivity"] * self.fin.A)
        if error > COARSE:
            wanted = math.ceil(self.n * math.sqrt(error / COARSE))
            notes.append(f"{self.n} elements are coarse for this loss: temperatures err by {error:.1%} - n={wanted}")
        if not self.fin.reaches(self.sizes, float(self.sensors.x.min())):
            notes.append("no heat reaches the first thermocouple at this start: dJ/dp is 0 there, but at no minimum")
        if names == {"film", "conductivity"} and not self.heated:
            notes.append("without a flux, temperatures depend on film / conductivity alone: give flux=, or seek one")
        if self.d is not None and not self.heated:
            ends = np.concatenate([self.fin.before, self.fin.behind, [0.0]])
            low, high = ends.min(), ends.max()
            beyond = (self.d < low - 0.05 * (high - low)) | (self.d > high + 0.05 * (high - low))
            if beyond.any():
                where = f"{low + self.fin.T_inf:g} to {high + self.fin.T_inf:g} K"
                notes.append(
                    f"{beyond.sum()} of {len(self.d)} data lie beyond {where}, which no rod does - check units"
                )
        if self._given["data"] is not None:
            start = ", ".join(f"{name}={self.sizes[name]:.4g}" for name in sorted(names))
            notes, self.read_as = [], (*self.read_as, f"start: {start}", *notes)  # commands that invert show these
        self.notes = (*notes, *self.read_as)

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        values = np.concatenate([*self.unknowns.values(p).values()])
        assert self.parameters.position is not None
        return ParameterView({"x": self.parameters.position[:, 0], "value": values})
