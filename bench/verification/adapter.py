"""Another code, spoken to by its adapter, as the subject of a check: its own J against its own dJ/dp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gradient_routes.bench.verification.registered import tighter
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.foreign.command import Command
from gradient_routes.routes.foreign.foreign import Foreign, undescribed
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

SAME_J = 1e-6  # relative: more than loose solves leave in it


def subject(problem: Problem, command: Command, name: str, p: Array, solver: Solver) -> Subject:
    """J and dJ/dp by the adapter, its tolerances tightened where it says that it heeds them.

    Raises InputError for a problem that cannot be described, RoutesError where the adapter does not load it.
    """
    what = undescribed(problem)
    if what is not None:
        raise InputError(f"check: {what}")
    foreign, parameters = Foreign(command, name, problem), problem.parameters
    lower, upper = (np.broadcast_to(bound, p.shape) for bound in (parameters.lower, parameters.upper))

    def made(p: Array, solver: Solver) -> Subject:
        return Subject(
            name=f"{name} on {problem.name}",
            objective=lambda q: foreign.value(q, solver),
            gradient=lambda q: foreign.gradient(q, solver).gradient,
            p=p,
            scale=parameters.scale,
            lower=lower,
            upper=upper,
            closed=False,
            label=parameters.label,
            tighten=(lambda factor: made(p, tighter(solver, factor))) if foreign.tightens else None,
            again=lambda q: made(q, solver),
        )

    J, ours = foreign.value(p, solver), Model(problem, solver).value(p)
    if abs(J - ours) <= SAME_J * abs(ours):
        return made(p, solver)
    return replace(made(p, solver), notes=(f"J is {J:.9g}, ours on {problem.name} {ours:.9g}: another functional",))
