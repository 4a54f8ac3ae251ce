"""The adjoint of a march in time, step by step, with few states kept.

    R_u^T lam_t = -(J_u + mu_t),    (mu_{t-1}, g_t) = J_q + R_q^T lam_t,    q = (u_{t-1}, p),  mu_T = 0

and dJ/dp is the sum of all g_t and of mu_0^T du_0/dp: the transposed solve of the system of all steps, without it.
"""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.checkpointing import Schedule
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import Result


def march_back(model: Model, p: Array, schedule: Schedule) -> Result:
    """J and dJ/dp, of a problem whose steps all have one matrix: counted as sweeps over all steps, and steps."""
    problem, tally = model.problem, model.tally
    assert isinstance(problem, Transient)
    u_0 = problem.initial_state(p)
    factors = model.factorize(problem.at(1).tangent(u_0, np.concatenate([u_0, p])))

    def march(t: int, before: Array) -> Array:
        tally.count("steps")
        return -factors.solve(problem.at(t).residual(np.zeros_like(before), np.concatenate([before, p])))

    J, gradient, mu, n = 0.0, np.zeros_like(p), np.zeros_like(u_0), len(u_0)
    missed = scale = 0.0
    for t, before, u in schedule.backwards(march, u_0, problem.steps):
        step, q = problem.at(t), np.concatenate([before, p])
        lin = step.linearize(u, q)
        J += float(step.objective(u, q))
        by_q = lin.J_p + lin.R_p.T @ factors.solve_transposed(-(lin.J_u + mu))
        mu, gradient = by_q[:n], gradient + by_q[n:]
        missed = max(missed, norm(step.residual(u, q)))
        scale = max(scale, norm(step.residual(np.zeros_like(u), q)))
    by = problem.initial_by(p)
    gradient = gradient if by is None else gradient + by.T @ mu
    for kind in ("forward_solves", "newton_iterations", "assemblies", "solves", "transposed_solves"):
        tally.count(kind)
    tally.count("residuals", 3)
    return Result(J, gradient, residual=missed / (scale or 1.0))
