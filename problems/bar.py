"""The bar: N two-node elements, fixed at x = 0, loaded along its length and at x = L, with one modulus per element.

K(E) u = f,    k_e = E_e A / L_e [[1, -1], [-1, 1]],    f_i = q L_e (node N: F + q L_e/2),    K = B^T diag(E A / L_e) B

An optional stop beyond the tip (problems/contact.py) makes the problem nonlinear and nonsmooth.
"""

from __future__ import annotations

import math
from copy import copy
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.contact import GAP, K_C, STOP_WIDTH, Stop, StopName, make_stop
from gradient_routes.problems.data.observation import Candidates, Observation, selection
from gradient_routes.problems.data.regularization import PHI_WIDTH, FieldPhi, Prior
from gradient_routes.problems.data.sensors import Nodes, Sensors, parse_nodes, read_sensors
from gradient_routes.problems.data.units import Kind, quantity, standard_deviation
from gradient_routes.problems.errors import InputError, NotOffered, check_applies
from gradient_routes.problems.matrices.tridiagonal import (
    BorderedTridiagonal,
    ElementForces,
    Tridiagonal,
    cumulative_sum,
    difference,
    divergence,
)
from gradient_routes.problems.problem import (
    Array,
    Linearization,
    Offers,
    Parameters,
    ParameterView,
    Problem,
    Reference,
    Traced,
)

THETA_MAX = 170.0  # E = exp(theta) < 1e74: E^2 and E^3 in J and dJ/dE stay in float64's range
N_MAX = 10**7  # a gradient takes 1 GB
LEAST, MOST = 1e-30, 1e30  # of lengths, areas, loads and the start of E


def true_modulus(x: Array) -> Array:
    """The modulus [E_0] at x [L] that synthetic data are computed from: a smooth field with a soft inclusion at 0.35.

    It differs from the start E_0 near the clamp, where the misfit would otherwise be all rounding.
    """
    return (1.3 + 0.2 * np.sin(2.0 * np.pi * x)) * (1.0 - 0.5 * np.exp(-(((x - 0.35) / 0.1) ** 2)))


