"""What `routes vcurve` judges: difference quotients at every step, along components and random directions."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from gradient_routes.bench.cases.foreign_output import stdout_to_stderr
from gradient_routes.bench.cases.study import Say
from gradient_routes.bench.execution.cost_model import price_of
from gradient_routes.bench.studies.check.conclude import conclude, page_writable
from gradient_routes.bench.studies.options import one_route, problem_at
from gradient_routes.bench.units import duration
from gradient_routes.bench.verification.check import check
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.registered import subject
from gradient_routes.problems.errors import InputError, NotConverged, SingularMatrix
from gradient_routes.routes.newton import Solver

LONGEST = 12  # digits of a number that are read
FEW = 3  # components, where nobody says how many


def run(
    say: Say,
    *,
    selector: str,
    route: str,
    at: str,
    components: str | None,
    directions: int,
    steps: tuple[float, float],
    per_decade: int,
    budget: float,
    solver: Solver,
    seed: int,
    html: Path | None,
    kept: Path | None,
) -> int:
    spec = one_route(route)
    made, p = problem_at(selector, at)
    few: int | tuple[int, ...] = FEW if made.typical is None else (made.typical,)
    few = few if components is None else _components(components, len(p))
    plan = Plan(*steps, per_decade, few, directions, everywhere=True, budget=float("inf"), seed=seed)
    judged = subject(made, spec.route, spec.options, p, solver)
    with suppress(NotConverged, SingularMatrix):  # a solve that fails is part of the verdict
        _refuse_beyond(budget, price_of(lambda: judged.objective(p))[0].wall, plan)
    page_writable(html, kept, [selector, route, at])
    with stdout_to_stderr():
        found = check(judged, plan)
    return conclude(say, found, {"problem": selector, "route": route, "at": at}, html)


def _components(text: str, n_p: int) -> int | tuple[int, ...]:
    """A number of components, or their numbers from 1: 2,5..7."""
    numbers: list[int] = []
    for item in text.split(","):
        first, dots, last = item.strip().partition("..")
        if not first.isdecimal() or (dots and not last.isdecimal()):
            raise InputError(f"--components {text}: {item!r} is no number - write 3 (how many) or 2,5..7 (which)")
        start, stop = (int(number[:LONGEST]) for number in (first, last or first))
        if not 1 <= start <= stop <= n_p:
            raise InputError(f"--components {text}: there are 1 to {n_p} - choose among them")
        numbers += range(start, stop + 1)
    if "," not in text and ".." not in text:
        return numbers[0]
    return tuple(dict.fromkeys(i - 1 for i in numbers))


def _refuse_beyond(budget: float, seconds: float, plan: Plan) -> None:
    few = plan.components if isinstance(plan.components, int) else len(plan.components)
    calls = 2 * len(plan.steps) * (few + plan.directions)
    if calls * seconds > budget:
        raise InputError(
            f"vcurve: {calls} forward solves are predicted to take {duration(calls * seconds)} > --budget {budget:g} s"
            " - take fewer by --per-decade, --components, --directions or --steps, or --budget inf"
        )
