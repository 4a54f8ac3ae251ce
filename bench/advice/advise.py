"""The route to take, and why."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from gradient_routes.bench.advice import stand_in
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.advice.bill import Bill, bills
from gradient_routes.bench.advice.changes import Change, changes
from gradient_routes.bench.advice.statements import (
    CHECKED,
    CHECKPOINTS,
    CORRECTED,
    KINKS,
    NOISE,
    Statement,
    of_route,
)
from gradient_routes.bench.execution.cost_model import summary
from gradient_routes.bench.render.format import ratio
from gradient_routes.bench.units import duration, size
from gradient_routes.routes.finite_difference import EPS

ALIKE = 1.1  # prices that no prediction tells apart
UNROLLED = 3.0  # of unrolled AD: its bill leaves out products with second derivatives, and JAX's own time for each


@dataclass(frozen=True)
class Advice:
    """ranked   bills, the best first: those of routes that are possible and exact enough by their price, then those of
                the others that are possible by their error, then those that are not
    best        the first; None where no route is possible
    reasons     why
    changes     what would change it
    """

    answers: Answers
    ranked: list[Bill]
    best: Bill | None
    reasons: list[Statement]
    changes: list[Change]

    @property
    def forward_s(self) -> float:
        """[s] of the forward solves alone, one for each gradient: the unit of `costs`."""
        return self.answers.gradients * stand_in.prices(self.answers).forward.wall

    def costs(self, bill: Bill) -> float:
        """In forward solves."""
        return bill.seconds / self.forward_s


def advise(answers: Answers) -> Advice:
    """The cheapest route whose expected error is small enough, the most exact where none is; of routes whose prices
    are ALIKE the one that holds least.
    """
    ranked = ranking(answers)
    return Advice(answers, ranked, _first(ranked), reasons(answers, ranked), changes(answers, recommended))


def recommended(answers: Answers) -> Bill | None:
    """The best bill alone."""
    return _first(ranking(answers))


def ranking(answers: Answers) -> list[Bill]:
    """Every bill, the best first."""
    ranked = sorted(bills(answers), key=lambda bill: _rank(bill, answers.error))
    best = _first(ranked)
    if best is None or best.error > answers.error:
        return ranked
    margin = UNROLLED if best.route.name == "unrolled-ad" else ALIKE
    alike = [
        b for b in ranked if b.objection is None and b.error <= answers.error and b.seconds < margin * best.seconds
    ]
    best = min(alike, key=lambda bill: bill.memory)
    return [best, *(bill for bill in ranked if bill is not best)]


def _first(ranked: Sequence[Bill]) -> Bill | None:
    return ranked[0] if ranked and ranked[0].objection is None else None


def _rank(bill: Bill, error: float) -> tuple[float, ...]:
    """Prices are told apart by three digits; of equal ones memory decides, then fewer options, then the error."""
    exact = bill.error <= error
    price = float(f"{bill.seconds:.2e}")
    equal = bill.memory, len(bill.options), bill.error
    return bill.objection is not None, not exact, 0.0 if exact else bill.error, price, *equal


def reasons(answers: Answers, ranked: Sequence[Bill]) -> list[Statement]:
    """Of the recommended route: what it is, what it costs beside others, what others lack."""
    best = _first(ranked)
    if best is None:
        return [Statement(bill.objection) for bill in ranked if bill.objection]
    return [
        of_route(best.route),
        *_variant(best),
        *_beside(answers, best, ranked),
        *_too_wrong(answers, best, ranked),
        *([] if answers.smooth else [KINKS]),
        CHECKED,
    ]


def _variant(best: Bill) -> Iterator[Statement]:
    if best.options.get("correct") == "yes":
        yield CORRECTED
    if "checkpoint" in best.options:
        yield CHECKPOINTS
    if "step" in best.options:
        yield replace(NOISE, text=f"{NOISE.text}: its best step is {best.options['step']:g}")


def _beside(answers: Answers, best: Bill, ranked: Sequence[Bill]) -> Iterator[Statement]:
    """The next of another name, where it is as exact."""
    others = [b for b in ranked if b.objection is None and b.route.name != best.route.name and b.error <= answers.error]
    if not others or best.error > answers.error:
        return
    other = others[0]
    times = other.seconds / best.seconds
    equal = "costs about the same" if 1.0 / ALIKE < times < ALIKE else f"costs {ratio(times)} times as much"
    keeps = f", and keeps {size(other.memory)}" if times < 1.0 < other.memory else ""
    unpriced = ", without JAX's own time and products with second derivatives" if times < 1.0 / ALIKE else ""
    yield Statement(f"{other.selector} {equal}: {summary(other.work)}{unpriced}{keeps}", (), "explanation/costs.md")


def _too_wrong(answers: Answers, best: Bill, ranked: Sequence[Bill]) -> Iterator[Statement]:
    """What is cheaper and not exact enough; that nothing is."""
    if best.error > answers.error:
        tighter = f": solve to less than {answers.rtol:g}" if answers.smooth and answers.rtol > EPS else ""
        said = f"no route that is possible is expected to be right to {answers.error:g}, this one to {best.error:.1g}"
        yield Statement(said + tighter, NOISE.sources, "explanation/unconverged-solves.md")
        return
    cheaper = [b for b in ranked if b.objection is None and b.error > answers.error and b.seconds < best.seconds]
    for other in sorted(cheaper, key=lambda b: b.seconds)[:1]:
        yield Statement(
            f"{other.selector} takes {duration(other.seconds)} and not {duration(best.seconds)}, but is off by about"
            f" {other.error:.1g}, more than {answers.error:g}",
            of_route(other.route).sources,
            of_route(other.route).page,
        )
