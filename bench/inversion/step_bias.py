"""What the length of steps in time does to an answer: where it would go with steps half as long.

Error bars know noise alone. Where steps are long, estimates make up for the errors of the scheme, with small residuals
and small error bars.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.inversion import posterior
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

BARS = 2.0  # error bars that estimates may move by
PART = 0.01  # of a natural change, that nobody minds
TOO_LONG = "steps in time are too long"
SHOWN = 3


@dataclass(frozen=True)
class StepBias:
    """shift (n_p,) of p with steps half as long, to first order; its error bars sd (n_p,), nan where unknown; natural
    changes of p (n_p,) and its names.
    """

    shift: Array
    sd: Array
    natural: Array
    names: tuple[str, ...]

    @property
    def moved(self) -> Array:
        """Which estimates move by more than noise explains."""
        size = np.abs(self.shift)
        return (size > PART * self.natural) & ~(size <= BARS * self.sd)

    @property
    def described(self) -> str:
        """Empty where no estimate moves."""
        worst = [i for i in np.argsort(-np.abs(self.shift) / self.natural) if self.moved[i]]
        each = [f"{self.names[i]} by {self.shift[i]:+.2g}{self._bars(i)}" for i in worst[:SHOWN]]
        more = f" and {len(worst) - SHOWN} others" if len(worst) > SHOWN else ""
        says = "take more steps, or a scheme of second order, until they do not"
        return f"{TOO_LONG}: half as long, they move {', '.join(each)}{more} - {says}" if worst else ""

    def _bars(self, i: int) -> str:
        return "" if np.isnan(self.sd[i]) else f" ({abs(self.shift[i]) / self.sd[i]:.2g} error bars)"


def step_bias(problem: Problem, p: Array, A: Array, seen: Observation, sd: Array, solver: Solver) -> StepBias | None:
    """By one march of twice as many steps, and a Gauss-Newton step with A, H scaled by natural changes with the rows of
    the prior below; None for what does not march, or where the finer march has no answer.
    """
    finer = problem.halved() if isinstance(problem, Transient) else None
    if finer is None:
        return None
    try:
        read = finer.observation(Model(finer, solver).solve(p).u, p)
    except OUTSIDE:
        return None
    assert read is not None
    by_data = np.linalg.pinv(A, rcond=max(A.shape) * posterior.EPS)[:, : len(seen.data)]
    q = problem.parameters
    shift = q.scale * (by_data @ (seen.predicted - read.predicted))
    return StepBias(shift, sd, q.scale, tuple(q.label(i) for i in range(len(p))))
