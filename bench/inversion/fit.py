"""How well the answer explains measured data, and how well the data determine it: residuals against noise, error bars.

Error bars are those of Gauss and Newton: p +- sqrt(diag((H^T H)^{-1})) sigma at the answer, H = d(S u)/dp. They know
noise and nothing of what is wrong with the model: where residuals exceed the noise they mean nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.inversion.objective import OUTSIDE
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity

MANY = 50  # parameters, each of which takes a linearized solve
NORMAL = 1.4826  # standard deviation of normal numbers, in medians of their sizes
FAR = 5.0  # standard deviations beyond which a residual is an outlier
EXCESS = 2.0  # times the noise, above which it does not explain the residuals
STEP = 1e-30  # of complex steps
EXCEEDS = "misfit exceeds noise"


@dataclass(frozen=True)
class Residuals:
    """Of S u - d in the unit of the data: how many; root mean square, with and without outliers; their number.

    sigma  the noise that is stated, 0 where it is not
    """

    count: int
    rms: float
    inner_rms: float
    outliers: int
    sigma: float

    @classmethod
    def of(cls, seen: Observation) -> Residuals:
        r = np.abs(seen.predicted - seen.data) / seen.weight
        sigma = seen.sigma / seen.weight
        inner = r[inliers(r, sigma)]
        freedom = max(1, len(inner) - (0 if seen.modes is None else seen.modes.shape[1]))
        return cls(len(r), rms(r, len(r)), rms(inner, freedom), len(r) - len(inner), sigma)

    @property
    def exceed(self) -> bool:
        """Whether the residuals are no noise of the size that is stated."""
        return self.sigma > 0.0 and self.inner_rms > EXCESS * self.sigma

    @property
    def described(self) -> str:
        beyond = f"; {self.rms:.3g} with {self.outliers} outliers of {self.count}" if self.outliers else ""
        if not self.sigma:
            return f"residuals: rms {self.inner_rms:.3g}{beyond}; noise not stated"
        stated = f"noise {self.sigma:.3g}"
        if self.exceed:
            times = self.inner_rms / self.sigma
            return (
                f"{EXCEEDS}: residuals of rms {self.inner_rms:.3g}{beyond} against {stated}, {times:.2g} times as much"
            )
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


def rms(r: Array, freedom: int) -> float:
    return float(np.sqrt(np.sum(r**2) / freedom)) if len(r) else 0.0


def fit(problem: Problem, p: Array, solver: Solver) -> Fit | None:
    """At the answer p, by one forward solve and one linearized solve a parameter; None unless data were measured."""
    if not problem.measured or Offers.LINEARIZE not in problem.offers:
        return None
    model, scale = Model(problem, solver), problem.parameters.scale
    try:
        state = model.solve(p)
        seen = problem.observation(state.u, p)
        H = Sensitivity(model, state, scale).dense() if len(p) <= MANY else None
    except OUTSIDE:
        return None
    if seen is None or not len(seen.data):
        return None
    residuals = Residuals.of(seen)
    sigma = seen.sigma or residuals.inner_rms * seen.weight
    sd = posterior.known(problem, p, H, scale, sigma).sd
    if H is None:
        return Fit(residuals, sd)
    return Fit(residuals, sd, _stated(problem, p, H, scale, sigma), _thirds(problem, p, H, scale, seen))


def _stated(problem: Problem, p: Array, H: Array, scale: Array, sigma: float) -> dict[str, tuple[float, float]]:
    """Values and error bars, these by the derivatives of the constants in p, which complex steps give."""
    values = problem.stated(p)
    if not values:
        return {}
    by_x = np.array([[v.imag / STEP for v in problem.stated(p + 1j * STEP * e).values()] for e in np.diag(scale)]).T
    R = np.asarray(np.linalg.qr(H, mode="r"))
    if np.linalg.cond(R) > 1.0 / posterior.EPS:
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
