"""Bytes that grow with what a route keeps: states of a march, tapes, factors of steps, a Jacobian."""

from __future__ import annotations

import math

from gradient_routes.bench.advice.answers import Answers
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.backward_march import WHOLE
from gradient_routes.routes.checkpointing import Schedule
from gradient_routes.routes.route import Options, Route

FLOAT = 8  # [byte]
FILL = 35.0  # factors have about FILL n_u^(4/3) numbers in 3D: 36 on the block with 3630 unknowns
FEWEST = 2  # states: from one alone, all steps are marched again for every step
BESIDE = 2  # states before and after the step that is reversed


def held(answers: Answers, route: Route, options: Options, tape: int | None) -> float:
    """What comes on top of the factors of one forward solve and a few vectors (n_u,).

    tape  of AD, where the route predicts it
    """
    jacobian = FLOAT * answers.outputs * answers.n_p if answers.outputs > 1 else 0
    if route.name == "unrolled-ad":
        return jacobian + (iterates(answers, options) if tape is None else tape)
    if Offers.PARTIALS not in route.needs and Offers.TRACE not in route.needs:  # forward solves and nothing else
        return jacobian + FLOAT * answers.n_u * answers.steps * (Offers.SOLVE in answers.offers)
    states = marched(answers, str(options.get("checkpoint", WHOLE)))
    return jacobian + states + (FLOAT * (answers.n_u + answers.n_p) if Offers.TRACE in route.needs else 0)


def marched(answers: Answers, checkpoint: str) -> float:
    """Of a march that is linearized: the states that are kept; where it is one system all of them, and factors of every
    step unless one serves all.
    """
    if not answers.steps:
        return 0.0
    if checkpoint == WHOLE:
        return answers.steps * (FLOAT * answers.n_u + (0.0 if answers.linear else factors(answers)))
    kept = Schedule.of(checkpoint, answers.steps, "march").kept(answers.steps)
    return FLOAT * answers.n_u * (kept + BESIDE)


def iterates(answers: Answers, options: Options) -> float:
    """Newton steps on the tape: u, du and the factors of each, and p."""
    steps = max(1, answers.steps) * int(options["iterations"])
    return float(steps * (FLOAT * (2 * answers.n_u + answers.n_p) + factors(answers)))


def factors(answers: Answers) -> float:
    """Bytes of factors of R_u, of one step: measured, or those of a direct solver on a mesh in 3D."""
    known = answers.measured
    if known is not None and known.factors is not None:
        return float(known.factors / max(1, answers.steps))
    return float(FLOAT * FILL * answers.n_u ** (4.0 / 3.0))


def states_kept(answers: Answers) -> int | None:
    """States of a march that there is memory for, fewer than sqrt(T) checkpoints hold; None where these fit."""
    if not answers.steps or math.isinf(answers.memory) or marched(answers, "sqrt") <= answers.memory:
        return None
    room = answers.memory / (FLOAT * answers.n_u) - BESIDE
    return int(room) if room >= FEWEST else None
