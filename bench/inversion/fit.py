"""How well the answer explains measured data, and how well the data determine it: residuals against noise, error bars.

Error bars are those of Gauss and Newton: p +- sqrt(diag((H^T H)^{-1})) sigma at the answer, H = d(S u)/dp. They know
noise and nothing of what is wrong with the model: where residuals exceed the noise they mean nothing.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.inversion.objective import Evaluation, observed
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity

MANY = 50  # parameters, each of which takes a linearized solve
NORMAL = 1.4826  # standard deviation of normal numbers, in medians of their sizes
FAR = 5.0  # standard deviations beyond which a residual is an outlier
EXCESS = 2.0  # times the noise, above which it does not explain the residuals
MANY_OUTLIERS = 0.1  # of the data, above which they are no accidents
NOTHING = 0.99  # of the data, residuals that leave them as they are
STEP = 1e-30  # of complex steps
EXCEEDS = "misfit exceeds noise"


@dataclass(frozen=True)
class Residuals:
    """Of S u - d in the unit of the data: how many; their root mean square; that of those which are no outliers, per
    degree of freedom; the number of outliers.

    sigma    the noise that is stated, 0 where it is not
    freedom  data that are no outliers, less what was fitted to them
    size     root mean square of d - S u_0: residuals of a model that says nothing
    """

    count: int
    rms: float
    inner_rms: float
    outliers: int
    sigma: float
    freedom: float
    size: float = math.inf

    @classmethod
    def of(cls, seen: Observation, fitted: float = 0.0, unloaded: Observation | None = None) -> Residuals:
        """`fitted`: how many data p takes up; `unloaded`: the data term at u_0."""
        r = np.abs(seen.predicted - seen.data) / seen.weight
        sigma = seen.sigma / seen.weight
        inner = r[inliers(r, sigma)]
        freedom = len(inner) - fitted - (0 if seen.modes is None else seen.modes.shape[1])
        inner_rms = rms(inner, max(1.0, freedom))
        size = math.inf if unloaded is None else rms(unloaded.predicted - unloaded.data, len(r)) / seen.weight
        return cls(len(r), rms(r, len(r)), inner_rms, len(r) - len(inner), sigma, freedom, size)

    @property
    def nothing(self) -> bool:
        """Whether the model explains none of the data: residuals are as large as they are."""
        return self.rms > NOTHING * self.size > 0.0

    @property
    def unexplained(self) -> bool:
        return self.nothing or self.exceed

    @property
    def exceed(self) -> bool:
        """Whether the residuals are no noise of the size that is stated."""
        larger = self.inner_rms > EXCESS * self.sigma or self.outliers > MANY_OUTLIERS * self.count
        return self.sigma > 0.0 and larger

    @property
    def noise(self) -> float:
        """As stated, else as the residuals tell; 0 where they cannot, with no more data than were fitted."""
        return self.sigma or (self.inner_rms if self.freedom >= 1.0 else 0.0)

    @property
    def described(self) -> str:
        beyond = f"; {self.rms:.3g} with {self.outliers} outliers of {self.count}" if self.outliers else ""
        if self.nothing:
            return f"nothing explained: residuals of rms {self.rms:.3g}, of data of rms {self.size:.3g}"
        if not self.noise:
            return "no error bars: noise is not stated, and no data are left to tell it - give noise="
        if not self.sigma:
            return f"residuals: rms {self.inner_rms:.3g}{beyond}; noise not stated, taken from them"
        stated = f"noise {self.sigma:.3g}"
        if self.exceed:
            times = f"{self.inner_rms / self.sigma:.2g} times as much"
            return f"{EXCEEDS}: residuals of rms {self.inner_rms:.3g}{beyond} against {stated}, {times}"
        return f"residuals: rms {self.inner_rms:.3g}{beyond}; {stated}"


@dataclass(frozen=True)
class Fit:
    """Residuals; error bars sd (n_p,), nan where the data leave a parameter unbounded; constants as people state them,
    by name, each with its own error bar, and what each third of the data along their longest extent says alone.

    Thirds differ by what the model leaves out, which error bars do not know.
    """

    residuals: Residuals
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


def inliers(r: Array, sigma: float) -> Array:
    """Which residuals of sizes r are no outliers."""
    return np.asarray(r <= FAR * max(NORMAL * float(np.median(r)), sigma))


def rms(r: Array, freedom: float) -> float:
    return float(np.sqrt(np.sum(r**2) / freedom)) if len(r) else 0.0


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
        return Fit(Residuals.of(seen, unloaded=unloaded), np.full(len(p), np.nan))
    prior = posterior.prior_rows(problem, p, scale)
    A = H if prior is None else np.concatenate([H, prior])
    residuals = Residuals.of(seen, fitted(H, A), unloaded)
    sigma = residuals.noise * seen.weight
    sd = posterior.known(problem, p, H, scale, sigma).sd
    return Fit(residuals, sd, _stated(problem, p, A, scale, sigma), _thirds(problem, p, H, scale, seen))


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
    along = x[:, int(np.nanargmax(np.nanmax(x, axis=0) - np.nanmin(x, axis=0)))]
    third = np.digitize(along, np.linspace(np.nanmin(along), np.nanmax(along), 4)[1:-1])
    r, found = seen.predicted - seen.data, []
    kept = inliers(np.abs(r), seen.sigma)
    for k in range(3):
        rows = ((third == k) | np.isnan(along)) & kept  # what has no position, a force, belongs to each
        A, b = H[rows], -r[rows]
        if seen.modes is not None:
            Q, _ = np.linalg.qr(seen.modes[rows])
            A, b = A - Q @ (Q.T @ A), b - Q @ (Q.T @ b)
        if len(b) <= len(p) or np.linalg.matrix_rank(A) < len(p):
            return {}
        found.append(problem.stated(p + scale * np.linalg.lstsq(A, b, rcond=None)[0]))
    return {name: tuple(float(of[name]) for of in found) for name in found[0]}
