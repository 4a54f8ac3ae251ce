"""How well the answer explains measured data, and how well the data determine it: residuals against noise, error bars.

Error bars are those of Gauss and Newton: p +- sqrt(diag((H^T H)^{-1})) sigma at the answer, H = d(S u)/dp. They know
noise and nothing of what is wrong with the model: where residuals exceed the noise they mean nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.inversion.objective import Evaluation, observed
from gradient_routes.bench.inversion.residuals import Residuals, inliers
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity

MANY = 50  # parameters, each of which takes a linearized solve
STEP = 1e-30  # of complex steps


@dataclass(frozen=True)
class Fit:
    """Residuals of what was observed; error bars sd (n_p,), nan where the data leave one unbounded; constants as
    people state them, by name, each with its own error bar, and what each third of the data along their longest extent
    says alone.

    Thirds differ by what the model leaves out, which error bars do not know.
    """

    residuals: Residuals
    seen: Observation = field(repr=False)
    sd: Array
    stated: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    thirds: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def described(self) -> str:
        lines = []
        for name, (value, sd) in self.stated.items():
            apart = ", ".join(f"{third:.4g}" for third in self.thirds.get(name, ()))
            lines.append(f"{name} {value:.4g} +- {sd:.2g}" + (f"; thirds of the data alone: {apart}" if apart else ""))
        return "\n".join([*lines, self.residuals.described])


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
    unloaded = observed(problem, p)
    if H is None:
        residuals = Residuals.of(seen, unloaded=unloaded, prior=problem.prior(p) is not None and problem.alpha > 0.0)
        return Fit(residuals, seen, np.full(len(p), np.nan))
    prior = posterior.prior_rows(problem, p, scale)
    A = H if prior is None else np.concatenate([H, prior])
    residuals = Residuals.of(seen, fitted(H, A), unloaded, H, prior is not None)
    sigma = residuals.noise * seen.weight
    sd = posterior.known(problem, p, H, scale, sigma).sd
    return Fit(residuals, seen, sd, _stated(problem, p, A, scale, sigma), _thirds(problem, p, H, scale, seen))


def fitted(H: Array, A: Array) -> float:
    """Data that p takes up: the trace of H (A^T A)^+ H^T, of A the rows of H and of the prior."""
    R = np.asarray(np.linalg.qr(A, mode="r"))
    return float(np.sum((H @ np.linalg.pinv(R, rcond=max(A.shape) * posterior.EPS)) ** 2))


def _stated(problem: Problem, p: Array, A: Array, scale: Array, sigma: float) -> dict[str, tuple[float, float]]:
    """Values and error bars, these by the derivatives of the constants in p, which complex steps give."""
    values = problem.stated(p)
    if not values:
        return {}
    by_x = np.array([[v.imag / STEP for v in problem.stated(p + 1j * STEP * e).values()] for e in np.diag(scale)]).T
    R = np.asarray(np.linalg.qr(A, mode="r"))
    if not sigma or len(R) < len(p) or np.linalg.cond(R) > 1.0 / posterior.EPS:
        return {name: (float(value.real), np.nan) for name, value in values.items()}
    sd = sigma * np.linalg.norm(np.linalg.solve(R.T, by_x.T), axis=0)
    return {name: (float(value.real), float(s)) for (name, value), s in zip(values.items(), sd, strict=True)}


def _thirds(problem: Problem, p: Array, H: Array, scale: Array, seen: Observation) -> dict[str, tuple[float, ...]]:
    """One Gauss-Newton step from the answer for each third, with a motion of its own where that is unknown, without
    outliers.
    """
    x = seen.position
    if x is None or not problem.stated(p) or len(x) < 6 * len(p):
        return {}
    along = x[:, int(np.ptp(x, axis=0).argmax())]
    third = np.digitize(along, np.linspace(along.min(), along.max(), 4)[1:-1])
    r, found = seen.predicted - seen.data, []
    kept = inliers(np.abs(r), seen.sigma)
    for k in range(3):
        rows = (third == k) & kept
        A, b = H[rows], -r[rows]
        if seen.modes is not None:
            Q, _ = np.linalg.qr(seen.modes[rows])
            A, b = A - Q @ (Q.T @ A), b - Q @ (Q.T @ b)
        if len(b) <= len(p) or np.linalg.matrix_rank(A) < len(p):
            return {}
        found.append(problem.stated(p + scale * np.linalg.lstsq(A, b, rcond=None)[0]))
    return {name: tuple(float(of[name]) for of in found) for name in found[0]}
