"""The contract of a march in time: one step against its equations, and the march against its steps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification.factors import DIFFERENCED, EXACT, Factors, along, relative
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.problems.problem import Array
from gradient_routes.problems.transient import Transient

EPS = 1e-13  # of sums of as many terms as there are steps, in another order


def of_steps(problem: Transient, u: Array, p: Array) -> Iterator[Finding]:
    """A step in the middle, by its own state and by q = (u_{t-1}, p); u_0 by p; rows and J of all steps."""
    states = np.stack([problem.initial_state(p), *u.reshape(problem.steps, -1)])
    t = (problem.steps + 1) // 2
    factors = Factors(problem.at(t), states[t], np.concatenate([states[t - 1], p]))
    for finding in factors.findings():
        yield replace(finding, name=f"step {t}: {finding.name}".replace("R_p", "R_q").replace("dR/dp", "dR/dq"))
    yield _initial(problem, p, factors.R.exact, factors.v[-len(p) :])
    ends = {1, t, problem.steps}
    rows = problem.residual(u, p).reshape(problem.steps, -1)
    each = [problem.at(t).residual(states[t], np.concatenate([states[t - 1], p])) for t in ends]
    yield Finding(
        "rows of the march are those of its steps", relative(rows[[t - 1 for t in ends]], np.stack(each)), EXACT
    )
    J = sum(problem.step_objective(t, states[t], p) for t in range(1, len(states))) + problem.phi(p)
    off = abs(float(problem.objective(u, p)) - float(J)) / (abs(float(J)) or 1.0)
    yield Finding("J = sum of all J_t + alpha Phi", off, max(EXACT, EPS * problem.steps))


def _initial(problem: Transient, p: Array, exact: bool, v: Array) -> Finding:
    """du_0/dp as it is given against u_0."""
    by, limit = problem.initial_by(p), EXACT if exact else DIFFERENCED
    given = np.zeros(problem.n_step) if by is None else np.asarray(by @ v)
    off = relative(given, along(problem.initial_state, p, v, exact))
    culprit = None if off <= limit else "du_0/dp" + (", which initial_by does not give" if by is None else "")
    return Finding("du_0/dp against u_0", off, limit, culprit=culprit)
