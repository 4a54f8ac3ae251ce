"""One step in time of the vibrating bar, as a problem of its own."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gradient_routes.problems.matrices.step_matrix import StepMatrix
from gradient_routes.problems.problem import Array, Linearization, Offers, Problem
from gradient_routes.problems.transient import Beside

if TYPE_CHECKING:
    from gradient_routes.problems.vibrating_bar import VibratingBar


class BarStep(Problem):
    """R_t(z, q) = 0, z = (u, v) (2 N,) after step t, q = (z before it, p) (3 N,); J_t, the last with alpha Phi."""

    offers = Offers.LINEARIZE | Offers.COMPLEX

    def __init__(self, bar: VibratingBar, t: int) -> None:
        self.bar, self.t, self.n_state = bar, t, 2 * bar.n
        self.name = f"{bar.name}, step {t}"
        self.last, self.linear = t == bar.steps, bar.linear
        start, scale = np.zeros(2 * bar.n), np.ones(2 * bar.n)
        q = bar.parameters
        lower, upper = (np.broadcast_to(bound, q.start.shape) for bound in (q.lower, q.upper))
        self.parameters = replace(
            q,
            start=np.concatenate([start, q.start]),
            scale=np.concatenate([scale, q.scale]),
            lower=np.concatenate([start - np.inf, lower]),
            upper=np.concatenate([start + np.inf, upper]),
            label=lambda i: f"z_{i + 1}" if i < 2 * bar.n else q.label(i - 2 * bar.n),
            unit="1",
            position=None,
        )

    def _split(self, q: Array) -> tuple[Array, Array]:
        return q[: self.n_state], q[self.n_state :]

    def _histories(self, z: Array, before: Array) -> Array:
        """Displacements and velocities (2, 2, N) before and after the step."""
        return np.stack([before, z]).reshape(2, 2, -1)

    def initial(self, p: Array) -> Array:
        """Moved on by the velocity before the step: a state that leaves nothing in the rows of u."""
        u, v = p[: self.n_state].reshape(2, -1)
        return np.concatenate([u + self.bar.h * v, v])

    def residual(self, u: Array, p: Array) -> Array:
        before, modulus = self._split(p)
        both = self._histories(u, before)
        return np.asarray(self.bar.rows(both[:, 0], both[:, 1], modulus, self.bar.F[self.t - 1 : self.t + 1]).ravel())

    def tangent(self, u: Array, p: Array) -> StepMatrix:
        return self.bar.pressed_matrix(self.bar.step_matrices(self._split(p)[1])[0], u[self.bar.n - 1])

    def active_set(self, u: Array, p: Array) -> str | None:
        return None if self.bar.stop is None else self.bar.stop.law.active_set(u[self.bar.n - 1] - self.bar.stop.gap)

    def objective(self, u: Array, p: Array) -> Any:
        bar, modulus = self.bar, self._split(p)[1]
        J = 0.5 * np.sum((u[bar.nodes - 1] - bar.data()[self.t - 1]) ** 2)
        return J + bar.regularization.value(np, bar.log_modulus(modulus)) if self.last and bar.alpha else J

    def linearize(self, u: Array, p: Array) -> Linearization:
        bar, (before, modulus) = self.bar, self._split(p)
        both = self._histories(u, before)
        J_u = np.zeros_like(u)
        J_u[bar.nodes - 1] = u[bar.nodes - 1] - bar.data()[self.t - 1]
        J_p = bar.by_prior(modulus) if self.last else np.zeros_like(modulus)
        R_v = bar.pressed_matrix(bar.step_matrices(modulus)[1], before[bar.n - 1])
        R_q = Beside(R_v, bar.by_modulus(both[:, 0], both[:, 1], modulus), self.n_state)
        return Linearization(R_q, J_u, np.concatenate([np.zeros_like(before), J_p]))
