"""A march in time: states of some steps from the state before them, and the transposed march back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.matrices.recurrence import Recurrence
from gradient_routes.problems.problem import Array
from gradient_routes.problems.transient import Transient, stepwise
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import rounding
from gradient_routes.routes.solvers.factorization import Factorizer
from gradient_routes.routes.solvers.recurrence import RecurrenceFactorization


def marched_again(steps: int, interval: int | None) -> int:
    """Steps that are taken once more where states at 0, k, 2 k, .. are kept: all but those of the last interval."""
    return 0 if interval is None else (steps - 1) // interval * interval


def most_newton_steps(model: Model, p: Array) -> int:
    """The largest number of Newton steps in a step in time. Raises NotConverged."""
    assert isinstance(model.problem, Transient)
    counted, most = Model(model.problem, model.solver), 1
    u, scale = model.problem.initial_state(p), counted.march_scale(p)
    for t in range(1, model.problem.steps + 1):
        before = counted.tally.work.newton_iterations
        u, _ = counted.march_step(t, u, p, scale)
        most = max(most, counted.tally.work.newton_iterations - before)
    return most


class March:
    """(t_0, t_1, u_{t_0}) -> u_{t_0}..u_{t_1}, (t_1 - t_0 + 1, n), and `back`.

    together  steps that are evaluated at once [those of the problem]

    One factorization where the matrix is constant; else Newton's method in every step, and factors at the states
    themselves on the way back.
    """

    def __init__(self, model: Model, p: Array, together: int | None = None) -> None:
        assert isinstance(model.problem, Transient)
        self.model, self.problem, self.p = model, model.problem, p
        self.together = together or self.problem.together
        self.u_0 = self.problem.initial_state(p)
        self.scale = model.march_scale(p, self.together)
        model.tally.count("forward_solves")
        self.factors: RecurrenceFactorization | None = None
        self._factorize = Factorizer(model.solver.linear_solver, model.solver.rtol)
        for kind in ("assemblies", "factorizations"):  # of a sweep over all steps
            model.tally.count(kind)
        if self.problem.constant:
            for kind in ("newton_iterations", "residuals", "solves"):
                model.tally.count(kind)
            A = self._matrix(0, np.stack([self.u_0, self.u_0]))
            self.factors = self._factorized(replace(A, steps=self.problem.steps))

    def _matrix(self, t_0: int, states: Array) -> Recurrence:
        problem, steps = self.problem, [*stepwise(t_0, states)]
        A = [problem.step_tangent(*step, self.p) for step in steps]
        return Recurrence(A, [problem.step_coupling(*step, self.p) for step in steps], len(steps))

    def _factorized(self, A: Recurrence) -> RecurrenceFactorization:
        factors = self._factorize(A, self.problem.name)
        assert isinstance(factors, RecurrenceFactorization)
        return factors

    def __call__(self, t_0: int, t_1: int, u: Array) -> Array:
        self.model.tally.count("steps", t_1 - t_0)
        states = np.empty((t_1 - t_0 + 1, len(u)), u.dtype)
        states[0] = u
        if self.factors is None:
            for t in range(t_0 + 1, t_1 + 1):
                states[t - t_0], _ = self.model.march_step(t, states[t - t_0 - 1], self.p, self.scale)
            return states
        k = self.together
        for begin in range(0, t_1 - t_0, k):
            b = self.problem.loads(t_0 + begin, min(k, t_1 - t_0 - begin), self.p)
            states[begin + 1 : begin + len(b) + 1] = self.factors.march(b, states[begin], t_0 + begin)
        return states

    def back(self, t_0: int, states: Array, b: Array, mu: Array) -> tuple[Array, Array]:
        """lam (k, n) of R_u^T lam_t = b_t - mu_t for steps t_0 + 1..t_0 + k, and mu_{t_0}."""
        if self.factors is not None:
            return self.factors.march_back(b, mu, t_0)
        return self._factorized(self._matrix(t_0, states)).march_back(b, mu, t_0)

    def check(self, left: float, size: float) -> None:
        """Raises NotConverged where |R|_inf = left, of states with |u|_inf = size, is neither within the tolerance nor
        rounding: Newton's method checks its steps itself, one factorization for all is not checked otherwise.
        """
        if self.factors is None:
            return
        solver, problem = self.model.solver, self.problem
        if not left <= max(solver.rtol * self.scale, rounding(np.array([size]), self.factors.norm, problem.offset)):
            relative = left / (self.scale or 1.0)
            raise NotConverged(
                f"{problem.name}: |R| / |R_0| = {relative:.2g} after the march, wanted {solver.rtol:g}: R_u or R_v is"
                " not the same in all steps (then set constant=False), or R_u is too ill-conditioned",
                (self.scale, left),
            )
