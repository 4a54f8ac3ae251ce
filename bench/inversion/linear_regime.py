"""Whether a linear model is enough: what its readings differ by, against the noise of the data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.inversion.objective import Evaluation
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

ENOUGH = 0.3  # of the noise, root mean square: residuals grow by 4 %


@dataclass(frozen=True)
class LinearRegime:
    """Differences of the readings of a linear model and of the problem, root mean square and largest, in sigma."""

    rms: float
    most: float

    @classmethod
    def of(cls, difference: Array, sigma: float) -> LinearRegime:
        """From differences (m,) and the noise sigma, both with the weights of J."""
        return cls(float(np.sqrt(np.mean(difference**2))) / sigma, float(np.abs(difference).max()) / sigma)

    @property
    def enough(self) -> bool:
        return self.rms <= ENOUGH

    def described(self, what: str) -> str:
        stands = "suffices" if self.enough else "does not suffice"
        off = f"{self.rms:.2g} sigma, {self.most:.2g} at most"
        return f"{what} {stands}: its readings differ from those of the problem by {off}"


def at_rest(problem: Problem, found: Evaluation, solver: Solver) -> LinearRegime | None:
    """Of the problem linearized at u = 0, by one linear solve; R is nonlinear in u. None without data or their noise,
    and where solves do not start from u = 0.

        R(0, p) + R_u(0, p) u_lin = 0
    """
    if problem.linear or Offers.SOLVE not in problem.offers:
        return None
    model, p = Model(problem, solver), found.p
    u_0 = model.initial(p)
    seen = problem.observation(u_0, p)
    if u_0.any() or seen is None or not seen.sigma:
        return None
    try:
        u = model.solve(p).u if found.u is None else found.u
        u_lin = -model.solve_linear(model.factorize(model.tangent(u_0, p)), model.residual(u_0, p))
        readings = [problem.observation(each, p) for each in (u, u_lin)]
    except OUTSIDE:
        return None
    S_u, S_u_lin = (np.asarray(each.predicted) for each in readings if each is not None)
    return LinearRegime.of(S_u_lin - S_u, seen.sigma)
