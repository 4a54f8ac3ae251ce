"""The adjoint of a march in time, step by step, with few states kept.

    R_u^T lam_t = -(J_u + mu_t),    (mu_{t-1}, g_t) = J_q + R_q^T lam_t,    q = (u_{t-1}, p),  mu_T = 0

and dJ/dp is the sum of all g_t and of mu_0^T du_0/dp: the transposed solve of the system of all steps, without it.
"""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.checkpointing import Schedule
from gradient_routes.routes.march import March
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.route import Result


def march_back(model: Model, p: Array, schedule: Schedule) -> Result:
    """J and dJ/dp, counted as sweeps over all steps, Newton steps of a nonlinear march, and steps."""
    march = March(model, p)
    problem = march.problem
    J, gradient, mu, left = problem.phi(p), problem.phi_by(p), np.zeros_like(march.u_0), 0.0
    for t_0, states in schedule.backwards(march, march.u_0, problem.steps, problem.together):
        rates = problem.rates(t_0, states, p)
        lam, mu = march.back(t_0, states, -rates.J_u, mu)
        by_p = rates.J_p + rates.R_p.each_transposed(lam)
        for J_t, g_t in zip(rates.J[::-1], by_p[::-1], strict=True):  # one by one, whatever steps come together
            J, gradient = J + J_t, gradient + g_t
        left = max(left, norm(problem.rows(t_0, states, p)))
    by = problem.initial_by(p)
    gradient = gradient if by is None else gradient + by.T @ mu
    model.tally.count("transposed_solves")
    model.tally.count("residuals")
    return Result(float(J), gradient, residual=left / (march.scale or 1.0))
