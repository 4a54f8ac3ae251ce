"""Which route is recommended, and what would change that."""

from __future__ import annotations

from dataclasses import replace

import pytest

from gradient_routes.bench.advice.advise import advise, recommended
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.advice.changes import SCALES
from gradient_routes.bench.advice.wording import said
from gradient_routes.problems.problem import Offers

VALUE, SOLVE, LINEARIZE = Offers.VALUE, Offers.SOLVE, Offers.LINEARIZE
TRACED = SOLVE | Offers.TRACE
COMPLEX = SOLVE | Offers.COMPLEX
GIB = 2.0**30
# the decision procedure of docs/explanation/which-route.md
DECIDED = {
    "fd-central": [Answers(offers=VALUE), Answers(offers=VALUE, rtol=1e-10, error=1e-6)],
    "fd-one-sided": [
        Answers(offers=VALUE, error=1e-5),
        Answers(offers=VALUE, budget=150.0),
        Answers(offers=VALUE, smooth=False),
    ],
    "fd-central[start=chord]": [Answers(offers=SOLVE)],
    "complex-step": [Answers(offers=COMPLEX, error=1e-11), Answers(offers=COMPLEX, smooth=False)],
    "tangent": [Answers(n_p=1), Answers(n_p=3, outputs=50, newton=4), Answers(n_p=20, outputs=1000, smooth=False)],
    "adjoint": [
        Answers(),
        Answers(newton=6, n_p=10**6),
        Answers(offers=LINEARIZE | TRACED | COMPLEX),
        Answers(steps=1000, n_u=1000),
        Answers(n_p=1000, outputs=3),
        Answers(smooth=False, rtol=1e-9),
    ],
    "adjoint[correct=yes]": [Answers(rtol=1e-5), Answers(newton=5, rtol=1e-4, offers=LINEARIZE | TRACED)],
    "adjoint[checkpoint=sqrt]": [Answers(steps=1000, n_u=10**6, memory=GIB), Answers(steps=10_000, newton=3)],
    "adjoint[checkpoint=revolve]": [Answers(steps=1000, n_u=10**6, memory=0.2 * GIB)],
    "implicit-ad": [Answers(offers=TRACED), Answers(offers=TRACED, newton=5), Answers(offers=TRACED, rtol=1e-3)],
    "implicit-ad[checkpoint=sqrt]": [Answers(offers=TRACED, steps=1000, n_u=10**6, memory=GIB)],
    "unrolled-ad": [Answers(offers=LINEARIZE | TRACED, iterate=True, rtol=1e-2, newton=3)],
}


@pytest.mark.parametrize(("kind", "answers"), [(kind, one) for kind, many in DECIDED.items() for one in many])
def test_the_decision_procedure(kind: str, answers: Answers) -> None:
    best = recommended(answers)
    assert best is not None
    assert best.kind == kind


def beyond(answers: Answers, name: str, value: float, times: float) -> Answers:
    """The answers with another value of one of them, beyond `value` or on its near side."""
    if SCALES[name].whole:
        return replace(answers, **{name: round(value) + (1 if times > 1 else -1)})
    return replace(answers, **{name: value * times})


@pytest.mark.parametrize("answers", [many[-1] for many in DECIDED.values()], ids=DECIDED)
def test_thresholds_are_where_the_answer_changes(answers: Answers) -> None:
    advice = advise(answers)
    assert advice.best is not None
    numbers = [change for change in advice.changes if change.bound in ("at most", "at least")]
    for change in numbers:
        at = replace(answers, **{change.answer: change.value})
        best = recommended(at)
        assert best is not None
        assert best.kind == change.best.kind != advice.best.kind
        nearer = beyond(answers, change.answer, change.value, 1.15 if change.bound == "at most" else 1 / 1.15)
        before = recommended(nearer)
        assert before is None or before.kind != best.kind or nearer == at, said(change)


def test_break_even_of_tangent_and_adjoint_is_as_by_hand() -> None:
    """One solve for each parameter, or for each output: the tangent is best for no more parameters than outputs."""
    changes = {(c.answer, c.bound): c for c in advise(Answers(n_p=50, outputs=7)).changes}
    assert changes["n_p", "at most"].value == 7
    assert changes["outputs", "at least"].value == 50
    assert {changes["n_p", "at most"].best.kind, changes["outputs", "at least"].best.kind} == {"tangent"}


def test_memory_that_a_march_needs_is_as_by_hand() -> None:
    """8 n_u T bytes, to two digits: below, checkpoints."""
    answers = Answers(steps=1000, n_u=100_000)
    change = next(c for c in advise(answers).changes if c.answer == "memory")
    assert (change.bound, change.best.kind) == ("at most", "adjoint[checkpoint=sqrt]")
    assert change.value == pytest.approx(8e8, rel=0.02)
    assert change.value < 8e8


def test_differences_meet_their_budget_as_by_hand() -> None:
    """2 n_p solves of 3 s within 60 s: 10 parameters. One-sided ones, n_p + 1 solves, are not exact enough."""
    answers = Answers(n_p=100, offers=VALUE, forward_s=3.0, budget=60.0)
    advice = advise(answers)
    assert advice.best is None
    assert advice.reasons
    change = next(c for c in advice.changes if c.answer == "n_p")
    assert (change.value, change.best.kind) == (19, "fd-one-sided")
    few = advise(replace(answers, n_p=19))
    assert next(c for c in few.changes if c.answer == "n_p" and c.bound == "at most").value == 10


def test_what_more_could_be_offered_is_said_once() -> None:
    """Complex steps cost more than differences on factors at hand, which R and R_u alone allow."""
    advice = advise(Answers(offers=VALUE, n_p=30))
    gains = [said(c) for c in advice.changes if c.answer == "offers"]
    assert gains == [
        "with R(u, p), R_u and J(u, p) as numbers",
        "with the partial derivatives R_p, J_u, J_p",
        "with R and J written in jax.numpy",
    ]


@pytest.mark.parametrize(
    ("answers", "sources"),
    [
        (Answers(), {"Giles & Pierce 2000", "Plessix 2006", "Hinze et al. 2009"}),
        (Answers(offers=VALUE), {"Dennis & Schnabel 1996", "Moré & Wild 2011"}),
        (Answers(offers=COMPLEX, error=1e-11), {"Squire & Trapp 1998", "Martins et al. 2003"}),
        (Answers(rtol=1e-5), {"Pierce & Giles 2000", "Ablin et al. 2020"}),
        (Answers(steps=10_000, newton=3), {"Griewank & Walther 2000"}),
        (Answers(smooth=False), {"Clarke 1990"}),
    ],
)
def test_reasons_cite_their_sources(answers: Answers, sources: set[str]) -> None:
    assert sources <= {key for reason in advise(answers).reasons for key in reason.sources}


def test_a_route_that_is_cheaper_and_wrong_is_named() -> None:
    texts = " ".join(reason.text for reason in advise(Answers(offers=VALUE)).reasons)
    assert "fd-one-sided[step=1e-06] takes 1.68 min and not 3.33 min, but is off by about 1e-06" in texts


def test_it_is_said_where_no_route_is_exact_enough() -> None:
    advice = advise(Answers(offers=VALUE, error=1e-12))
    assert advice.best is not None
    assert advice.best.kind == "fd-central"
    assert any("expected to be right to 1e-12, this one to 1e-08" in reason.text for reason in advice.reasons)
