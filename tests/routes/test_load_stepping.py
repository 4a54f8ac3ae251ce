"""Increments of the load: halved where a solve fails, not for ever, and enlarged where it succeeds."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array
from gradient_routes.routes.load_stepping import by_load_steps


class Load:
    """The state is the load; from state 0 an increment up to `first` succeeds, from others any."""

    def __init__(self, first: float) -> None:
        self.first, self.tried, self.reached = first, [], []

    def __call__(self, t: float, u: Array) -> Array:
        self.tried.append(t)
        if u[0] == 0.0 and t > self.first:
            raise NotConverged("too far", (1.0,))
        self.reached.append(t)
        return np.array([t])


@pytest.mark.parametrize("halvings", [1, 4, 8])
def test_increments_are_halved_down_to_one_of_256(halvings: int) -> None:
    load = Load(0.5**halvings)
    assert by_load_steps(load, np.zeros(1), "test") == [1.0]
    assert load.tried[:halvings] == [0.5**k for k in range(1, halvings + 1)]
    assert load.reached[0] == 0.5**halvings


def test_smaller_increments_are_given_up_with_the_load_that_was_reached() -> None:
    load = Load(0.5**9)
    with pytest.raises(NotConverged, match=r"test: 0 % of the load reached, then too far") as caught:
        by_load_steps(load, np.zeros(1), "test")
    assert len(load.tried) == 8
    assert caught.value.history == (1.0,)


def test_increments_grow_by_half_after_a_success() -> None:
    load = Load(0.125)
    by_load_steps(load, np.zeros(1), "test")
    assert np.diff([0.0, *load.reached]) == pytest.approx([0.125, 0.1875, 0.28125, 0.40625])
