"""Objectives with noise: what can still be decided, and that noise does not make a gradient wrong."""

from __future__ import annotations

import numpy as np
import pytest
from objectives import J, P, dJ, wrong

from gradient_routes import check
from gradient_routes.problems.problem import Array


def noisy(size: float, seed: int = 0):
    rng = np.random.default_rng(seed)
    return lambda p: J(p) * (1.0 + size * rng.standard_normal())


def test_the_noise_of_J_is_estimated_from_its_own_values() -> None:
    found = check(noisy(1e-8), dJ, P)
    assert found.verdict == "agrees"
    assert found.noise == pytest.approx(1e-8 * abs(J(P)), rel=0.7)  # of six values and running medians
    assert any("not deterministic" in remark for remark in found.remarks)


def test_noise_hides_no_large_mistake() -> None:
    found = check(noisy(1e-8), wrong(5, 3.0), P)
    assert found.verdict == "wrong-gradient"
    assert [w.index for w in found.located.worst] == [5]


def test_noise_that_leaves_no_step_is_inconclusive() -> None:
    found = check(noisy(1e-3), dJ, P)
    assert (found.verdict, found.exit_code) == ("noise-limited", 3)
    assert "too much to judge" in found.says


@pytest.mark.parametrize("seed", range(5))
def test_one_dead_point_decides_nothing(seed: int) -> None:
    """A value that is garbage now and then: one in fifty."""
    rng = np.random.default_rng(seed)

    def objective(p: Array) -> float:
        return J(p) * (1.5 if rng.random() < 0.02 else 1.0)

    found = check(objective, dJ, P)
    wanted = (
        ("agrees",) if found.noise < 1e-6 * abs(J(P)) else ("agrees", "noise-limited")
    )  # J(p) itself is one of them
    assert found.verdict in wanted


def test_components_alone_do_not_make_a_gradient_right() -> None:
    """Two of a thousand are clear of the noise, and the gradient is 0.2 % off everywhere."""
    size = np.where(np.arange(100) < 98, 1.0, 1e-6)
    rng = np.random.default_rng(0)
    found = check(
        lambda p: float((size * np.sin(p)).sum()) + 1e-3 * rng.standard_normal(),
        lambda p: 1.002 * size * np.cos(p),
        np.linspace(0.1, 1.0, 100),
    )
    assert found.verdict != "agrees"
