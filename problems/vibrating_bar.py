"""The vibrating bar: N two-node elements of the bar with mass, fixed at x = 0, struck at x = L, marched in time.

M u'' + C u' + K(E) u + q(u_N) e_N = f(t),    M = rho A L_e diag(1, .., 1, 1/2),    C = c_M M + c_K K + c_G G, G skew

The state of a step is z_t = (u_t, v_t); all steps together are one problem R(U, p) = 0, U = (z_1, .., z_T), whose R_U
is block lower bidiagonal: every route solves it by a march, and its transpose by a march back. It is linear unless the
tip meets a stop, of force q.
"""

from __future__ import annotations

import copy
import math
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.contact import K_C, STOP_WIDTH, CompliantStop, RigidStop, Stop, make_stop
from gradient_routes.problems.data.every_step import EveryStep, read_histories_of_nodes
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.data.sensors import Nodes, parse_nodes
from gradient_routes.problems.data.units import standard_deviation
from gradient_routes.problems.dynamics.bar_impulses import ImpulsesByParameters, elongation, spread
from gradient_routes.problems.dynamics.bar_unknowns import UNIT_OF, BarUnknowns
from gradient_routes.problems.dynamics.both_sides import BothSides
from gradient_routes.problems.dynamics.scheme import SCHEMES, SchemeName, moved_on
from gradient_routes.problems.errors import DomainError, InputError, NotOffered, check_applies
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.matrices.step_matrix import Banded, StepMatrix
from gradient_routes.problems.problem import Array, Linearization, Offers, ParameterView, Traced
from gradient_routes.problems.rates import Rates
from gradient_routes.problems.transient import Transient

N_MAX, STEPS_MAX, STATE_MAX = 10**5, 10**6, 10**8
GAP = 0.2  # [m], half of what the tip moves by the pulse
Damping = Literal["none", "rayleigh", "skew"]
MovingStop = Literal["none", "penalty", "softplus", "quadratic"]


