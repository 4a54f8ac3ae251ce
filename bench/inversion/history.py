"""An inversion, iteration by iteration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.objective import Evaluation, Objective
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
    says: str | None = None


Watch = Callable[[Iterate], None]


@dataclass
class History:
    """Accepted steps as they come, each handed to `watch`. `truth` and the start p_0 are for distances."""

    objective: Objective
    truth: Array | None
    p_0: Array
    watch: Watch = lambda iterate: None
    iterates: list[Iterate] = field(default_factory=list)
    offset: int = 0  # iterations of a run that this one resumes
    last: Evaluation | None = None

    def take(self, found: Evaluation, says: str | None = None) -> None:
        """An accepted step; steps that had to come back on the way are said."""
        walls = [tried.outside for tried in self.objective.tried if tried.outside is not None]
        if walls and says is None:
            says = f"a step was shortened: {walls[0]}"
        misfit, regularization = self.objective.misfit(found)
        before = self.objective.accepted
        moved = None if not self.iterates or before is None else found.x - before.x
        iterate = Iterate(
            self.offset + len(self.iterates),
            found.J,
            misfit,
            regularization,
            norm2(found.gradient),
            None if moved is None else float(np.linalg.norm(moved)),
            self.objective.forward_solves,
            self.objective.adjoint_solves,
            self.objective.seconds,
            self.distance(found.p),
            says,
        )
        self.last = found
        self.iterates.append(iterate)
        self.watch(iterate)

    def distance(self, p: Array) -> float | None:
        """|p - p_true| / |p_0 - p_true|."""
        if self.truth is None:
            return None
        span = float(np.linalg.norm(self.p_0 - self.truth))
        return float(np.linalg.norm(p - self.truth)) / span if span else None
