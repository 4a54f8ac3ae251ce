"""The accepted steps of an inversion."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.error_bar import ErrorBar
from gradient_routes.bench.inversion.objective import Evaluation, Objective, noise_level
from gradient_routes.bench.inversion.slopes import EPS, ROUNDED
from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class Iterate:
    """One accepted step. Fields are columns of its table."""

    iteration: int
    objective: float
    misfit: float
    regularization: float
    gradient_norm: float
    step_length: float | None
    forward_solves: int
    adjoint_solves: int
    seconds: float
    distance: float | None
    discrepancy: float | None
    chosen: str | None
    says: str | None = None


Watch = Callable[[Iterate], None]


@dataclass
class History:
    """Accepted steps, each passed to `watch`.

    truth, p_0  for |p - p_true| / |p_0 - p_true|
    offset      iterations of the run that this one resumes
    noise       the misfit of the noise of the data, 0 where that is not known
    met         whether the misfit has come down to it: what the discrepancy principle chooses is the first such step
    ratios      of the changes of J that the gradient promises, by the trapezoidal rule, to the actual ones
    """

    objective: Objective
    truth: Array | None
    p_0: Array
    watch: Watch = lambda iterate: None
    iterates: list[Iterate] = field(default_factory=list)
    offset: int = 0
    first: Evaluation | None = None
    last: Evaluation | None = None
    ratios: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.error_bar = ErrorBar(self.objective)
        self.noise, self.met = noise_level(self.objective.problem, self.p_0), False

    def take(self, found: Evaluation, says: str | None = None) -> None:
        """Record an accepted step, and whether steps before it left the domain of J."""
        objective = self.objective
        outside = [tried.outside for tried in objective.tried if tried.outside is not None]
        if outside and says is None:
            says = f"a step was shortened: {outside[0]}"
        moved = float(np.linalg.norm(found.x - objective.accepted.x)) if self.iterates else None
        misfit, regularization = objective.misfit(found)
        over_noise = math.sqrt(max(misfit, 0.0) / self.noise) if self.noise else None
        first_met = over_noise is not None and over_noise <= 1.0 and not self.met
        self.met = self.met or first_met
        iterate = Iterate(
            self.offset + len(self.iterates),
            found.J,
            misfit,
            regularization,
            norm2(found.gradient),
            moved,
            objective.forward_solves,
            objective.adjoint_solves,
            objective.seconds,
            self._distance(found.p),
            over_noise,
            "discrepancy" if first_met else None,
            says,
        )
        self.first, self.last = self.first or found, found
        self._compare(objective.accepted, found)
        self.iterates.append(iterate)
        self.watch(iterate)

    def _compare(self, before: Evaluation, found: Evaluation) -> None:
        """What J does in a step against what its gradients say; exact for a quadratic J."""
        actual = found.J - before.J
        if abs(actual) > ROUNDED * EPS * max(abs(found.J), abs(before.J)):
            self.ratios.append(float(0.5 * (before.by_x + found.by_x) @ (found.x - before.x)) / actual)

    def _distance(self, p: Array) -> float | None:
        if self.truth is None:
            return None
        span = float(np.linalg.norm(self.p_0 - self.truth))
        return float(np.linalg.norm(p - self.truth)) / span if span else None
