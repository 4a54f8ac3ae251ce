"""The adjoint of a march in time, step by step, with few states kept.

    R_u^T lam_t = -(J_u + mu_t),    (mu_{t-1}, g_t) = J_q + R_q^T lam_t,    q = (u_{t-1}, p),  mu_T = 0

and dJ/dp is the sum of all g_t and of mu_0^T du_0/dp: the transposed solve of the system of all steps, without it.
"""

from __future__ import annotations

from typing import Annotated, Protocol

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.problems.rates import Rates
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.checkpointing import Schedule
from gradient_routes.routes.march import March
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import ForwardWork, Result, Work

WHOLE = "whole"
MOST = 10**9  # steps, of any problem
Checkpoint = Annotated[
    str, "states that a march in time keeps: all, none, sqrt, every=K, revolve=S; whole: all steps as one system"
]


SHARE = 40  # states that are kept for one that is evaluated together with others: these take a third of the memory


class Derivatives(Protocol):
    """Of the steps of a march: a `Transient`, or `TracedSteps`."""

    def rates(self, t_0: int, states: Array, p: Array, /) -> Rates: ...
    def phi_by(self, p: Array, /) -> Array: ...
    def pulled_to_initial(self, mu: Array, p: Array, /) -> Array: ...


def march_back(model: Model, p: Array, checkpoint: str, derivatives: Derivatives | None = None) -> Result:
    """J and dJ/dp, counted as sweeps over all steps, Newton steps of a nonlinear march, and steps.

    derivatives of the steps: those of the problem, where none are given. Raises NotConverged, Overflow.
    """
    problem = model.problem
    assert isinstance(problem, Transient)
    of, schedule = derivatives or problem, Schedule.of(checkpoint, problem.steps, problem.name)
    together = max(1, min(problem.together, schedule.kept(problem.steps) // SHARE))
    march = March(model, p, together)
    J, gradient, mu, left, size = problem.phi(p), of.phi_by(p), np.zeros_like(march.u_0), 0.0, 0.0
    for t_0, states in schedule.backwards(march, march.u_0, problem.steps, together):
        rates = of.rates(t_0, states, p)
        lam, mu = march.back(t_0, states, -rates.J_u, mu)
        by_p = rates.J_p + rates.by_p(lam)
        for J_t, g_t in zip(rates.J[::-1], by_p[::-1], strict=True):  # one by one, whatever steps come together
            J, gradient = J + J_t, gradient + g_t
        left, size = max(left, norm(problem.rows(t_0, states, p))), max(size, norm(states))
    march.check(left, size)
    initial = of.pulled_to_initial(mu, p)
    model.tally.count("transposed_solves")
    model.tally.count("residuals")
    return Result(float(J), gradient + initial, residual=left / (march.scale or 1.0), initial=initial)


def march_work(forward: ForwardWork, checkpoint: str) -> Work:
    """What marching back takes beside a forward and a transposed solve of all steps."""
    again = Schedule.of(checkpoint, forward.cold.steps, "march").recomputed(forward.cold.steps)
    return Work(residuals=1, steps=again) + forward.marched_again(again)


def check_checkpoint(route: str, checkpoint: str, others: dict[str, tuple[str, str]]) -> None:
    """others: options that marching back does not have, each with its value and the one that it has to be.

    Raises InputError.
    """
    if checkpoint == WHOLE:
        return
    Schedule.of(checkpoint, MOST, route)
    for name, (value, default) in others.items():
        if value != default:
            raise InputError(f"{route}: checkpoint={checkpoint} takes no {name}={value} - leave it out")


def march_objection(route: str, problem: Problem, checkpoint: str) -> str | None:
    """Why a problem cannot be marched back, or None. Raises InputError for more states than there are."""
    if checkpoint == WHOLE:
        return None
    if not isinstance(problem, Transient):
        return f"{route}[checkpoint={checkpoint}] marches back in time, {problem.name} has no steps"
    Schedule.of(checkpoint, problem.steps, f"{route} on {problem.name}")
    return None
