"""What may be given to `check` and `assert_gradient`, how it may be wrong, and what comes back."""

from __future__ import annotations

import json

import numpy as np
import pytest
from objectives import J, Model, P, dJ, wrong

from gradient_routes import assert_gradient, check
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.verification.foreign import subject_of
from gradient_routes.bench.verification.result import Check
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array


@pytest.mark.parametrize("thing", [Model, Model(), lambda: Model()])
def test_an_object_a_class_or_a_factory_may_be_given(thing) -> None:
    assert check(thing).verdict == "agrees"


def test_names_are_used() -> None:
    class Wrong(Model):
        def value_and_gradient(self, p: Array) -> tuple[float, Array]:
            J, g = super().value_and_gradient(p)
            return J, g * [1.0, 2.0]

    found = check(Wrong)
    assert found.culprit == "component damping, off by the factor 2"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"start": [[1.0]]}, "shape (1, 1)"),
        ({"start": []}, "shape (0,)"),
        ({"start": [1.0, np.nan]}, "start[1] is NaN"),
        ({"start": [1.0, np.inf]}, "start[1] is not finite"),
        ({"start": ["a"]}, "no array of real numbers"),
        ({"start": [1.0], "scale": [0.0]}, "give scales > 0"),
        ({"start": [1.0], "scale": [1.0, 2.0]}, "give 1 of them"),
        ({"start": [1.0], "bounds": (2.0, 3.0)}, "outside its bounds 2 to 3"),
        ({"start": [1.0], "bounds": 3.0}, "give (lower, upper)"),
        ({"start": [1.0], "names": ["a", "b"]}, "2 names for 1 parameters"),
        ({"start": [1.0], "budget": 3}, "give at least 20"),
        ({"start": [1.0], "seed": -1}, "whole number >= 0"),
        ({"start": [1.0], "accept": 5.0}, "relative error >= 0 and < 1"),
        ({"start": [1.0], "accept": float("nan")}, "relative error >= 0 and < 1"),
        ({}, "no start"),
    ],
)
def test_a_wrong_argument_is_one_line(arguments: dict, says: str) -> None:
    with pytest.raises(InputError) as caught:
        check(lambda p: float(p.sum()), lambda p: np.ones_like(p), **arguments)
    assert says in str(caught.value)
    assert " - " in str(caught.value)


@pytest.mark.parametrize("keyword", ["scale", "bounds", "names", "tighten", "active_set"])
def test_an_object_brings_its_own(keyword: str) -> None:
    with pytest.raises(InputError, match=f"brings its own {keyword}"):
        check(Model(), **{keyword: lambda factor: factor})


def test_bounds_may_be_pairs_as_scipys_are() -> None:
    subject = subject_of(type("O", (Model,), {"bounds": [(0.0, None), (None, 1.0)]}), "O")
    assert subject.lower.tolist() == [0.0, -np.inf]
    assert subject.upper.tolist() == [np.inf, 1.0]


def test_assert_gradient_raises_with_the_sentence() -> None:
    assert_gradient(J, dJ, P)
    with pytest.raises(AssertionError, match=r"wrong-gradient: a plateau .* p_418"):
        assert_gradient(J, wrong(417, 2.0), P)


@pytest.mark.parametrize("gradient", [dJ, wrong(3, 2.0), lambda p: np.ones(3)])
def test_the_answer_as_json_has_all_its_keys(gradient) -> None:
    found: Check = check(J, gradient, P)
    keys = "verdict floor best_step slope_one_sided slope_central noise plateau tightened_plateau culprit"
    back = json.loads(json.dumps(clean(found.as_dict()), allow_nan=False))
    assert {*keys.split(), "worst_components", "calls"} <= back.keys()
    assert found.exit_code == {"agrees": 0, "wrong-gradient": 1}[found.verdict]
