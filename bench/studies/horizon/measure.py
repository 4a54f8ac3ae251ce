"""What gradients say of J the longer a march is.

Along p + s v, |s| <= S, the quotient (J(S) - J(-S)) / 2 S is the mean of all slopes dJ/ds between, if J is continuous.
Slopes at few places estimate it. Where they scatter, one of them is a noisy estimate; where their mean is off by more
than that explains, gradients miss what J does: they know nothing of its jumps.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, point
from gradient_routes.bench.cases.study import Found, Kept, Say
from gradient_routes.bench.studies.judged import said
from gradient_routes.bench.studies.options import one_problem
from gradient_routes.problems.errors import DomainError, InputError, NotConverged, Overflow, SingularMatrix
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.problems.transient import ActiveSteps, Transient
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

NOISY = 0.3  # scatter of slopes, relative to their root mean square
BIASED = 4.0  # standard errors by which the mean of slopes may be off the quotient
CURVED = 0.02  # of the slopes: what their mean at few places may be off by in a smooth J


@dataclass(frozen=True)
class Horizon:
    """One march of `steps`. Fields are columns of its table."""

    steps: int
    status: str = "ok"
    reason: str | None = None
    objective: float | None = None
    gradient_norm: float | None = None
    slope: float | None = None
    slope_mean: float | None = None
    slope_scatter: float | None = None
    quotient: float | None = None
    flips: int | None = None
    energy_growth: float | None = None
    verdict: str | None = None


@dataclass(frozen=True)
class Horizons:
    """The study."""

    about: dict[str, Any]
    marches: tuple[Horizon, ...]

    @property
    def rows(self) -> list[dict[str, Any]]:
        return [self.about | asdict(march) for march in self.marches]


def run(
    say: Say,
    *,
    selector: str,
    at: str,
    spread: float,
    places: int,
    budget: float,
    solver: Solver,
    kept: Path | None = None,
) -> int:
    done = horizon(one_problem(selector), at, spread, places, budget, solver)
    for row in done.rows:
        say(Kept("horizon", row))
    say(Found(done))
    return 0 if any(march.status == "ok" for march in done.marches) else 1


def horizon(
    spec: ProblemSpec,
    at: str = "start",
    spread: float = 1e-3,
    places: int = 12,
    budget: float = 60.0,
    solver: Solver | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Horizons:
    """Marches of 1, 2, 4, .. steps and of all, until `budget` [s] is spent. Raises InputError, DomainError."""
    problem = spec()
    if not isinstance(problem, Transient) or "steps" not in spec.options:
        raise InputError(f"horizon: {problem.name} has no option steps - name a problem that marches in time")
    route = adjoint if Offers.LINEARIZE in problem.offers else implicit_ad
    if (objection := route.objection(problem)) is not None:
        raise InputError(f"horizon: {objection}")
    p = point(problem, at)
    about = {"problem": spec.name, "problem_options": spec.options, "at": at, "n_state": problem.n_state}
    about |= {"n_param": len(p), "spread": spread, "places": places}
    marches: list[Horizon] = []
    started = clock()
    for steps in lengths(problem.steps):
        if clock() - started > budget:
            marches.append(Horizon(steps, "skipped", f"beyond the budget of {budget:g} s"))
            continue
        try:
            march = replace(spec, options=spec.options | {"steps": steps})()
            assert isinstance(march, Transient)
            marches.append(measured(march, p, route, spread, places, solver or Solver()))
        except (DomainError, InputError, NotConverged, Overflow, SingularMatrix) as failure:
            marches.append(Horizon(steps, "failed", said(failure)))
    return Horizons(about, tuple(marches))


def lengths(most: int) -> list[int]:
    """1, 2, 4, .. and most."""
    return [*(2**k for k in range(most.bit_length()) if 2**k < most), most]


def measured(problem: Transient, p: Array, route: Any, spread: float, places: int, solver: Solver) -> Horizon:
    """Slopes in the middles of `places` equal parts of the interval, and J at its ends."""
    natural = problem.parameters.natural(p)
    v = natural * np.random.default_rng(0).choice([-1.0, 1.0], len(p)) / np.sqrt(len(p))
    model = Model(problem, solver)
    gradient = route.prepare(model, p)
    here = gradient(p)
    s = spread * ((2.0 * np.arange(places) + 1.0) / places - 1.0)
    slopes = np.array([float(gradient(p + s_i * v).gradient @ v) for s_i in s])
    ends = [model.solve(p + end * v) for end in (-spread, spread)]
    quotient = float((ends[1].J - ends[0].J) / (2.0 * spread))
    return Horizon(
        problem.steps,
        objective=float(here.J),
        gradient_norm=float(np.linalg.norm(here.gradient * natural)),
        slope=float(here.gradient @ v),
        slope_mean=float(slopes.mean()),
        slope_scatter=float(slopes.std(ddof=1)),
        quotient=quotient,
        flips=flips(problem, [(end.u, end.p) for end in ends]),
        energy_growth=None if here.u is None else problem.energy_growth(here.u, p),
        verdict=verdict(slopes, quotient),
    )


def flips(problem: Problem, ends: list[tuple[Array, Array]]) -> int | None:
    """Steps whose active sets differ between two solved states; None where none has any."""
    first, second = (problem.active_set(*end) for end in ends)
    return len(first.flips(second)) if isinstance(first, ActiveSteps) and isinstance(second, ActiveSteps) else None


def verdict(slopes: Array, quotient: float) -> str:
    size = float(np.sqrt(np.mean(slopes**2)))
    scatter = float(slopes.std(ddof=1))
    if abs(slopes.mean() - quotient) > BIASED * scatter / np.sqrt(len(slopes)) + CURVED * size:
        return "biased"
    return "noisy" if scatter > NOISY * size else "smooth"
