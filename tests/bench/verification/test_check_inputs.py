"""Start, bounds and scales as people give them: taken, or refused in one line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import Bounds

from gradient_routes import check
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array


def J(p: Array) -> float:
    return float(p @ p)


def dJ(p: Array) -> Array:
    return 2.0 * p


@pytest.mark.parametrize(
    ("keywords", "says"),
    [
        ({"start": [1 + 1j, 2.0]}, "start is complex"),
        ({"start": {"E": 1.0}}, "start is a dict"),
        ({"start": np.ones((2, 2))}, "ravel it"),
        ({"start": "abc"}, "no array of real numbers"),
        ({"start": [1.0, 2.0], "bounds": [(0.0, 1.5), (1.5, 4.0)]}, ""),
        ({"start": [1.0, 2.0], "bounds": [(0.0, 2.0), (1.0, 3.0)]}, "can be read as"),
        ({"start": [1.0, 2.0], "bounds": Bounds([1.0, 2.0], [1.0, 2.0])}, "every parameter is held"),
        ({"start": [1.0, 2.0], "bounds": Bounds([3.0, 0.0], [4.0, 4.0])}, "start inside"),
        ({"start": [1.0, 2.0], "bounds": 3}, "give (lower, upper)"),
        ({"start": [1.0, 2.0], "scale": [1.0, -1.0]}, "scale[1] = -1"),
    ],
)
def test_what_cannot_be_taken_is_refused(keywords: dict[str, Any], says: str) -> None:
    if not says:
        assert check(J, dJ, **keywords).verdict == "agrees"
        return
    with pytest.raises(InputError) as refused:
        check(J, dJ, **keywords)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "bounds",
    [
        (0.5, 3.0),
        (np.array([0.5, 1.0]), np.array([3.0, 4.0])),
        [(0.5, 3.0), (1.0, None)],
        Bounds([0.5, 1.0], [3.0, 4.0]),
    ],
)
def test_bounds_are_taken_in_each_form(bounds: Any) -> None:
    asked: list[Array] = []

    def watched(p: Array) -> float:
        asked.append(p)
        return J(p)

    assert check(watched, dJ, [1.0, 2.0], bounds=bounds).verdict == "agrees"
    assert min(q[0] for q in asked) >= 0.5


def test_a_parameter_with_equal_bounds_is_left_out() -> None:
    def wrong(p: Array) -> Array:
        return dJ(p) * [1.0, 5.0, 1.0]

    found = check(J, wrong, [1.0, 2.0, 3.0], bounds=[(0, 9), (2, 2), (0, 9)])
    assert found.verdict == "agrees"
    assert "held by equal bounds, left out: p_2" in found.remarks
    found = check(J, lambda p: dJ(p) * [1.0, 5.0, 2.0], [1.0, 2.0, 3.0], bounds=[(0, 9), (2, 2), (0, 9)])
    assert [(w["name"], w["index"]) for w in found.as_dict()["worst_components"]] == [("p_3", 2)]


def test_a_J_without_a_value_does_not_blame_the_gradient() -> None:
    def never(p: Array) -> Array:
        raise AssertionError("not asked for")

    found = check(lambda p: float("nan"), never, [1.0, 2.0])
    assert (found.verdict, found.todo) == ("undetermined", "start where J is defined")


@pytest.mark.parametrize("modulus", [2.1e11, 2.1e-9])
@pytest.mark.parametrize("wrong", [1.0, -1.0])
def test_a_parameter_that_starts_at_0_gets_the_scale_to_which_J_responds(modulus: float, wrong: float) -> None:
    """An offset of displacements beside a modulus."""
    force = modulus * 1e-3

    def misfit(p: Array) -> float:
        return 0.5 * (p[1] + force / p[0] - 2e-3) ** 2

    def gradient(p: Array) -> Array:
        return (p[1] + force / p[0] - 2e-3) * np.array([-wrong * force / p[0] ** 2, 1.0])

    found = check(misfit, gradient, [modulus, 0.0])
    assert found.verdict == ("agrees" if wrong == 1.0 else "wrong-gradient")
    assert any(remark.startswith("p_2 starts at 0: a natural change of 5e-05 was") for remark in found.remarks)
