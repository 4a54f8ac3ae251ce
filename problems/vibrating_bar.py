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

from gradient_routes.problems.bar import THETA_MAX, true_modulus
from gradient_routes.problems.contact import K_C, STOP_WIDTH, CompliantStop, RigidStop, Stop, make_stop
from gradient_routes.problems.data.observation import Candidates, Observation
from gradient_routes.problems.data.regularization import Prior
from gradient_routes.problems.data.sensors import Nodes, parse_nodes
from gradient_routes.problems.dynamics.scheme import SCHEMES, SchemeName
from gradient_routes.problems.errors import DomainError, InputError, NotOffered, check_applies
from gradient_routes.problems.matrices.by_products import ByProducts
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.matrices.step_matrix import Banded, StepMatrix
from gradient_routes.problems.problem import Array, Linearization, Offers, Parameters, ParameterView, Traced
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
        parametrization: Annotated[Literal["log", "raw"], "p = log E or p = E"] = "log",
        modulus: Annotated[float, "E of the start [Pa]"] = 1.0,
        density: Annotated[float, "rho [kg/m3]"] = 1.0,
        length: Annotated[float, "L [m]"] = 1.0,
        area: Annotated[float, "cross-section A [m2]"] = 1.0,
        force: Annotated[float, "largest F at the end [N]"] = 1.0,
        pulse: Annotated[float, "duration of F, a sine squared [s]"] = 0.5,
        stop: Annotated[MovingStop, "beyond the tip, yielding by k_c"] = "none",
        gap: Annotated[float, "that the tip may move before it meets the stop [m]"] = GAP,
        k_c: Annotated[float, "stiffness of the stop [N/m]"] = K_C,
        width: Annotated[float, "over which softplus and quadratic round the kink of the penalty [m]"] = STOP_WIDTH,
        noise: Annotated[float, "standard deviation added to data [m]"] = 0.0,
        seed: Annotated[int, "of that noise"] = 0,
        alpha: Annotated[float, "weight of Phi = 1/2 |D log E|^2"] = 0.0,
    ) -> None:
        check_applies(
            self.name,
            ("damping=rayleigh", damping == "rayleigh", True, {"c_m": c_m != 0.1, "c_k": c_k != 0.01}),
            ("damping=skew", damping == "skew", True, {"c_g": c_g != 0.1}),
        )
        if not 1 <= n <= N_MAX or not 1 <= steps <= STEPS_MAX or 2 * n * steps > STATE_MAX:
            raise InputError(
                f"vibrating-bar: n={n},steps={steps} - choose 1 <= n <= {N_MAX}, 1 <= steps <= {STEPS_MAX}, and"
                f" 2 n steps <= {STATE_MAX:g}"
            )
        sizes = {"dt": dt, "modulus": modulus, "density": density, "length": length, "area": area, "pulse": pulse}
        for name, size in sizes.items():
            if not 0.0 < size < math.inf:
                raise InputError(f"vibrating-bar: {name}={size:g} - choose a finite {name} > 0")
        for name, size in {"force": force, "c_m": c_m, "c_k": c_k, "c_g": c_g, "noise": noise}.items():
            if not math.isfinite(size) or (size < 0.0 and name != "force"):
                raise InputError(f"vibrating-bar: {name}={size:g} - choose a finite {name} >= 0")
        if seed < 0:
            raise InputError(f"vibrating-bar: seed={seed} - choose seed >= 0")
        made = make_stop(stop, gap, k_c, width, self.name, GAP)
        assert not isinstance(made, RigidStop)
        if made is not None:
            self.stop, self.linear, self.constant = made, False, False
        self.n, self.steps, self.h, self.scheme = n, steps, dt, SCHEMES[scheme]
        self.n_state = 2 * n * steps
        self.L_e, self.A, self.E_0 = length / n, area, modulus
        self.log, self.noise, self.seed = parametrization == "log", noise, seed
        self.c_M, self.c_K = (c_m, c_k) if damping == "rayleigh" else (0.0, 0.0)
        self.mass = np.full(n, density * area * self.L_e)  # (N,) [kg]
        self.mass[-1] /= 2.0
        self.row = self.mass[0] / dt
        self.skew = np.full(n - 1, c_g * self.mass[0] if damping == "skew" else 0.0)  # above the diagonal [kg/s]
        t = np.arange(steps + 1) * dt
        self.F = force * np.where(t < pulse, np.sin(np.pi * t / pulse) ** 2, 0.0)  # (T + 1,) [N]
        if not self.F.any():
            raise InputError(
                f"vibrating-bar: force={force:g},pulse={pulse:g} acts at none of {steps} steps of dt={dt:g} and moves"
                " nothing - choose force != 0 and dt < pulse"
            )
        self.nodes = parse_nodes([*range(2 - n % 2, n + 1, 2)] if sensors is None else sensors, n, self.name)
        if not len(self.nodes):
            raise InputError("vibrating-bar: sensors=0 measure nothing - choose at least one node")
        self.d: Array | None = None  # (T, m) [m]
        self._kept: tuple[Array, tuple[StepMatrix, StepMatrix]] | None = None
        self.x = (np.arange(n) + 0.5) * self.L_e
        self.regularization = Prior(alpha)
        self.regularization.check(self.name)
        self.parameters = Parameters(
            start=np.full(n, math.log(modulus) if self.log else modulus),
            scale=np.full(n, 1.0 if self.log else modulus),
            lower=-THETA_MAX if self.log else 0.0,
            upper=THETA_MAX if self.log else math.exp(THETA_MAX),
            unit="log Pa" if self.log else "Pa",
            label=(lambda e: f"log E_{e + 1}") if self.log else (lambda e: f"E_{e + 1}"),
            position=self.x[:, None],
        )
        self._check_stable(self.stiffness(self.parameters.start))

    # --- the equations

    def stiffness(self, p: Any, xp: Any = np) -> Any:
        """Spring constants D = E A / L_e, (N,) [N/m]."""
        return (xp.exp(p) if self.log else p) * (self.A / self.L_e)

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
        driven = self.mass * (v[1:] - v[:-1]) + h * scheme.force(_spread(k * _elongation(x, xp), xp))
        if self.c_K:
            driven = driven + h * self.c_K * scheme.damping(_spread(k * _elongation(v, xp), xp))
        if self.c_M:
            driven = driven + h * self.c_M * self.mass * scheme.damping(v)
        if self.skew.any():
            driven = driven + h * scheme.damping(self._gyroscopic(v, xp))
        pushed = -F if self.stop is None else self.stop.law.force(x[:, -1] - self.stop.gap, xp) - F
        driven = xp.concatenate([driven[:, :-1], driven[:, -1:] + h * scheme.force(pushed)[:, None]], axis=1)
        return xp.stack([moved, driven], axis=1)

    def _gyroscopic(self, v: Any, xp: Any) -> Any:
        """c_G G v, (m, N)."""
        end = xp.zeros_like(v[:, :1])
        ahead, behind = self.skew * v[:, 1:], self.skew * v[:, :-1]
        return xp.concatenate([ahead, end], axis=1) - xp.concatenate([end, behind], axis=1)

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
            new = self._step_matrix(k, 1.0, s.of_velocity, s.of_force, s.of_damping)
            old = self._step_matrix(k, -1.0, 1.0 - s.of_velocity, 1.0 - s.of_force, 1.0 - s.of_damping)
            self._kept = p.copy(), (new, old)
        return self._kept[1]

    def _step_matrix(self, k: Array, sign: float, of_velocity: float, of_force: float, of_damping: float) -> StepMatrix:
        main, h, c = np.append(k[:-1] + k[1:], k[-1]), self.h, self.h * of_damping
        w = h * of_force
        K = Banded(-w * k[1:], w * main, -w * k[1:])
        D = Banded(
            -c * (self.c_K * k[1:] + self.skew),
            c * self.c_K * main + (sign + c * self.c_M) * self.mass,
            -c * (self.c_K * k[1:] - self.skew),
        )
        return StepMatrix(sign * self.row, -self.row * h * of_velocity, K, D)

    # --- one step

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        F = xp.stack([xp.asarray(self.F)[t - 1], xp.asarray(self.F)[t]])
        return self.impulses(*self.histories(xp.stack([v, u])), p, F, xp).ravel()

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return 0.5 * xp.sum((u[self.nodes - 1] - xp.asarray(self.data())[t - 1]) ** 2)

    def step_tangent(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self.pressed_matrix(self.step_matrices(p)[0], u[self.n - 1])

    def step_coupling(self, t: int, u: Array, v: Array, p: Array) -> StepMatrix:
        return self.pressed_matrix(self.step_matrices(p)[1], v[self.n - 1])

    def step_linearize(self, t: int, u: Array, v: Array, p: Array) -> Linearization:
        rates = self.rates(t - 1, np.stack([v, u]), p)
        assert rates.R_p is not None
        return Linearization(rates.R_p, rates.J_u[0], rates.J_p[0])

    def step_initial(self, t: Any, v: Any, p: Any, xp: Any = np) -> Any:
        """Moved on by the velocity before the step: a state that leaves nothing in the rows of u."""
        x, velocity = v.reshape(2, -1)
        return xp.concatenate([x + self.h * velocity, velocity])

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
        J_u, off = np.zeros_like(states[1:]), states[1:, self.nodes - 1] - self.data()[t_0 : t_0 + len(states) - 1]
        J_u[:, self.nodes - 1] = off
        J_p = np.broadcast_to(np.zeros_like(p), (len(J_u), len(p)))
        R_p = self.by_modulus(*self.histories(states), p)
        return Rates(0.5 * (off**2).sum(axis=1), J_u, J_p, R_p.each_transposed, R_p)

    def by_modulus(self, x: Array, v: Array, p: Array) -> ImpulsesByStiffness:
        """R_p of m steps, from displacements and velocities (m + 1, N) before and after them."""
        w = self.h * self.scheme.force(_elongation(x, np))
        if self.c_K:
            w += self.h * self.c_K * self.scheme.damping(_elongation(v, np))
        return ImpulsesByStiffness(w * (self.stiffness(p) if self.log else self.A / self.L_e))

    def phi(self, p: Any, xp: Any = np) -> Any:
        return self.regularization.value(xp, self.log_modulus(p, xp)) if self.alpha else 0.0

    def phi_by(self, p: Array) -> Array:
        if not self.alpha:
            return np.zeros_like(p)
        by_theta = self.regularization.gradient(self.log_modulus(p))
        return by_theta if self.log else by_theta / p

    def log_modulus(self, p: Any, xp: Any = np) -> Any:
        return p if self.log else xp.log(p)

    def traced(self) -> Traced:
        """Of all steps as arrays, which compiles faster than a step that is mapped."""
        from gradient_routes.problems.jax64 import jnp

        def residual(U: Any, p: Any) -> Any:
            states = jnp.concatenate([jnp.zeros((1, self.n_step)), U.reshape(self.steps, -1)])
            return self.impulses(*self.histories(states), p, self.F, jnp).ravel()

        def objective(U: Any, p: Any) -> Any:
            return 0.5 * jnp.sum((self._read(U, jnp) - self.data()) ** 2) + self.phi(p, jnp)

        return Traced(residual, objective)

    # --- data

    def _read(self, u: Any, xp: Any = np) -> Any:
        """Displacements at the sensors, (T, m) [m]."""
        return xp.reshape(u, (self.steps, 2, self.n))[:, 0, self.nodes - 1]

    def observation(self, u: Array, p: Array) -> Observation:
        from scipy import sparse

        at = (2 * np.arange(self.steps)[:, None] * self.n + self.nodes - 1).ravel()
        S = sparse.csr_array((np.ones(len(at)), (np.arange(len(at)), at)), shape=(len(at), self.n_state))
        m, d = len(self.nodes), self.data()
        label = lambda k: f"u_{self.nodes[k % m]} at {(k // m + 1) * self.h:.3g} s"  # noqa: E731
        return Observation(self._read(u).ravel(), d.ravel(), S, sigma=self.noise, label=label)

    def candidates(self) -> Candidates:
        """The displacements of every node in every step."""
        t, i = np.divmod(np.arange(self.steps * self.n), self.n)
        label = lambda k: f"u_{i[k] + 1} at {(t[k] + 1) * self.h:.3g} s"  # noqa: E731
        return Candidates(2 * t * self.n + i, label, ((i + 1) * self.L_e)[:, None])

    def prior(self, p: Array) -> tuple[Prior, Array, Array]:
        return self.regularization, self.log_modulus(p), np.ones_like(p) if self.log else 1.0 / p

    def data(self) -> Array:
        """d (T, m) [m]. Raises InputError where synthetic data are not made yet."""
        if self.d is None:
            raise InputError(
                "vibrating-bar: synthetic data are not made yet - solve for them:"
                " gradient_routes.routes.synthetic_data.with_synthetic_data(bar)"
            )
        return self.d

    def truth(self) -> Array:
        E = self.E_0 * true_modulus(self.x / (self.n * self.L_e))
        return np.asarray(np.log(E) if self.log else E)

    def twin(self) -> VibratingBar | None:
        return self._with_data(np.zeros((self.steps, len(self.nodes)))) if self.d is None else None

    def observed(self, u: Array, seed: int | None = None) -> VibratingBar:
        rng = np.random.default_rng(self.seed if seed is None else seed)
        d = self._read(u)
        return self._with_data(d + self.noise * rng.standard_normal(d.shape))

    def _with_data(self, d: Array) -> VibratingBar:
        other = copy.copy(self)
        other.d = d
        return other

    def view(self, p: Array, u: Array, lam: Array | None) -> ParameterView:
        return ParameterView({"x": self.x, "E": self.stiffness(p) * self.L_e / self.A})


class ImpulsesByStiffness:
    """R_p of k steps, (k 2 N, N): column e the impulses [N s] of element e, stretched by w (k, N)."""

    def __init__(self, w: Array) -> None:
        self.w = w

    @property
    def T(self) -> ByProducts:
        return ByProducts(lambda lam: self.each_transposed(lam.reshape(len(self.w), -1)).sum(axis=0), self.__matmul__)

    def __matmul__(self, dp: Array) -> Array:
        driven = _spread(self.w * dp, np)
        return np.concatenate([np.zeros_like(driven), driven], axis=1).ravel()

    def each_transposed(self, lam: Array) -> Array:
        return np.asarray(self.w * _elongation(lam[:, self.w.shape[1] :], np))


def _elongation(x: Any, xp: Any) -> Any:
    """B x of every row, (.., N)."""
    return xp.concatenate([x[:, :1], x[:, 1:] - x[:, :-1]], axis=1)


def _spread(q: Any, xp: Any) -> Any:
    """B^T q of every row, (.., N)."""
    return xp.concatenate([q[:, :-1] - q[:, 1:], q[:, -1:]], axis=1)
