"""The size of a stiffness that data tell: the one factor by which u at the sensors is as large as it was measured.

u(c E) = u(E) / c under the same loads, as long as strains are small; |S u / c - d| is least at
c = <S u, S u> / <S u, d>
"""

from __future__ import annotations

import copy
import math

from gradient_routes.problems.errors import OUTSIDE
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

NEAR = 0.01  # relative change of c that no longer matters to an optimizer
TRIES = 12  # solves for c at finite strain
STIFFER = 2.0  # where the body gives way under its load


def with_measured_start(problem: Problem, solver: Solver | None = None) -> Problem:
    """The problem from a start of the size that its data tell, where it asks for that, and a note of what it is."""
    if not problem.start_from_data:
        return problem
    c = fitted_factor(Model(problem, solver), problem.parameters.start)
    if c is None:
        other = copy.copy(problem)
        other.notes += ("the data do not point where the load does: they tell no size to start from, give modulus=",)
        return other
    other = problem.stiffened(c)
    said = f"start: a modulus of {c:.4g} Pa everywhere, fitted to the data"
    other.notes, other.read_as = (*other.notes, said), (*other.read_as, said)
    return other


def fitted_factor(model: Model, p: Array) -> float | None:
    """c, by linear elasticity, and where that does not hold by solves at c p until c stays; None where data tell none.

    One linear solve, and up to 12 forward solves of a nonlinear problem.
    """
    problem = model.problem
    c = small_strain_factor(model, p)
    if c is None or problem.linear:
        return c
    for _ in range(TRIES):
        q = problem.scaled(p, c)
        assert q is not None
        try:
            change = _factor(problem, model.solve(q).u, q)
        except OUTSIDE:
            change = STIFFER
        if change is None:
            return None
        c *= change
        if abs(math.log(change)) < NEAR:
            break
    return c


def small_strain_factor(model: Model, p: Array) -> float | None:
    """c of the body that is linearized at u_0; None where p sets no stiffness, or data tell no size."""
    problem = model.problem
    if problem.scaled(p, 1.0) is None:
        return None
    u = model.initial(p)
    try:
        factors = model.factorize(model.tangent(u, p))
        return _factor(problem, u - model.solve_linear(factors, model.residual(u, p)), p)
    except OUTSIDE:
        return None


def _factor(problem: Problem, u: Array, p: Array) -> float | None:
    """<S u, S u> / <S u, d>."""
    seen = problem.observation(u, p)
    if seen is None:
        return None
    size, along = float(seen.predicted @ seen.predicted), float(seen.predicted @ seen.data)
    return size / along if along > 0.0 and math.isfinite(size / along) and size > 0.0 else None
