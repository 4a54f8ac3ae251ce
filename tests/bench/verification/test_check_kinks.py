"""Objectives with a kink at p or near it, and the active sets that tell of it."""

from __future__ import annotations

import numpy as np
import pytest
from objectives import J, P, dJ

from gradient_routes import check
from gradient_routes.problems.problem import Array
from gradient_routes.problems.transient import ActiveSteps


def kinked(p: Array) -> float:
    return float(np.abs(p).sum() + p[0] ** 2)


def kinked_gradient(p: Array) -> Array:
    return np.sign(p) + np.array([2.0 * p[0], 0.0, 0.0])


@pytest.mark.parametrize("distance", [0.0, 1e-14])
def test_a_kink_at_p_is_non_smooth(distance: float) -> None:
    found = check(kinked, kinked_gradient, np.array([1.0, distance, 2.0]), scale=np.ones(3))
    assert (found.verdict, found.exit_code) == ("non-smooth", 3)
    assert "converge to limits" in found.says


@pytest.mark.parametrize("distance", [1e-1, 1e-4, 1e-8])
def test_a_kink_nearby_is_none_at_p(distance: float) -> None:
    p = np.array([1.0, distance, 2.0])
    assert check(kinked, kinked_gradient, p, scale=np.ones(3)).verdict == "agrees"
    assert check(kinked, lambda p: 1.1 * kinked_gradient(p), p, scale=np.ones(3)).verdict == "wrong-gradient"


def test_a_kink_of_a_march_is_told_by_the_steps_that_flip() -> None:
    """Of 4: the second at the kink, the third a little beyond it, the others never."""

    def steps(p: Array) -> ActiveSteps:
        return ActiveSteps(["open", "1,2" if p[1] > 0.0 else "open", "1" if p[1] > 1e-9 else "open", "open"])

    found = check(kinked, kinked_gradient, np.array([1.0, 0.0, 2.0]), scale=np.ones(3), active_set=steps)
    assert found.verdict == "non-smooth"
    assert "; the active set of 2 steps flips inside the stencil of step" in found.says
    assert found.as_dict()["active_set_changes"] == 2
    assert str(steps(np.ones(2))) == "open to 1, 1,2 to 2, 1 to 3, open to 4"


def test_the_textbook_kink() -> None:
    found = check(lambda p: float(np.abs(p).sum()), np.sign, np.zeros(2))
    assert found.verdict == "non-smooth"
    assert "lies between the slopes" in found.todo


def test_a_gradient_outside_both_slopes_of_a_kink_is_wrong() -> None:
    found = check(kinked, lambda p: -7.0 * kinked_gradient(p) - 3.0, np.array([1.0, 0.0, 2.0]), scale=np.ones(3))
    assert found.verdict == "wrong-gradient"


def test_a_small_kink_hides_no_gross_mistake() -> None:
    found = check(lambda p: float(3e-5 * np.abs(p - 1.0).sum() + p @ p), lambda p: -2.0 * p, np.ones(300))
    assert found.verdict == "wrong-gradient"


def test_slowly_converging_quotients_do_not_make_a_gradient_wrong() -> None:
    found = check(
        lambda p: float((p**1.1).sum()), lambda p: 1.1 * p**0.1, np.array([0.0, 1.0, 2.0]), bounds=(0.0, np.inf)
    )
    assert found.verdict != "wrong-gradient"


@pytest.mark.parametrize("active_set", [lambda p: 1 / 0, lambda p: [1, 2], lambda p: None])
def test_an_active_set_that_fails_tells_nothing(active_set) -> None:
    assert check(J, dJ, P, active_set=active_set).verdict == "agrees"


def test_active_sets_are_asked_for_within_bounds() -> None:
    asked: list[float] = []
    found = check(
        lambda p: float((p**2).sum()),
        lambda p: 2.0 * p,
        np.ones(2),
        bounds=(1.0, 2.0),
        active_set=lambda p: asked.append(float(p.min())),
    )
    assert found.as_dict()["active_set_changes"] == 0
    assert asked
    assert min(asked) >= 1.0


def test_active_sets_tell_of_a_kink_that_quotients_see() -> None:
    found = check(
        kinked, kinked_gradient, np.array([1.0, 0.0, 2.0]), active_set=lambda p: tuple(p > 0), scale=np.ones(3)
    )
    assert found.verdict == "non-smooth"
    assert found.as_dict()["active_set_changes"] == 1
