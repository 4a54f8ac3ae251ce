"""Answers from the options of `routes advise`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import reduce
from operator import or_

from gradient_routes.bench.advice import HAVE
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.execution.isolation.limits import memory_of
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Offers


def answers_of(
    *,
    parameters: int = 100,
    outputs: int = 1,
    unknowns: int = 100_000,
    steps: int | None = None,
    newton_steps: int = 1,
    have: Iterable[str] = ("linearize",),
    kinks: bool = False,
    iterate: bool = False,
    rtol: float = 1e-12,
    error: float = 1e-7,
    memory: str = "8GiB",
    gradients: int = 1,
    budget: float = math.inf,
    forward: float = 1.0,
    solve: float | None = None,
) -> Answers:
    """The answers that these options give. Raises InputError."""
    if unknown := [name for name in have if name not in HAVE]:
        raise InputError(f"--have {unknown[0]} - choose from {', '.join(HAVE)}")
    offers = reduce(or_, (Offers[name.upper()] for name in have), Offers.VALUE)
    room = memory_of(memory)
    return Answers(
        n_p=parameters,
        outputs=outputs,
        n_u=unknowns,
        steps=steps or 0,
        newton=newton_steps,
        offers=offers if offers == Offers.VALUE else offers | Offers.SOLVE,
        smooth=not kinks,
        iterate=iterate,
        rtol=rtol,
        error=error,
        memory=math.inf if room is None else room,
        gradients=gradients,
        budget=budget,
        forward_s=forward,
        solve_s=solve,
    )
