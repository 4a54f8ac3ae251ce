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
        level = max(NORMAL * float(np.median(r)), sigma)
        inner = r[r <= FAR * level]
        freedom = max(1, len(inner) - seen.eliminated)
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
    by name, each with its own.
    """

    residuals: Residuals
    sd: Array
    stated: Mapping[str, tuple[float, float]] = field(default_factory=dict)


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
    return Fit(residuals, sd, {} if H is None else _stated(problem, p, H, scale, sigma))


def _stated(problem: Problem, p: Array, H: Array, scale: Array, sigma: float) -> dict[str, tuple[float, float]]:
    """Values and error bars, these by the derivatives of the constants in p, which complex steps give."""
    values = problem.stated(p)
    if not values:
        return {}
    step = 1e-30
    by_x = np.array([[v.imag / step for v in problem.stated(p + 1j * step * e).values()] for e in np.diag(scale)]).T
    R = np.asarray(np.linalg.qr(H, mode="r"))
    if np.linalg.cond(R) > 1.0 / posterior.EPS:
        return {name: (float(value.real), np.nan) for name, value in values.items()}
    sd = sigma * np.linalg.norm(np.linalg.solve(R.T, by_x.T), axis=0)
    return {name: (float(value.real), float(s)) for (name, value), s in zip(values.items(), sd, strict=True)}
