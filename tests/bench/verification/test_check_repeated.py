"""J and the gradient asked for again: what differs cannot be judged, whatever agrees."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes import check
from gradient_routes.problems.problem import Array

P = np.array([1.0, 2.0, 3.0])


def J(p: Array) -> float:
    return float(4.0 * p @ p)


class LastCall:
    """The gradient at the p of the last objective call."""

    start = P

    def objective(self, p: Array) -> float:
        self.p = p
        return J(p)

    def gradient(self, p: Array) -> Array:
        return 8.0 * self.p


class Accumulates(LastCall):
    total: Array = np.zeros(3)

    def gradient(self, p: Array) -> Array:
        self.total = self.total + 8.0 * p
        return self.total


class Alters:
    start, factor = P, 4.0

    def objective(self, p: Array) -> float:
        return float(self.factor * p @ p)

    def gradient(self, p: Array) -> Array:
        gradient = 2.0 * self.factor * p
        self.factor *= 1.01
        return gradient


class Drifts:
    """J depends on how far away it was asked for."""

    start, far = P, 0.0

    def objective(self, p: Array) -> float:
        self.far = max(self.far, float(np.abs(p - P).max()))
        return J(p) * (1.0 + 0.1 * self.far)

    def gradient(self, p: Array) -> Array:
        return 8.0 * p


@pytest.mark.parametrize(
    ("made", "says"),
    [
        (LastCall, "the gradient at p differs by"),
        (Accumulates, "the gradient at p differs by 1, relative"),
        (Alters, "when the gradient has been asked for"),
        (Drifts, "when J has been asked for elsewhere"),
    ],
)
def test_what_differs_is_said(made: type, says: str) -> None:
    found = check(made())
    assert (found.verdict, found.exit_code) == ("unrepeatable", 1)
    assert says in found.says
    assert found.culprit == "a state kept between calls"


@pytest.mark.parametrize(("moved", "verdict"), [(1e-5, "unrepeatable"), (1e-8, "agrees")])
def test_a_gradient_may_differ_by_what_counts_as_right(moved: float, verdict: str) -> None:
    calls = [0]

    def gradient(p: Array) -> Array:
        calls[0] += 1
        return 8.0 * p * (1.0 + moved * (calls[0] % 2))

    assert check(J, gradient, P).verdict == verdict


def test_a_recording_is_right_at_its_own_point_only() -> None:
    found = check(lambda p: float(np.exp(p).sum()), lambda p: np.exp(P), P)
    assert (found.verdict, found.exit_code) == ("wrong-gradient", 1)
    assert "the gradient is that at p" in found.says
    assert found.elsewhere.says == "plateau"
    assert any("at a point 5 % away it does not" in remark for remark in found.remarks)


def test_a_term_that_vanishes_at_p_is_missed_at_a_second_point() -> None:
    """The gradient of a penalty on the distance from the start was forgotten."""
    found = check(lambda p: J(p) + 100.0 * float((p - P) @ (p - P)), lambda p: 8.0 * p, P)
    assert found.verdict == "wrong-gradient"
    assert check(lambda p: J(p) + 100.0 * float((p - P) @ (p - P)), lambda p: 8.0 * p + 200 * (p - P), P).exit_code == 0


def test_a_right_gradient_has_a_line_of_its_own_at_the_second_point() -> None:
    found = check(J, lambda p: 8.0 * p, P)
    assert found.elsewhere.says == "agrees"
    assert found.elsewhere.name == "at a second point"


def test_the_second_point_stays_within_narrow_bounds() -> None:
    asked: list[Array] = []

    def watched(p: Array) -> float:
        asked.append(p)
        return J(p)

    lower, upper = P, P + np.array([1e-3, 1.0, np.inf])
    assert check(watched, lambda p: 8.0 * p, P, bounds=(lower, upper)).verdict == "agrees"
    assert all((q >= lower).all() and (q <= upper).all() for q in asked)


def test_a_point_that_cannot_tell_is_left() -> None:
    def bowl(p: Array) -> float:
        return float((p - P) @ (p - P))

    found = check(bowl, lambda p: 0.0 * p, P)
    assert found.verdict == "wrong-gradient"
    assert any(remark.startswith("J is stationary at p") for remark in found.remarks)
    found = check(bowl, lambda p: 2.0 * (p - P), P)
    assert found.verdict == "agrees"
    assert found.moved is not None


@pytest.mark.parametrize("budget", [20, 43, 60, 100, 240])
def test_a_small_budget_acquits_nobody_where_p_cannot_tell(budget: int) -> None:
    assert check(lambda p: float((p - P) @ (p - P)), lambda p: 0.0 * p, P, budget=budget).exit_code != 0


@pytest.mark.parametrize("budget", [60, 100, 140])
def test_calls_are_kept_for_the_second_point(budget: int) -> None:
    found = check(lambda p: float(np.exp(p).sum()), lambda p: np.exp(P), P, budget=budget)
    assert found.verdict == "wrong-gradient"
    assert found.calls <= budget


def test_a_gradient_of_zero_has_its_own_words() -> None:
    assert "nothing is connected to p" in check(J, lambda p: 0.0 * p, P).says


def test_a_fresh_J_shows_a_recording() -> None:
    """Objective and gradient replay the branch that held at p."""
    found = check(J, lambda p: 8.0 * p, P, fresh=lambda p: J(p) + float(np.maximum(0.0, np.abs(p - P)).sum()))
    assert found.verdict == "wrong-gradient"
    assert "recording" in (found.culprit or "")
    assert check(J, lambda p: 8.0 * p, P, fresh=J).verdict == "agrees"


def test_a_scaled_J_shows_an_absolute_tolerance() -> None:
    def scaled(factor: float):
        return (lambda p: factor * J(p)), (lambda p: factor * (8.0 * p + 1.0))

    found = check(J, lambda p: 8.0 * p, P, scaled=scaled)
    assert "absolute tolerance" in found.todo
    proportional = check(J, lambda p: 8.0 * p, P, scaled=lambda k: ((lambda p: k * J(p)), (lambda p: k * 8.0 * p)))
    assert proportional.todo == "use the gradient"
