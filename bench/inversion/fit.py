"""How well the answer explains measured data, and how well the data determine it: residuals against noise, error bars.

Error bars are those of Gauss and Newton: p +- sqrt(diag((H^T H)^{-1})) sigma at the answer, H = d(S u)/dp, and what the
noise of measured boundary values adds to first order. They know noise and nothing of what is wrong with the model:
where residuals exceed the noise they mean nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.inversion.constants import Constants, Spread, stated
from gradient_routes.bench.inversion.objective import Evaluation, observed
from gradient_routes.bench.inversion.residuals import Residuals
from gradient_routes.bench.inversion.step_bias import TOO_LONG, StepBias, step_bias
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.sensitivity import RANK, Sensitivity

MANY = 50  # parameters, each of which takes a linearized solve


@dataclass(frozen=True)
class Fit:
    """Residuals of what was observed; error bars sd (n_p,), nan where the data leave one unbounded; constants as
    people state them; what the length of steps in time does to p.
    """

    residuals: Residuals
    seen: Observation = field(repr=False)
    sd: Array
    constants: Constants | None = None
    steps: StepBias | None = None

    @property
    def verdict(self) -> str:
        """What is wrong, empty where the model explains the data and its steps are short enough."""
        return self.residuals.verdict or (TOO_LONG if self._steps else "")

    @property
    def _steps(self) -> str:
        return "" if self.steps is None else self.steps.described

    @property
    def doubts(self) -> str:
        """Residuals, and steps that are too long."""
        return "\n".join(filter(None, [self.residuals.described, self._steps]))

    @property
    def described(self) -> str:
        told = self.constants.described if self.constants is not None else []
        return "\n".join([*told, self.doubts])


def fit(problem: Problem, found: Evaluation, solver: Solver) -> Fit | None:
    """At the answer, by one linearized solve a parameter, and a forward solve where its route has no state; None unless
    data were measured.
    """
    if not problem.measured or Offers.LINEARIZE not in problem.offers:
        return None
    model, scale, p = Model(problem, solver), problem.parameters.scale, found.p
    try:
        state = model.solve(p) if found.u is None else model.state_at(found.u, p)
        seen = problem.observation(state.u, p)
        by_p = Sensitivity(model, state, scale) if len(p) <= MANY else None
        H = None if by_p is None else by_p.dense()
    except OUTSIDE:
        return None
    if seen is None or not len(seen.data):
        return None
    unloaded = observed(problem, p) if problem.drive == "load" else None
    if H is None or by_p is None:
        residuals = Residuals.of(seen, unloaded=unloaded, prior=problem.prior(p) is not None and problem.alpha > 0.0)
        return Fit(residuals, seen, np.full(len(p), np.nan))
    prior = posterior.prior_rows(problem, p, scale)
    A = H if prior is None else np.concatenate([H, prior])
    residuals = Residuals.of(seen, fitted(H, A), unloaded, H, prior is not None)
    sigma = residuals.noise * seen.weight
    spread = beside(problem, by_p, state, seen)
    sd = posterior.known(problem, p, H, scale, sigma).sd
    if spread is not None:
        sd = np.hypot(sd, scale * np.linalg.norm(spread(np.linalg.pinv(A, rcond=RANK)[:, : len(H)]), axis=1))
    steps = step_bias(problem, p, A, seen, sd, solver)
    return Fit(residuals, seen, sd, stated(problem, found, A, H, seen, sigma, spread), steps)


def beside(problem: Problem, by_p: Sensitivity, state: State, seen: Observation) -> Spread | None:
    """What noise of that which R takes as exact does to estimates, by one transposed solve each; None without any."""
    exact = problem.taken_as_exact(state.u, state.p)
    if exact is None:
        return None

    def spread(P: Array) -> Array:
        """(j, k), of estimates P y (j,) by independent unit normal variables, P (j, m)."""
        return np.stack([exact.pulled(w, by_p.R_u.solve_transposed(np.asarray(seen.S_u.T @ w))) for w in P])

    return spread


def fitted(H: Array, A: Array) -> float:
    """Data that p takes up: the trace of H (A^T A)^+ H^T, of A the rows of H and of the prior."""
    R = np.asarray(np.linalg.qr(A, mode="r"))
    return float(np.sum((H @ np.linalg.pinv(R, rcond=max(A.shape) * posterior.EPS)) ** 2))
