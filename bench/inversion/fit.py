"""How well the answer explains measured data, and how well the data determine it: residuals against noise, error bars.

Error bars are those of Gauss and Newton: p +- sqrt(diag((H^T H)^{-1})) sigma at the answer, H = d(S u)/dp. They know
noise and nothing of what is wrong with the model: where residuals exceed the noise they mean nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.inversion.constants import Constants, stated
from gradient_routes.bench.inversion.objective import Evaluation, observed
from gradient_routes.bench.inversion.residuals import Residuals
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity

MANY = 50  # parameters, each of which takes a linearized solve


@dataclass(frozen=True)
class Fit:
    """Residuals of what was observed; error bars sd (n_p,), nan where the data leave one unbounded; constants as
    people state them.
    """

    residuals: Residuals
    seen: Observation = field(repr=False)
    sd: Array
    constants: Constants | None = None

    @property
    def described(self) -> str:
        told = self.constants.described if self.constants is not None else []
        return "\n".join([*told, self.residuals.described])


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
        H = Sensitivity(model, state, scale).dense() if len(p) <= MANY else None
    except OUTSIDE:
        return None
    if seen is None or not len(seen.data):
        return None
    unloaded = observed(problem, p) if problem.drive == "load" else None
    if H is None:
        residuals = Residuals.of(seen, unloaded=unloaded, prior=problem.prior(p) is not None and problem.alpha > 0.0)
        return Fit(residuals, seen, np.full(len(p), np.nan))
    prior = posterior.prior_rows(problem, p, scale)
    A = H if prior is None else np.concatenate([H, prior])
    residuals = Residuals.of(seen, fitted(H, A), unloaded, H, prior is not None)
    sigma = residuals.noise * seen.weight
    sd = posterior.known(problem, p, H, scale, sigma).sd
    return Fit(residuals, seen, sd, stated(problem, found, A, H, seen, sigma))


def fitted(H: Array, A: Array) -> float:
    """Data that p takes up: the trace of H (A^T A)^+ H^T, of A the rows of H and of the prior."""
    R = np.asarray(np.linalg.qr(A, mode="r"))
    return float(np.sum((H @ np.linalg.pinv(R, rcond=max(A.shape) * posterior.EPS)) ** 2))
