"""Components orders of magnitude apart, and zero ones: each is judged on its own scale."""

from __future__ import annotations

import numpy as np

from gradient_routes import check
from gradient_routes.bench.verification.table import rows
from gradient_routes.problems.problem import Array


def test_components_eighteen_orders_apart_are_judged_each_on_its_own_scale() -> None:
    def objective(p: Array) -> float:
        return float((p[0] - 1.0) ** 2 + (1e18 * p[1] - 2.0) ** 2)

    def gradient(p: Array, factor: float = 1.0) -> Array:
        return np.array([2.0 * (p[0] - 1.0), factor * 2e18 * (1e18 * p[1] - 2.0)])

    p = np.array([3.0, 1e-18])
    assert check(objective, gradient, p).verdict == "agrees"
    found = check(objective, lambda p: gradient(p, 2.0), p)
    assert found.verdict == "wrong-gradient"
    assert [(w.index, round(w.factor, 6)) for w in found.located.worst] == [(1, 2.0)]


def test_a_small_component_that_is_wrong_is_seen_beside_large_ones() -> None:
    found = check(lambda p: float(p[0] ** 2 + 1e-4 * p[1] + p[2]), lambda p: np.array([2 * p[0], 0.0, 1.0]), np.ones(3))
    assert found.verdict == "wrong-gradient"
    assert [w.index for w in found.located.worst] == [1]


def test_small_components_are_looked_at_on_their_own() -> None:
    w, z = np.array([1.0, 1e-4, 1e-8, 1e-9]), np.array([1.0, 1.0, -1.0, 1.0])
    found = check(lambda p: float(w @ np.sin(p)), lambda p: z * w * np.cos(p), np.ones(4))
    assert found.verdict == "wrong-gradient"
    assert [x.index for x in found.located.worst] == [2]


def test_a_component_that_J_does_not_depend_on_is_said() -> None:
    found = check(lambda p: float(p[0] ** 2), lambda p: np.array([2 * p[0], 0.0]), np.ones(2))
    assert found.verdict == "agrees"
    assert "J does not change with p_2" in found.remarks


def test_a_zero_gradient_is_undetermined_where_nothing_changes_and_wrong_where_something_does() -> None:
    """A solver whose absolute tolerance is met at once returns the same u for every p."""
    constant = check(lambda p: 5.0, lambda p: 0.0 * p, np.ones(3))
    assert (constant.verdict, constant.exit_code) == ("undetermined", 3)
    assert any("J did not change at all" in remark for remark in constant.remarks)
    assert check(lambda p: 5.0 + 1e-6 * p[0], lambda p: 0.0 * p, np.ones(3)).verdict == "wrong-gradient"
    assert check(lambda p: 0.0, lambda p: 0.0 * p, np.ones(3)).verdict == "undetermined"


def test_a_line_without_calls_is_not_sampled() -> None:
    found = check(lambda p: float(p @ p), lambda p: 2.0 * p, np.linspace(1.0, 2.0, 6), budget=64)
    cells = {reading.name: cells[1] for reading, cells in rows(found)}
    assert cells["random direction 1"] == "agrees"
    assert cells["random direction 2"] == "not sampled"
    assert not any("J did not change" in remark for remark in found.remarks)
