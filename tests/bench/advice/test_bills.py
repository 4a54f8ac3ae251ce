"""Predicted bills against what is counted and measured."""

from __future__ import annotations

from dataclasses import replace

import pytest
from conftest import relative_error

from gradient_routes.bench.advice import stand_in
from gradient_routes.bench.advice.advise import ALIKE, advise
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.advice.bill import Bill, bills
from gradient_routes.bench.advice.memory import FLOAT
from gradient_routes.bench.studies.options import problem_at
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Result
from gradient_routes.routes.sensitivity import Sensitivity
from gradient_routes.routes.tally import Work

PROBLEMS = (
    "bar[n=6]",
    "bar[n=4,sensors=3,stop=softplus]",
    "advection[n=3]",
    "rod[n=4]",
    "vibrating-bar[n=3,steps=6]",
    "vibrating-bar[n=3,steps=6,stop=penalty]",
)
Case = tuple[Problem, Array, Answers]


@pytest.fixture(scope="module", params=PROBLEMS)
def case(request) -> Case:
    """Without JAX: nothing to compile."""
    problem, p = problem_at(request.param)
    answers = stand_in.measured(problem, p, Solver())
    return problem, p, replace(answers, offers=answers.offers & ~Offers.TRACE)


def possible(answers: Answers) -> dict[str, Bill]:
    return {bill.selector: bill for bill in bills(answers) if bill.objection is None}


def called(problem: Problem, p: Array, bill: Bill, solver: Solver | None = None) -> tuple[Work, Result]:
    """The counted work of one gradient, and the gradient."""
    model = Model(problem, solver)
    gradient = bill.route.prepare(model, p, **bill.options)
    before = model.tally.work
    result = gradient(p)
    return model.tally.work - before, result


def estimated(problem: Problem, bill: Bill) -> bool:
    """Whether its Newton steps are estimated until they are counted, from solves near by or in proportion to others."""
    more = bill.options.get("correct") == "yes" or bill.route.name == "complex-step"
    return bill.options.get("start") == "chord" or (more and not problem.linear)


def test_predicted_work_is_what_is_counted(case: Case) -> None:
    problem, p, answers = case
    found = possible(answers)
    assert len(found) >= 7
    for bill in found.values():
        work, _ = called(problem, p, bill)
        if estimated(problem, bill):
            assert (bill.work.forward_solves, bill.work.steps) == (work.forward_solves, work.steps), bill.selector
        else:
            assert bill.work == work, bill.selector


def test_the_recommended_route_is_the_cheapest_by_counted_work(case: Case) -> None:
    problem, p, answers = case
    best = advise(answers).best
    exact = [bill for bill in possible(answers).values() if bill.error <= answers.error]
    assert best is not None
    assert len(exact) >= 4
    prices = stand_in.prices(answers)
    seconds = {bill.selector: prices.seconds(called(problem, p, bill)[0]) for bill in exact}
    assert seconds[best.selector] <= ALIKE * min(seconds.values())


def test_errors_are_as_expected_on_the_bar() -> None:
    """Within the second derivatives and the rounding of J of a well-scaled problem, a factor of 1000 together."""
    problem, p = problem_at("bar[n=6]")
    reference = problem.reference(p)
    assert reference is not None
    answers = replace(stand_in.measured(problem, p, Solver()), offers=Offers.LINEARIZE | Offers.COMPLEX)
    errors = {
        s: relative_error(called(problem, p, bill)[1].gradient, reference.gradient)
        for s, bill in possible(answers).items()
    }
    for selector, bill in possible(answers).items():
        assert errors[selector] < 1e3 * bill.error
    assert errors["fd-one-sided"] > 1e-1 * possible(answers)["fd-one-sided"].error


@pytest.mark.parametrize("rtol", [1e-2, 1e-4])
def test_errors_of_loose_solves_are_as_expected(rtol: float) -> None:
    """By their size: what solves leave, and its square where that is corrected; R_u has a condition of 5."""
    problem, p = problem_at("bar[n=6,sensors=4,stop=softplus]")
    answers = stand_in.measured(problem, p, Solver(rtol=rtol))
    found = possible(answers)
    exact = adjoint.prepare(Model(problem), p)(p).gradient
    for selector in ("adjoint", "adjoint[correct=yes]"):
        error = relative_error(called(problem, p, found[selector], Solver(rtol=rtol))[1].gradient, exact)
        assert found[selector].error / 30 < error < 30 * found[selector].error


def test_a_jacobian_takes_a_solve_for_each_parameter_or_each_datum() -> None:
    problem, p = problem_at("bar[n=6,sensors=4]")
    answers = replace(stand_in.measured(problem, p, Solver()), outputs=4)
    for selector, rows in (("tangent", False), ("adjoint", True)):
        model = Model(problem)
        H = Sensitivity(model, model.solve(p))
        (H.by_rows if rows else H.by_columns)()
        assert possible(answers)[selector].work == model.tally.work


@pytest.mark.parametrize("selector", ["bar[n=4,sensors=3,stop=softplus]", "vibrating-bar[n=3,steps=6]"])
def test_the_work_made_up_for_a_problem_is_that_of_one(selector: str) -> None:
    problem, p = problem_at(selector)
    answers = stand_in.measured(problem, p, Solver())
    assert answers.measured is not None
    assert stand_in.cold(answers) == answers.measured.prices.declared.cold


def test_a_march_holds_the_states_that_are_counted() -> None:
    answers = Answers(steps=100, n_u=7, n_p=3)
    found = possible(answers)
    assert found["adjoint"].memory == FLOAT * 7 * 100
    assert found["adjoint[checkpoint=sqrt]"].memory == FLOAT * 7 * (20 + 2)  # 9 and an interval of 11; 2 beside
    assert found["adjoint[checkpoint=sqrt]"].work.steps == 100 + 81


def test_few_states_fit_into_little_memory() -> None:
    answers = Answers(steps=10_000, n_u=1000, memory=FLOAT * 1000 * 12.0)
    best = advise(answers).best
    assert best is not None
    assert best.selector == "adjoint[checkpoint=revolve=10]"
    assert best.memory == answers.memory


def test_a_tape_is_as_large_as_predicted() -> None:
    """Newton steps with their factors: what is kept beside is the end of the last and numbers."""
    problem, p = problem_at("bar[n=20,sensors=3,stop=softplus]")
    bill = next(b for b in bills(stand_in.measured(problem, p, Solver())) if b.route.name == "unrolled-ad")
    assert called(problem, p, bill)[1].tape == pytest.approx(bill.memory, rel=0.25)


@pytest.mark.parametrize(
    "wrong",
    [
        *({"n_p": 0}, {"n_u": 10**10}, {"outputs": 0}, {"steps": -1}, {"rtol": 0.0}, {"error": 1.0}, {"memory": -1.0}),
        *({"forward_s": float("nan")}, {"forward_s": float("inf")}, {"solve_s": 0.0}, {"offers": Offers.TRACE}),
    ],
)
def test_answers_out_of_range_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError, match=f"^advise: {next(iter(wrong))}"):
        Answers(**wrong)  # type: ignore[arg-type]
