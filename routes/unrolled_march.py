"""Unrolled AD of a march in time: Newton's steps of every step on a tape, k of them in each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Array
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton_steps import Step
from gradient_routes.routes.route import Result


@dataclass(frozen=True)
class TapedStep:
    """Step t in time: u_{t-1} before it, Newton's steps in it."""

    t: int
    before: Array
    newton: list[Step]

    @property
    def nbytes(self) -> int:
        return int(self.before.nbytes + sum(s.u.nbytes + s.du.nbytes + s.factors.nbytes for s in self.newton))


class UnrolledMarch:
    """J(u_1, .., u_T) and dJ/dp, every u_t being the k-th Newton iterate from its prediction.

    The tape holds the steps of one interval: of all, or of `checkpoint` of them, and the states where others begin. One
    Newton step is u' = u - a du, R_u du = R with du held in the pullback of R - R_u du, see `UnrolledNewton`; R depends
    on u_{t-1}, too.
    """

    def __init__(self, model: Model, k: int, checkpoint: int | None) -> None:
        assert isinstance(model.problem, Transient)
        self.model, self.problem, self.k = model, model.problem, k
        self.interval = checkpoint or self.problem.steps
        R, J, u_0 = self.problem.step_residual, self.problem.step_objective, self.problem.step_initial
        start = self.problem.initial_state

        def linearized(t: Any, u: Any, v: Any, p: Any, du: Any) -> Any:
            """R(u, v, p) - R_u du."""
            value, along = jax.jvp(lambda u: R(t, u, v, p, jnp), (u,), (du,))
            return value - along

        # t is an argument: one compilation serves all steps
        self._newton = jax.jit(
            lambda t, u, v, p, du, w: jax.vjp(lambda u, v, p: linearized(t, u, v, p, du), u, v, p)[1](w)
        )
        self._predicted = jax.jit(lambda t, v, p, u_bar: jax.vjp(lambda v, p: u_0(t, v, p, jnp), v, p)[1](u_bar))
        self._objective = jax.jit(jax.value_and_grad(lambda u, p, t: J(t, u, p, jnp), (0, 1)))
        self._phi = jax.jit(jax.value_and_grad(lambda p: self.problem.phi(p, jnp) + 0.0 * p.sum()))
        self._start = jax.jit(lambda p, u_bar: jax.vjp(lambda p: start(p, jnp), p)[1](u_bar)[0])

    def __call__(self, p: Array) -> Result:
        model, steps = self.model, self.problem.steps
        u, kept, left, scale = self.problem.initial_state(p), [], 0.0, model.march_scale(p)
        model.tally.count("forward_solves")
        begins = range(0, steps, self.interval)
        tape: list[TapedStep] = []
        for begin in begins:
            kept.append(u)
            tape, u, missed = self._taped(begin, u, p, scale)
            left = max(left, missed)
        held = sum(state.nbytes for state in kept) + sum(step.nbytes for step in tape)
        J, gradient = self._phi(p)
        mu, states = np.zeros_like(u), [u]
        for begin, start in zip(reversed(begins), reversed(kept), strict=True):
            for step in reversed(tape if begin == begins[-1] else self._taped(begin, start, p, scale)[0]):
                J_t, mu, by_p = self._back(step, u, mu, p)
                J, gradient, u = J + J_t, gradient + by_p, step.before
                states.append(u)
        gradient = gradient + self._start(p, mu)
        U = np.concatenate(states[-2::-1])
        return Result(float(J), np.asarray(gradient), U, left / (scale or 1.0), tape=held)

    def _taped(self, begin: int, u: Array, p: Array, scale: float) -> tuple[list[TapedStep], Array, float]:
        """The tape of an interval from u = u_begin, the state after it and the largest |R|_inf."""
        tape, left = [], 0.0
        for t in range(begin + 1, min(begin + self.interval, self.problem.steps) + 1):
            newton, missed = self.model.march_iterates(t, u, p, scale, self.k)
            tape.append(TapedStep(t, u, newton))
            u, left = newton[-1].after, max(left, missed)
        self.model.tally.count("steps", len(tape))
        return tape, u, left

    def _back(self, step: TapedStep, u: Array, mu: Array, p: Array) -> tuple[Any, Array, Array]:
        """J_t, and what the step adds to the derivatives by u_{t-1} and p."""
        t, v = step.t, step.before
        J_t, (J_u, p_bar) = self._objective(u, p, t)
        u_bar, v_bar = J_u + mu, np.zeros_like(v)
        for newton in reversed(step.newton):
            w = self.model.solve_transposed(newton.factors, -newton.a * np.asarray(u_bar))
            by_u, by_v, by_p = self._newton(t, newton.u, v, p, newton.du, w)
            u_bar, v_bar, p_bar = u_bar + by_u, v_bar + by_v, p_bar + by_p
        by_v, by_p = self._predicted(t, v, p, u_bar)
        return J_t, np.asarray(v_bar + by_v), np.asarray(p_bar + by_p)
