"""Which components of a gradient of a thousand parameters are wrong, and within how many calls."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from objectives import J, N, P, dJ, wrong

from gradient_routes import check
from gradient_routes.bench.verification.examine import Examination
from gradient_routes.bench.verification.foreign import subject as foreign_subject
from gradient_routes.bench.verification.guarded import Guarded
from gradient_routes.bench.verification.locate import Search
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.plateau import Level
from gradient_routes.bench.verification.reading import Reading


def test_a_right_gradient_of_a_thousand_parameters_costs_few_calls() -> None:
    found = check(J, dJ, P)
    assert (found.verdict, found.exit_code) == ("agrees", 0)
    assert found.calls <= 240
    assert found.gradients == 3
    line = found.deciding
    assert line.central.floor < 1e-9
    assert line.central.slope == pytest.approx(2.0, abs=0.1)
    assert line.one_sided.slope == pytest.approx(1.0, abs=0.1)
    assert line.central.roundoff == pytest.approx(-1.0, abs=0.2)  # noise: its slope scatters


@pytest.mark.parametrize(("index", "factor"), [(417, 2.0), (0, -1.0), (999, 0.0), (511, 1.01)])
def test_one_wrong_component_in_a_thousand_is_found(index: int, factor: float) -> None:
    found = check(J, wrong(index, factor), P)
    assert (found.verdict, found.exit_code) == ("wrong-gradient", 1)
    assert found.calls <= 240
    (worst,) = found.located.worst
    assert worst.index == index
    assert worst.factor == pytest.approx(factor, abs=1e-6)
    assert found.located.right == N - 1
    assert f"p_{index + 1}" in found.culprit


def test_three_wrong_components_are_found_within_the_budget() -> None:
    found = check(J, wrong([3, 417, 900], -1.0), P)
    assert {w.index for w in found.located.worst} == {3, 417, 900}
    assert found.located.right == N - 3
    assert found.calls <= 240


def test_many_wrong_components_are_wrong_however_small_their_share() -> None:
    found = check(J, wrong(np.arange(0, 1000, 33), 2.0), P)
    assert found.verdict == "wrong-gradient"
    assert "at least" in found.says or "many components" in found.says


def test_a_factor_on_everything_is_called_by_its_name() -> None:
    found = check(J, wrong(slice(None), 2.0), P)
    assert found.verdict == "wrong-gradient"
    assert found.located.factor == pytest.approx(2.0)
    assert found.culprit == "the whole gradient, off by the factor 2"


def test_a_factor_of_three_components_is_none_of_the_whole() -> None:
    factors = np.full(64, 0.7)
    p = np.linspace(0.2, 1.0, 64)
    order = np.argsort(-np.abs(np.cos(p) * p))
    factors[order[[0, 32, 63]]] = 1.3  # the ones looked at
    found = check(lambda p: float(np.sin(p).sum()), lambda p: factors * np.cos(p), p)
    assert found.verdict == "wrong-gradient"
    assert "the whole" not in found.culprit


def test_a_smaller_budget_says_less_and_says_so() -> None:
    found = check(J, wrong(417, 2.0), P, budget=50)
    assert found.calls <= 50
    assert found.verdict == "wrong-gradient"
    assert any("budget of 50 calls allows no more, 4 lines were not sampled" in remark for remark in found.remarks)


@pytest.mark.parametrize(
    ("uncertainty", "accepted", "by_nature", "margin"),
    [(1e-3, 0.0, 0.0, 3e-3), (0.0, 1e-3, 0.0, 2e-3), (0.0, 0.0, 1e-3, 1e-3), (1e-4, 1e-3, 1e-3, 2e-3)],
)
def test_a_search_allows_what_noise_and_agreement_allow(
    uncertainty: float, accepted: float, by_nature: float, margin: float
) -> None:
    """The largest of 3 uncertainties, the accepted error of a gradient of size 2, and its error by nature."""
    subject = foreign_subject(lambda p: float(p.sum()), np.ones_like, np.ones(8))
    seen = Examination.of(subject, Plan(), Guarded(subject.objective))
    plateau = Reading(seen.read(seen.lines()[0], Plan().steps).quotients, 0.0, 2.0, accepted, by_nature)
    vars(plateau)["level"] = Level(1.0, uncertainty, 1e-3, 1e-2)
    for share, wrong_one in ((0.99, False), (1.01, True)):
        search = Search(seen, plateau)
        search.rng = SimpleNamespace(choice=lambda *_: np.ones(1), uniform=lambda *_: np.ones(1))
        search.gradient[3] += share * margin
        assert search.wrong(np.array([3])) is wrong_one
        assert not search.wrong(np.array([2]))
    assert not search.wrong(np.array([], dtype=int))


def test_small_errors_that_are_accepted_are_not_searched_for() -> None:
    p = np.linspace(0.2, 1.0, 64)
    factors = np.where(np.arange(64) == 40, 2.0, 1.0 + 5e-5)
    found = check(lambda p: float(np.sin(p).sum()), lambda p: factors * np.cos(p), p, accept=1e-3)
    assert ([w.index for w in found.located.worst], found.located.right) == ([40], 63)
