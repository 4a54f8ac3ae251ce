"""The size of a stiffness that data tell: the one factor by which S u is as large as it was measured.

Under the same loads u(c E) = u_0 + u_1(E) / c as long as strains are small, u_0 being the part that known displacements
of the boundary cause without a load. With S u_1 = r and the data d - S u_0 = s, |r / c - s| is least at
c = <r, r> / <r, s>. Where displacements alone move the body, u does not change and forces are c F(E):
c = <r, s> / <r, r>.
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
EXTREME = 1e30  # times as stiff: loads move nothing, and so many times softer known displacements take no force
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

    One linear solve, two where both loads and displacements are known, and up to 12 forward solves of a nonlinear
    problem.
    """
    problem = model.problem
    c = small_strain_factor(model, p)
    if c is None or problem.linear:
        return c
    for _ in range(TRIES):
        q = problem.scaled(p, c)
        assert q is not None
        try:
            change = _factor(model, model.solve(q).u, q)
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
    if model.problem.scaled(p, 1.0) is None:
        return None
    try:
        return _factor(model, _linear(model, p), p)
    except OUTSIDE:
        return None


def _linear(model: Model, p: Array) -> Array:
    """One Newton step from u_0."""
    u = model.initial(p)
    factors = model.factorize(model.tangent(u, p))
    return u - model.solve_linear(factors, model.residual(u, p))


def _factor(model: Model, u: Array, p: Array) -> float | None:
    problem = model.problem
    seen = problem.observation(u, p)
    if seen is None:
        return None
    without: Array | float = 0.0
    if problem.drive != "load":
        q = problem.scaled(p, EXTREME if problem.drive == "load and displacement" else 1.0 / EXTREME)
        assert q is not None
        bare = problem.observation(u if problem.drive == "displacement" else _linear(model, q), q)
        assert bare is not None
        without = bare.predicted
    r, s = seen.predicted - without, seen.data - without
    size, along = float(r @ r), float(r @ s)
    if not (along > 0.0 and size > 0.0 and math.isfinite(size / along)):
        return None
    return along / size if problem.drive == "displacement" else size / along
