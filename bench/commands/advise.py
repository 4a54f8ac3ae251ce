"""`routes advise`: which route to take."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from gradient_routes.bench.advice import HAVE
from gradient_routes.bench.command_options import at_option, debug_option, refuse_given
from gradient_routes.bench.commands.group import FAILED
from gradient_routes.bench.ranges import FRACTION, MANY, SECONDS, Real
from gradient_routes.bench.sanitize import echo
from gradient_routes.bench.studies.options import problem_option
from gradient_routes.problems.errors import InputError, RoutesError

if TYPE_CHECKING:
    from gradient_routes.bench.advice.answers import Answers

TOLD = ("parameters", "unknowns", "steps", "newton_steps", "have", "kinks", "forward", "solve")  # by --problem
WANTED = ("outputs", "iterate", "error", "memory", "gradients", "budget")  # whatever the problem
OFFERS = (
    "What can be evaluated; may be repeated. value: J(p) alone; solve: R, R_u and J; linearize: their partial"
    " derivatives R_p, J_u, J_p as well; trace: R and J written in jax.numpy; complex: R and J take complex numbers."
)
LONG = Real(min=0.0, min_open=True, max=1e12, unit="seconds")
ITERATE = "The derivative of the last iterate is wanted, not that of the solution."
FORWARD = "A forward solve [s]."
SOLVE = "One more solve with R_u or its transpose [s]. [a twentieth of a Newton step; of a linear march, as it]"
RTOL = "|R| / |R_0| that solves leave; with --problem, that its forward solve is to reach."
MEMORY = "Memory at hand, as 4GiB or 500MB; none: no limit."
ERROR = "Relative error that the gradient may have."


@click.command()
@partial(problem_option, required=False)
@click.option("--parameters", type=MANY, default=100, show_default=True, metavar="N", help="n_p.")
@click.option("--outputs", type=MANY, default=1, show_default=True, metavar="M", help="1: dJ/dp; M: d(S u)/dp, M data.")
@click.option(
    "--unknowns", type=MANY, default=100_000, show_default=True, metavar="N", help="n_u, of one step in time."
)
@click.option("--steps", type=MANY, metavar="T", help="Steps in time. [a steady problem]")
@click.option(
    "--newton-steps", type=MANY, default=1, show_default=True, metavar="K", help="Of a solve; 1: R is linear."
)
@click.option("--have", type=click.Choice(HAVE), multiple=True, default=["linearize"], show_default=True, help=OFFERS)
@click.option("--kinks", is_flag=True, help="J has kinks near p: contact, plasticity, total variation.")
@click.option("--iterate", is_flag=True, help=ITERATE)
@click.option("--rtol", type=FRACTION, default=1e-12, show_default=True, help=RTOL)
@click.option("--error", type=FRACTION, default=1e-7, show_default=True, help=ERROR)
@click.option("--memory", default="8GiB", show_default=True, metavar="SIZE", help=MEMORY)
@click.option("--gradients", type=MANY, default=1, show_default=True, metavar="N", help="How many are computed.")
@click.option("--budget", type=SECONDS, default=math.inf, show_default=True, help="For all of them [s].")
@click.option("--forward", type=LONG, default=1.0, show_default=True, help=FORWARD)
@click.option("--solve", type=LONG, help=SOLVE)
@at_option
@click.option("--json", "as_json", is_flag=True, help="One JSON object and nothing else.")
@debug_option
def advise(selector: str | None, at: str, rtol: float, as_json: bool, **given: Any) -> None:
    """Recommend a route: the cheapest whose expected error is small enough, with its bill and the reasons.

    \b
    routes advise --parameters 5000 --newton-steps 6 --have linearize
    routes advise --parameters 4 --have value --forward 120 --budget 3600
    routes advise --problem 'block[n=6]'

    The bill is the declared work of every route, priced by a forward solve and a further linear solve. With --problem
    both are measured, and parameters, unknowns, steps and what is offered are those of the problem. Nothing is stored.

    What would change the answer is searched for: the nearest number of parameters, outputs, steps, and so on, at which
    another route is best.

    Exit code: 0 if a route is recommended, 1 if none is possible, 2 for wrong usage.
    """
    from gradient_routes.bench.advice.advise import advise as advised
    from gradient_routes.bench.advice.asked import answers_of
    from gradient_routes.bench.advice.wording import plain
    from gradient_routes.bench.cases.row import as_json as json_line
    from gradient_routes.bench.commands.advise_view import show
    from gradient_routes.bench.render.terminal.tables import console

    answers = answers_of(rtol=rtol, **given)
    if selector is None:
        refuse_given(("at",), "is a point of a --problem")
    else:
        refuse_given(TOLD, "is told by --problem")
        own = of_problem(selector, at, rtol)
        answers = replace(own, **{name: getattr(answers, name) for name in WANTED})
    advice = advised(answers)
    if as_json:
        echo(json_line(plain(advice)))
    else:
        show(console(), advice)
    if advice.best is None:
        raise click.exceptions.Exit(FAILED)


def of_problem(selector: str, at: str, rtol: float) -> Answers:
    """What a problem at p tells of itself. Raises InputError, and RoutesError where its process ends otherwise."""
    from gradient_routes.bench.cases.status import Status
    from gradient_routes.bench.execution.isolation.channel import Call
    from gradient_routes.bench.execution.isolation.limits import Limits
    from gradient_routes.bench.execution.isolation.messages import Returned
    from gradient_routes.bench.execution.isolation.run import stream

    *answers, end = stream(Call(measured_at, (selector, at, rtol)), Limits())
    if answers and isinstance(answers[0], Returned):
        found: Answers = answers[0].value
        return found
    raise (InputError if end.status is Status.REFUSED else RoutesError)(end.line("advise"))


def measured_at(selector: str, at: str, rtol: float) -> Answers:
    """The same in this process, by a few forward solves. Raises what the problem raises."""
    import numpy as np

    from gradient_routes.bench.advice.stand_in import measured
    from gradient_routes.bench.command_options import solver_of
    from gradient_routes.bench.studies.options import problem_at

    problem, p = problem_at(selector, at)
    with np.errstate(all="ignore"):
        return measured(problem, p, solver_of(rtol))