class Bar(Problem):
    """A bar whose moduli are sought from displacements: the smallest problem with a blind spot.

    State u (N,) [m], displacements of nodes 1..N, followed by the contact force [N] if stop=multiplier. Parameters
    theta = log E or E (N,), E in Pa. Elements behind the last sensor do not influence the data: their data gradient is
    exactly 0 unless the tip touches the stop. Synthetic data are computed with the stop.
    Strains are differences of displacements, so with sensors far from the clamp the gradient has a relative error of
    eps N instead of eps: 4e-11 at N = 10^6 with a sensor at every node, 1e-16 with five next to the clamp.
    """

    name = "bar"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    linear = True
    regularization: Prior

    def __init__(
        self,
        *,
        n: Annotated[int, "number of elements N"] = 8,
        sensors: Annotated[Nodes | None, "5: nodes 1 to 5; 1,3,5 or 2..6 or 5..5: these; 0: none [the first 5]"] = None,
        parametrization: Annotated[Literal["log", "raw"], "p = log E or p = E"] = "log",
        modulus: Annotated[
            float | None, "E of the start [Pa]; synthetic data: of 0.7 to 1.5 E [1; fitted to a file]"
        ] = None,
        length: Annotated[float | str, "L [m], or 250mm"] = 1.0,
        area: Annotated[float, "cross-section A [m2]"] = 1.0,
        force: Annotated[float | str, "F at the end [N], or 5kN"] = 1.0,
        distributed: Annotated[float, "load q along the bar [N/m]"] = 0.0,
        data: Annotated[str | None, "file of measurements, columns node,displacement [synthetic]"] = None,
        columns: Annotated[str | None, "of the file, node:NAME,displacement:NAME [by its header]"] = None,
        units: Annotated[str | None, "of the file's displacement, such as mm [the header's, else m]"] = None,
        noise: Annotated[
            float | str | None, "standard deviation of a file's data, added to others [m], or 0.4um"
        ] = None,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi"] = 0.0,
        phi: Annotated[FieldPhi, "1/2 |D log E|^2, D between neighbours, or total variation of log E"] = "tikhonov",
        phi_width: Annotated[float, "jump of log E below which total variation is rounded"] = PHI_WIDTH,
        stop: Annotated[StopName, "beyond the tip; multiplier: rigid, the others yield by k_c"] = "none",
        gap: Annotated[float, "that the tip may move before it meets the stop [m]"] = GAP,
        k_c: Annotated[float, "stiffness of a stop that yields [N/m]"] = K_C,
        width: Annotated[float, "over which softplus and quadratic round the kink of the penalty [m]"] = STOP_WIDTH,
    ) -> None:
        if not 1 <= n <= N_MAX:
            raise InputError(f"bar: n={n} elements - choose n >= 1 and <= {N_MAX}")
        check_applies("bar", ("phi=tv", phi == "tv", True, {"phi_width": phi_width != PHI_WIDTH}))
        self.regularization = Prior(alpha, phi, phi_width)
        self.regularization.check("bar")
        self.E_0 = E = 1.0 if modulus is None else _size("modulus", modulus)
        check_applies("bar", ("data=FILE", data is not None, True, {"columns": columns, "units": units}))
        sigma = standard_deviation(noise, data is not None, "bar")
        if seed < 0:
            raise InputError(f"bar: seed={seed} - choose seed >= 0")
        self.L, self.A = _size("length", length, "length"), _size("area", area)
        self.F, self.q = _load("force", force, "force"), _load("distributed", distributed)
        if self.F == self.q == 0.0:
            raise InputError("bar: force=0 and distributed=0 move nothing - give one of them")
        self.n, self.n_state, self.structure = n, n, "spd"
        self._set_stop(make_stop(stop, gap, k_c, width, "bar"))
        self.log = parametrization == "log"
        self.L_e = self.L / n
        self.f = np.full(n, self.q * self.L_e)  # [N]
        self.f[-1] = self.F + self.q * self.L_e / 2.0
        self.x = (np.arange(n) + 0.5) * self.L_e  # element centres [m]
        self.synthetic, self.noise = data is None, sigma
        if data is not None:
            measured = read_sensors(data, n, sensors, "bar", columns, units, sigma)
            self.sensors, self.noise, self.read_as = measured.sensors, measured.sigma, measured.notes
        else:
            nodes = parse_nodes(min(5, n) if sensors is None else sensors, n, "bar")
            N, s, _ = self._axial_forces(E * true_modulus(self.x / self.L))
            d = cumulative_sum(s * N)[nodes - 1]
            self.sensors = Sensors(nodes, d + sigma * np.random.default_rng(seed).standard_normal(len(nodes)))
        self.measured = data is not None
        self.start_from_data = data is not None and modulus is None
        self.parameters = Parameters(
            start=np.full(n, math.log(E) if self.log else E),
            scale=np.full(n, 1.0 if self.log else E),
            lower=-THETA_MAX if self.log else 0.0,
            upper=THETA_MAX if self.log else math.exp(THETA_MAX),
            unit="log Pa" if self.log else "Pa",
            label=(lambda e: f"log E_{e + 1}") if self.log else (lambda e: f"E_{e + 1}"),
            position=self.x[:, None],
        )
        self._update_notes()

    def _update_notes(self) -> None:
        """Recomputes last_sensor and notes after the sensors or the stop have changed."""
        self.last_sensor = int(self.sensors.nodes.max(initial=0))
        self.typical = min(3, self.last_sensor) - 1 if self.last_sensor else None  # loaded elements on both sides of it
        self.notes = self._notes()

    def _set_stop(self, stop: Stop | None) -> None:
        self.stop = stop
        if stop is not None:
            self.n_state, self.structure = self.n + stop.n_multipliers, stop.structure
            self.linear, self.line_search = False, False  # q is convex: full Newton steps converge monotonically

    def with_stop(self, stop: Stop) -> Bar:
        """This bar with another stop but unchanged data."""
        other = copy(self)
        other._set_stop(stop)
        other.notes = other._notes()
        return other

    def scaled(self, p: Array, factor: float) -> Array:
        return p + math.log(factor) if self.log else factor * p

    def stiffened(self, factor: float) -> Bar:
        other, q = copy(self), self.parameters
        scale = q.scale if self.log else factor * q.scale
        other.parameters = replace(q, start=self.scaled(q.start, factor), scale=scale)
        return other

    def tip(self, u: Array) -> float:
        """u_N [m]."""
        return float(u[self.n - 1])

    def refined(self, p: Array) -> tuple[Bar, Array] | None:
        """Every element split in two, the same data at the same points; None if too many elements."""
        if 2 * self.n > N_MAX:
            return None
        finer = Bar(
            n=2 * self.n, sensors=0, parametrization="log" if self.log else "raw", alpha=self.alpha,
            modulus=self.E_0, length=self.L, area=self.A, force=self.F, distributed=self.q,
        )  # fmt: skip
        finer.regularization = self.regularization
        finer.sensors, finer.synthetic = Sensors(2 * self.sensors.nodes, self.sensors.d), self.synthetic
        finer._set_stop(self.stop)
        finer._update_notes()
        return finer, np.repeat(p, 2)

    def _notes(self) -> tuple[str, ...]:
        n_blind, stop = self.n - self.last_sensor, self.stop
        blind = "blind" if stop is None else "blind unless the tip touches the stop"
        if stop is not None and not stop.vanishes_when_open:
            blind = "seen through the force of the stop alone, which is never quite 0"
        notes = [f"{n_blind} of {self.n} elements lie behind the last sensor: {blind}"] if n_blind else []
        if n_blind == self.n:
            notes = ["no sensors: J has no data term, its data gradient is exactly 0"]
        if stop is not None and stop.gap < 0:
            notes += [f"gap={stop.gap:g} < 0: the stop presses on the tip of the unloaded bar"]
        return (*notes, *self.read_as)

    def _axial_forces(self, E: Array) -> tuple[Array, Array, Any]:
        """N (n,) [N] of the elements, in equilibrium with the stop; compliances s = L_e / (A E), (n,) [m/N]; kappa.

        N_e = T + q (L - x_e), with T = F less the force of the stop, which meets a bar of compliance C = sum s.
        """
        s, G = self.L_e / (self.A * E), self.q * (self.L - self.x)
        if self.stop is None:
            return self.F + G, s, 0.0
        F, gap, C, u_G = self.F, self.stop.gap, cumulative_sum(s)[-1], cumulative_sum(s * G)[-1]
        g, q, kappa = self.stop.equilibrium(F * C + u_G - gap, C)
        moved = g + gap - u_G  # T C: choose the formula of T with less cancellation
        balance = (abs(F) + q) * abs(moved) <= (abs(g) + abs(gap) + abs(u_G)) * abs(F - q)
        return (F - q if balance else moved / C) + G, s, kappa

    def modulus(self, p: Any, xp: Any = np) -> Any:
        """E(p), (N,) [Pa]."""
        return xp.exp(p) if self.log else p

    def log_modulus(self, p: Any, xp: Any = np) -> Any:
        return p if self.log else xp.log(p)

    def stiffness(self, p: Any, xp: Any = np) -> Any:
        """Spring constants D = E A / L_e, (N,) [N/m]."""
        return self.modulus(p, xp) * (self.A / self.L_e)

    def residual(self, u: Any, p: Any, xp: Any = np) -> Any:
        """R = B^T D B u - f, (N,) [N], plus the contribution of the stop."""
        R = divergence(self.stiffness(p, xp) * difference(u[: self.n], xp), xp) - xp.asarray(self.f)
        return R if self.stop is None else self.stop.residual(R, u, xp)

    def tangent(self, u: Array, p: Array) -> Tridiagonal | BorderedTridiagonal:
        D = self.stiffness(p)
        return Tridiagonal(D) if self.stop is None else self.stop.tangent(D, u)

    def active_set(self, u: Array, p: Array) -> str | None:
        """open or closed if the contact force has a kink, else None."""
        return None if self.stop is None else self.stop.active_set(u)

    def objective(self, u: Any, p: Any, xp: Any = np) -> Any:
        """J = 1/2 |S u - d|^2 + alpha Phi [m^2]."""
        J = self.sensors.misfit(xp, u)
        return J + self.regularization.value(xp, self.log_modulus(p, xp)) if self.alpha else J

    def linearize(self, u: Array, p: Array) -> Linearization:
        """R_p = B^T diag(dD/dp B u), J_u = S^T (S u - d), J_p = alpha Phi'."""
        dD_dp = self.stiffness(p) if self.log else np.full_like(p, self.A / self.L_e)
        J_p = np.zeros_like(p)
        if self.alpha:
            by_theta = self.regularization.gradient(self.log_modulus(p))
            J_p = by_theta if self.log else by_theta / p
        R_p = ElementForces(dD_dp * difference(u[: self.n]), zero_rows=self.n_state - self.n)
        return Linearization(R_p, self.sensors.misfit_gradient(u), J_p)

    def integral(self, u: Array, p: Array) -> tuple[float, Array] | None:
        """1/(2 h) of the integral of the squared misfit between the first and the last sensor, and alpha Phi.

        The misfit is interpolated linearly between sensors, h is their mean distance; J is a quadrature of it.
        """
        integral = self.sensors.integral(u)
        if integral is None:
            return None
        value, by_u = integral
        return float(value + self.regularization.value(np, self.log_modulus(p))), by_u

    def observation(self, u: Array, p: Array) -> Observation:
        at, d, nodes = self.sensors.nodes - 1, self.sensors.d, self.sensors.nodes
        S_u, x = selection(at, self.n_state), (nodes * self.L_e)[:, None]
        return Observation(u[at], d, S_u, sigma=self.noise, label=lambda k: f"u_{nodes[k]}", position=x)

    def candidates(self) -> Candidates:
        """The displacement of every node, without the contact force."""
        nodes = np.arange(1, self.n + 1)
        return Candidates(nodes - 1, lambda j: f"u_{nodes[j]}", (nodes * self.L_e)[:, None])

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, self.log_modulus(p), np.ones_like(p) if self.log else 1.0 / p

    def traced(self) -> Traced:
        from gradient_routes.problems.jax64 import jnp

        physics = Traced(lambda u, p: self.residual(u, p, jnp), lambda u, p: self.objective(u, p, jnp))
        if not self.linear:
            return physics
        return replace(
            physics,
            diagonal=lambda p: self._diagonal(self.stiffness(p, jnp), jnp),
            spectral_bound=lambda p: self._spectral_bound(self.stiffness(p, jnp), jnp),
        )

    @staticmethod
    def _diagonal(D: Any, xp: Any) -> Any:
        return xp.concatenate([D[:-1] + D[1:], D[-1:]])

    @classmethod
    def _spectral_bound(cls, D: Any, xp: Any, q: float = 16.0) -> Any:
        """Gershgorin's bound max_i 2 K_ii, smoothed by the q-norm to remain differentiable."""
        rows = 2.0 * cls._diagonal(D, xp)
        largest = xp.max(rows)
        return largest * xp.sum((rows / largest) ** q) ** (1.0 / q)

    def reference(self, p: Array) -> Reference:
        """Closed form: u_k = sum_{e <= k} s_e N_e with the compliances s_e = L_e / (A E_e) and the axial forces N_e in
        equilibrium with the stop, dN_i/ds_e = -kappa N_e for all i. With S_k = sum_{e <= k} s_e and r = u - d,

        dJ/dE_e = - s_e N_e / E_e (sum_{sensors k >= e} r_k - kappa sum_{sensors k} r_k S_k) + alpha dPhi/dE_e

        Summed in extended precision where the platform has it (x86).
        """
        E = self.modulus(p.astype(np.longdouble))
        N, s, kappa = self._axial_forces(E)
        S, u = np.cumsum(s), np.cumsum(s * N)
        at, d = self.sensors.nodes - 1, self.sensors.d
        r, size = np.zeros((2, self.n), np.longdouble)
        r[at], size[at] = u[at] - d, abs(u[at]) + abs(d)
        seen_r, seen_size = np.cumsum(r[::-1])[::-1], np.cumsum(size[::-1])[::-1]
        by_prior = self.regularization.gradient(np.log(E))
        dJ_dtheta = -s * N * (seen_r - kappa * (r @ S)) + by_prior
        chain_rule = 1.0 if self.log else 1.0 / E
        terms = (s * abs(N) * (seen_size + abs(kappa) * (size @ S)) + abs(by_prior)) * chain_rule
        return Reference("closed form", np.asarray(dJ_dtheta * chain_rule, float), float(np.sqrt(np.sum(terms**2))))

    def truth(self) -> Array | None:
        if not self.synthetic:
            return None
        E = self.E_0 * true_modulus(self.x / self.L)
        return np.log(E) if self.log else E

    def case(self) -> dict[str, Any]:
        if self.stop is not None or self.alpha or self.q:
            what = "a stop" if self.stop else f"alpha={self.alpha:g}" if self.alpha else f"distributed={self.q:g}"
            raise NotOffered(f"bar: {what} is not described to other codes - leave it out")
        return {
            "kind": "bar",
            "n": self.n,
            "length": self.L,
            "area": self.A,
            "load": self.F,
            "sensors": self.sensors.nodes,
            "data": self.sensors.d,
            "parametrization": "log" if self.log else "raw",
        }

    def condition(self, p: Array) -> float:
        """Condition number for equal springs (eigenvalues 4 k sin^2((2 j - 1) pi / (4 N + 2))) times the contrast of E.

        The stop is neglected: it adds one eigenvalue, hence one iteration.
        """
        D = self.stiffness(p)
        return float(D.max() / D.min()) / math.sin(math.pi / (4 * self.n + 2)) ** 2

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        """Strain and, with lam, adjoint strain: dJ/dE_e = A L_e eps_e[u] eps_e[lam] (data term)."""
        eps = difference(u[: self.n]) / self.L_e
        columns = {"x": self.x, "E": self.modulus(p), "eps[u]": eps}
        if lam is not None:
            eps_lam = difference(lam[: self.n]) / self.L_e
            columns |= {"eps[lam]": eps_lam, "A L_e eps eps": self.A * self.L_e * eps * eps_lam}
        mark = "blind, alpha Phi only" if self.alpha else "blind"
        behind = np.arange(self.n) >= self.last_sensor
        in_contact = self.stop is not None and self.stop.in_contact(u)
        return ParameterView(columns, behind & (not in_contact), mark)


def _size(name: str, value: float | str, kind: Kind = "number") -> float:
    size = quantity(value, kind, f"bar: {name}={value}")
    if not LEAST <= size <= MOST:
        raise InputError(f"bar: {name}={value} - choose one from {LEAST:g} to {MOST:g}")
    return size


def _load(name: str, value: float | str, kind: Kind = "number") -> float:
    load = quantity(value, kind, f"bar: {name}={value}")
    if load and not LEAST <= abs(load) <= MOST:
        raise InputError(f"bar: {name}={value} - choose one of a size from {LEAST:g} to {MOST:g}")
    return load