class VibratingBar(Transient):
    """A bar struck at its end, whose moduli are sought from histories of displacements: waveform inversion in 1-D.

    State (T 2 N,): displacements [m] and velocities [m/s] of nodes 1..N after every step. Parameters log E or E (N,)
    of every element, E in Pa. J = 1/2 sum_t |S u_t - d_t|^2 + alpha Phi. Synthetic data are those of the bar's stiff
    and soft moduli. The rows of R for u are multiplied by m/h, so that all of R is an impulse [N s].
    """

    name = "vibrating-bar"
    offers = Offers.LINEARIZE | Offers.TRACE | Offers.COMPLEX
    linear = constant = True
    from_rest = True
    typical = 0
    regularization: Prior
    stop: CompliantStop | None = None

    def __init__(
        self,
        *,
        n: Annotated[int, "number of elements N"] = 8,
        steps: Annotated[int, "of time, T"] = 60,
        dt: Annotated[float, "length h of a step [s]"] = 0.05,
        scheme: Annotated[SchemeName, "newmark: the trapezoidal rule; central-difference is explicit"] = "newmark",
        damping: Annotated[Damping, "rayleigh: C = c_M M + c_K K; skew: of no energy"] = "none",
        c_m: Annotated[float, "c_M of rayleigh [1/s]"] = 0.1,
        c_k: Annotated[float, "c_K of rayleigh [s]"] = 0.01,
        c_g: Annotated[float, "strength of skew damping, times M/s"] = 0.1,
        sensors: Annotated[Nodes | None, "5: nodes 1 to 5; 1,3,5 or 2..6: these [every second]"] = None,
        unknown: Annotated[
            str, "what p is: moduli, damping, velocity (of nodes at first), or some: moduli,damping"
        ] = "moduli",
        parametrization: Annotated[Literal["log", "raw"], "of moduli and damping: p = log E or p = E"] = "log",
        modulus: Annotated[float | None, "E of the start [Pa] [1; a file's bar has no default]"] = None,
        density: Annotated[float, "rho [kg/m3]"] = 1.0,
        length: Annotated[float, "L [m]"] = 1.0,
        area: Annotated[float, "cross-section A [m2]"] = 1.0,
        force: Annotated[float, "largest F at the end [N]"] = 1.0,
        pulse: Annotated[float, "duration of F, a sine squared [s]"] = 0.5,
        stop: Annotated[MovingStop, "beyond the tip, yielding by k_c"] = "none",
        stops: Annotated[Literal["front", "both"], "both: a second one, as far behind the tip"] = "front",
        gap: Annotated[float, "that the tip may move before it meets the stop [m]"] = GAP,
        k_c: Annotated[float, "stiffness of the stop [N/m]"] = K_C,
        width: Annotated[float, "over which softplus and quadratic round the kink of the penalty [m]"] = STOP_WIDTH,
        data: Annotated[str | None, "file of histories, columns t,node,displacement [synthetic]"] = None,
        columns: Annotated[str | None, "of the file, t:NAME,node:NAME,displacement:NAME [by its header]"] = None,
        units: Annotated[str | None, "of the file, such as ms,um [the header's, else s and m]"] = None,
        noise: Annotated[
            float | str | None, "standard deviation of a file's data, added to others [m], or 0.4um"
        ] = None,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi = 1/2 |D log E|^2"] = 0.0,
    ) -> None:
        check_applies(
            self.name,
            ("damping=rayleigh", damping == "rayleigh", True, {"c_m": c_m != 0.1, "c_k": c_k != 0.01}),
            ("damping=skew", damping == "skew", True, {"c_g": c_g != 0.1}),
            ("data=FILE", data is not None, True, {"columns": columns, "units": units}),
            ("data=FILE", data is not None, False, {"sensors": sensors, "seed": seed}),
            ("stop", stop != "none", True, {"stops": stops != "front"}),
            ("unknown=moduli", unknown == "moduli", True, {"alpha": alpha}),
        )
        if data is not None and modulus is None:
            raise InputError(f"vibrating-bar: data={data} - say where to start: modulus=E in Pa")
        E, sigma = 1.0 if modulus is None else modulus, standard_deviation(noise, data is not None, self.name)
        if not 1 <= n <= N_MAX or not 1 <= steps <= STEPS_MAX or 2 * n * steps > STATE_MAX:
            raise InputError(
                f"vibrating-bar: n={n},steps={steps} - choose 1 <= n <= {N_MAX}, 1 <= steps <= {STEPS_MAX}, and"
                f" 2 n steps <= {STATE_MAX:g}"
            )
        sizes = {"dt": dt, "modulus": E, "density": density, "length": length, "area": area, "pulse": pulse}
        for name, size in sizes.items():
            if not 0.0 < size < math.inf:
                raise InputError(f"vibrating-bar: {name}={size:g} - choose a finite {name} > 0")
        for name, size in {"force": force, "c_m": c_m, "c_k": c_k, "c_g": c_g}.items():
            if not math.isfinite(size) or (size < 0.0 and name != "force"):
                raise InputError(f"vibrating-bar: {name}={size:g} - choose a finite {name} >= 0")
        if seed < 0:
            raise InputError(f"vibrating-bar: seed={seed} - choose seed >= 0")
        made = make_stop(stop, gap, k_c, width, self.name, GAP)
        assert not isinstance(made, RigidStop)
        if made is not None and stops == "both":
            if gap <= 0.0:
                raise InputError(f"vibrating-bar: gap={gap:g} between two stops - choose gap > 0")
            made = replace(made, law=BothSides(made.law, gap))
        if made is not None:
            self.stop, self.linear, self.constant = made, False, False
        self.n, self.scheme = n, SCHEMES[scheme]
        self.L_e, self.A, self.density, self.seed = length / n, area, density, seed
        self.mass = np.full(n, density * area * self.L_e)  # (N,) [kg]
        self.mass[-1] /= 2.0
        self.force, self.pulse = force, pulse
        self._set_steps(steps, dt)
        if not self.F.any():
            raise InputError(
                f"vibrating-bar: force={force:g},pulse={pulse:g} acts at none of {steps} steps of dt={dt:g} and moves"
                " nothing - choose force != 0 and dt < pulse"
            )
        c = {"none": {}, "rayleigh": {"c_M": c_m, "c_K": c_k}, "skew": {"c_G": c_g}}[damping]
        self.node, self.x = (np.arange(n) + 1.0) * self.L_e, (np.arange(n) + 0.5) * self.L_e
        speed = abs(force) / (area * math.sqrt(E * density))  # of a node that is passed by a wave of this force
        self.unknowns = BarUnknowns.parse(
            unknown, self.name, c, log=parametrization == "log", E=E, x=self.x, node=self.node, speed=speed
        )
        self.parameters = self.unknowns.parameters()
        read = EveryStep(self.name, steps, 2 * n, dt, np.empty(0, int), lambda i: f"u_{i + 1}", sigma)
        if data is None:
            nodes = parse_nodes([*range(2 - n % 2, n + 1, 2)] if sensors is None else sensors, n, self.name)
            if not len(nodes):
                raise InputError("vibrating-bar: sensors=0 measure nothing - choose at least one node")
            self.readings = replace(read, at=nodes - 1)
        else:
            self.readings, self.read_as = read_histories_of_nodes(data, read, n, columns, units)
        self.measured = data is not None
        self.regularization = Prior(alpha)
        self.regularization.check(self.name)
        self._check_stable(self.stiffness(self.parameters.start))

    def _set_steps(self, steps: int, h: float) -> None:
        self.steps, self.h, self.n_state, self.row = steps, h, 2 * self.n * steps, self.mass[0] / h
        t = np.arange(steps + 1) * h
        self.F = self.force * np.where(t < self.pulse, np.sin(np.pi * t / self.pulse) ** 2, 0.0)  # (T + 1,) [N]
        self._kept: tuple[Array, tuple[StepMatrix, StepMatrix]] | None = None

    def halved(self) -> VibratingBar:
        other = self._with(self.readings.halved())
        other._set_steps(2 * self.steps, self.h / 2.0)
        return other

    # --- the equations

    def stiffness(self, p: Any, xp: Any = np) -> Any:
        """Spring constants D = E A / L_e, (N,) [N/m]."""
        return self.unknowns.moduli(p, xp) * (self.A / self.L_e)

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        return xp.concatenate([xp.zeros(self.n, dtype=p.dtype), self.unknowns.velocity(p, xp)])

    def initial_by(self, p: Array) -> Array | None:
        if "velocity" not in self.unknowns.kinds:
            return None
        by = np.zeros((2 * self.n, len(p)))
        by[self.n :, self.unknowns.slice("velocity")] = np.eye(self.n)
        return by

    def histories(self, states: Any) -> tuple[Any, Any]:
        """Displacements and velocities, (k, N) each, of states (k, 2 N)."""
        return states[:, : self.n], states[:, self.n :]

    def rows(self, t_0: int, states: Array, p: Array) -> Array:
        F = self.F[t_0 : t_0 + len(states)]
        return np.asarray(self.impulses(*self.histories(states), p, F).reshape(len(states) - 1, -1))

    def impulses(self, x: Any, v: Any, p: Any, F: Array, xp: Any = np) -> Any:
        """R (m, 2, N) of m steps from displacements, velocities (m + 1, N) and F (m + 1,) before and after them."""
        h, scheme, k = self.h, self.scheme, self.stiffness(p, xp)
        moved = self.row * (x[1:] - x[:-1] - h * scheme.velocity(v))
        driven = self.mass * (v[1:] - v[:-1]) + h * scheme.force(spread(k * elongation(x, xp), xp))
        for name, c in self.unknowns.damping(p, xp).items():
            driven = driven + h * c * scheme.damping(self._resistance(name, v, k, xp))
        pushed = -F if self.stop is None else self.stop.law.force(x[:, -1] - self.stop.gap, xp) - F
        driven = xp.concatenate([driven[:, :-1], driven[:, -1:] + h * scheme.force(pushed)[:, None]], axis=1)
        return xp.stack([moved, driven], axis=1)

    def _resistance(self, name: str, v: Any, k: Any, xp: Any = np) -> Any:
        """M v, K v or G v, (m, N), by which the coefficient of damping of this name is multiplied."""
        if name == "c_M":
            return self.mass * v
        if name == "c_K":
            return spread(k * elongation(v, xp), xp)
        end = xp.zeros_like(v[:, :1])
        return self.mass[0] * xp.concatenate([v[:, 1:], end], axis=1) - self.mass[0] * xp.concatenate(
            [end, v[:, :-1]], axis=1
        )

    def tangent(self, u: Array, p: Array) -> Recurrence:
        """Raises DomainError where an explicit step is too long for p."""
        A, B = self.step_matrices(p)
        if self.stop is None:
            return Recurrence((A,), (B,), self.steps)
        tips = np.append(0.0, u.reshape(self.steps, -1)[:, self.n - 1])
        new, old = ([self.pressed_matrix(M, tip) for tip in at] for M, at in ((A, tips[1:]), (B, tips[:-1])))
        return Recurrence(new, old, self.steps)

    def pressed_matrix(self, M: StepMatrix, tip: Any) -> StepMatrix:
        """A or B where the tip is at this displacement [m]."""
        if self.stop is None:
            return M
        weight = self.h * (self.scheme.of_force if M.a > 0.0 else 1.0 - self.scheme.of_force)
        main = M.K.main.astype(np.result_type(M.K.main, tip))
        main[-1] += weight * self.stop.law.stiffness(tip - self.stop.gap)
        return replace(M, K=replace(M.K, main=main))

    def step_matrices(self, p: Array) -> tuple[StepMatrix, StepMatrix]:
        """A and B of A z_t + B z_{t-1}, the same for all steps. Raises DomainError, see `tangent`."""
        if self._kept is None or not np.array_equal(self._kept[0], p):
            k, s = self.stiffness(p), self.scheme
            self._check_stable(k)
            c = self.unknowns.damping(p)
            new = self._step_matrix(k, c, 1.0, s.of_velocity, s.of_force, s.of_damping)
            old = self._step_matrix(k, c, -1.0, 1.0 - s.of_velocity, 1.0 - s.of_force, 1.0 - s.of_damping)
            self._kept = p.copy(), (new, old)
        return self._kept[1]

    def _step_matrix(
        self, k: Array, c: dict[str, Any], sign: float, of_velocity: float, of_force: float, of_damping: float
    ) -> StepMatrix:
        main, h = np.append(k[:-1] + k[1:], k[-1]), self.h
        w, (c_M, c_K, c_G) = h * of_force, (h * of_damping * c.get(name, 0.0) for name in UNIT_OF)
        K = Banded(-w * k[1:], w * main, -w * k[1:])
        skew = c_G * self.mass[0]
        D = Banded(-c_K * k[1:] - skew, c_K * main + (sign + c_M) * self.mass, -c_K * k[1:] + skew)
        return StepMatrix(sign * self.row, -self.row * h * of_velocity, K, D)

    # --- one step

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        F = xp.stack([xp.asarray(self.F)[t - 1], xp.asarray(self.F)[t]])
        return self.impulses(*self.histories(xp.stack([v, u])), p, F, xp).ravel()

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return self.readings.step_misfit(t, u, xp)

    def step_tangent(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self.pressed_matrix(self.step_matrices(p)[0], u[self.n - 1])

    def step_coupling(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self.pressed_matrix(self.step_matrices(p)[1], v[self.n - 1])

    def step_linearize(self, t: int, u: Array, v: Array, p: Array) -> Linearization:
        return self.rates(t - 1, np.stack([v, u]), p).single

    def step_initial(self, t: Any, v: Any, p: Any, xp: Any = np) -> Any:
        return moved_on(v, self.h, xp)

    def step_active_set(self, t: int, u: Array, p: Array) -> str | None:
        return None if self.stop is None else self.stop.law.active_set(u[self.n - 1] - self.stop.gap)

    def with_stop(self, stop: Stop) -> VibratingBar:
        """This bar with another stop but unchanged data."""
        if isinstance(stop, RigidStop):
            raise NotOffered("vibrating-bar: a rigid stop needs a multiplier, which its steps do not have")
        other = copy.copy(self)
        other.stop, other.linear, other.constant = stop, False, False
        return other

    def _check_stable(self, k: Array) -> None:
        """h <= 2 / omega_max for an explicit scheme, omega_max^2 bounded by the largest row sum of M^{-1} K."""
        if not self.scheme.explicit:
            return
        rows = (np.append(k[:-1] + k[1:], k[-1]) + np.append(0.0, k[1:]) + np.append(k[1:], 0.0)).real
        most = 2.0 / math.sqrt(float((rows / self.mass).max()))
        if self.h > most:
            raise DomainError(
                f"vibrating-bar: dt={self.h:g} is beyond {most:.3g}, up to which central differences are stable at this"
                " p - choose a smaller dt or another scheme"
            )

    def loads(self, t_0: int, k: int, p: Array) -> Array:
        b = np.zeros((k, self.n_step), p.dtype)
        b[:, -1] = self.h * self.scheme.force(self.F[t_0 : t_0 + k + 1])
        return b

    def rates(self, t_0: int, states: Array, p: Array) -> Rates:
        J, J_u = self.readings.step_misfits(t_0, states[1:])
        J_p = np.broadcast_to(np.zeros_like(p), (len(J), len(p)))
        R_p = self.by_parameters(*self.histories(states), p)
        return Rates(J, J_u, J_p, R_p.each_transposed, R_p)

    def by_parameters(self, x: Array, v: Array, p: Array) -> ImpulsesByParameters:
        """R_p of m steps, from displacements and velocities (m + 1, N) before and after them."""
        h, scheme, unknowns, by_p, c = (
            self.h,
            self.scheme,
            self.unknowns,
            self.unknowns.by_p(p),
            self.unknowns.damping(p),
        )
        w, resistances = None, []
        if "moduli" in unknowns.kinds:
            w = h * scheme.force(elongation(x, np))
            if "c_K" in c:
                w += h * c["c_K"] * scheme.damping(elongation(v, np))
            w *= by_p[unknowns.slice("moduli")] * (self.A / self.L_e)
        if "damping" in unknowns.kinds:
            k = self.stiffness(p)
            resistances = [
                h * by * scheme.damping(self._resistance(name, v, k))
                for name, by in zip(c, by_p[unknowns.slice("damping")], strict=True)
            ]
        return ImpulsesByParameters(w, resistances, len(p), (len(x) - 1, self.n))

    def phi(self, p: Any, xp: Any = np) -> Any:
        return self.regularization.value(xp, self.log_modulus(p, xp)) if self.alpha else 0.0

    def phi_by(self, p: Array) -> Array:
        known = self.prior(p)
        if not self.alpha or known is None:
            return np.zeros_like(p)
        prior, theta, by_p = known
        return np.asarray(prior.gradient(theta) * by_p)

    def log_modulus(self, p: Any, xp: Any = np) -> Any:
        return p if self.unknowns.log else xp.log(p)

    def traced(self) -> Traced:
        """Of all steps as arrays, which compiles faster than a step that is mapped."""
        from gradient_routes.problems.jax64 import jnp

        def residual(U: Any, p: Any) -> Any:
            states = jnp.concatenate([self.initial_state(p, jnp)[None], U.reshape(self.steps, -1)])
            return self.impulses(*self.histories(states), p, self.F, jnp).ravel()

        return Traced(residual, lambda U, p: self.readings.misfit(U, jnp) + self.phi(p, jnp))

    def energy(self, states: Array, p: Array) -> Array:
        """Kinetic energy, and that of elements and stops, (k,) [J], of real states (k, 2 N)."""
        x, v = self.histories(states)
        E = 0.5 * (self.stiffness(p) * elongation(x, np) ** 2).sum(axis=1) + 0.5 * (self.mass * v**2).sum(axis=1)
        return np.asarray(E if self.stop is None else E + self.stop.law.energy(x[:, -1] - self.stop.gap))

    def energy_growth(self, u: Array, p: Array) -> float | None:
        states, free = u.reshape(self.steps, -1), int(np.flatnonzero(self.F).max(initial=0))
        if free >= self.steps:
            return None
        E = self.energy(states[free:], p)
        return float(E.max() / E[0] - 1.0)

    # --- data

    def observation(self, u: Array, p: Array) -> Observation:
        return self.readings.observation(u)

    def candidates(self) -> Candidates:
        """The displacements of every node in every step."""
        return self.readings.candidates(np.arange(self.n), self.node[:, None])

    def prior(self, p: Array) -> tuple[Prior, Array, Array] | None:
        if self.unknowns.kinds != ("moduli",):
            return None
        return self.regularization, self.log_modulus(p), np.ones_like(p) if self.unknowns.log else 1.0 / p

    def truth(self) -> Array | None:
        return None if self.measured else self.unknowns.truth()

    def twin(self) -> VibratingBar | None:
        return self._with(self.readings.zeros()) if self.readings.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> VibratingBar:
        return self._with(self.readings.synthesized(u, self.seed if seed is None else seed))

    def _with(self, readings: EveryStep) -> VibratingBar:
        other = copy.copy(self)
        other.readings = readings
        return other

    def case(self) -> dict[str, Any]:
        untold = {
            "a stop": self.stop is not None,
            f"alpha={self.alpha:g}": self.alpha != 0.0,
            "damping": bool(self.unknowns.c),
            f"unknown={','.join(self.unknowns.kinds)}": self.unknowns.kinds != ("moduli",),
            "a file that lacks readings": self.readings.w is not None,
        }
        if any(untold.values()):
            what = next(what for what in untold if untold[what])
            raise NotOffered(f"vibrating-bar: {what} is not described to other codes - leave it out")
        return {
            "kind": "vibrating-bar",
            "scheme": self.scheme.name,
            "n": self.n,
            "steps": self.steps,
            "dt": self.h,
            "length": self.L_e * self.n,
            "area": self.A,
            "density": self.density,
            "force": self.F,
            "sensors": self.readings.at + 1,
            "data": self.readings.data,
            "parametrization": "log" if self.unknowns.log else "raw",
        }

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        shares = super().view(p, u, lam)
        if self.unknowns.kinds != ("moduli",):
            return shares
        return replace(shares, columns={"x": self.x, "E": self.unknowns.moduli(p), **shares.columns})
