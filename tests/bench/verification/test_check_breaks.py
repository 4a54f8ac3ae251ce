"""J that jumps at p, has an infinite slope there, or goes in treads."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes import check
from gradient_routes.bench.verification.staircase import difference_noise
from gradient_routes.problems.problem import Array

P = np.array([0.3, 1.0])


@pytest.mark.parametrize("size", [1e-8, 1e-3, 1.0, 1e6])
@pytest.mark.parametrize("side", ["ahead", "behind"])
def test_a_jump_at_p_is_told_with_its_size_and_side(size: float, side: str) -> None:
    def J(p: Array) -> float:
        beyond = p[0] > 0.3 if side == "ahead" else p[0] < 0.3
        return float(p @ p + size * beyond)

    found = check(J, lambda p: 2.0 * p, P)
    assert (found.verdict, found.exit_code) == ("non-smooth", 3)
    assert f"a jump: J(p + h v) - J(p) tends to {size:.3g} " in found.says


@pytest.mark.parametrize("size", [1e-8, 1.0])
def test_a_jump_nearby_is_none_at_p(size: float) -> None:
    assert check(lambda p: float(p @ p + size * (p[0] > 0.31)), lambda p: 2.0 * p, P).verdict == "agrees"
    assert check(lambda p: float(p @ p + size * (p[0] > 0.31)), lambda p: -2.0 * p, P).verdict == "wrong-gradient"


@pytest.mark.parametrize("power", [0.3, 0.5, 0.7])
def test_an_infinite_slope_is_told(power: float) -> None:
    found = check(lambda p: float(abs(p[0]) ** power + p[1]), lambda p: np.array([0.0, 1.0]), [0.0, 1.0])
    assert found.verdict == "non-smooth"
    assert f"falls like h^{power:.2g}" in found.says


def test_an_active_set_decides_nothing() -> None:
    """A penalty of continuous slope, at its corner."""

    def J(p: Array) -> float:
        return float(0.5 * np.sum((p - 1.0) ** 2) + 5.0 * np.sum(np.maximum(0.0, p - 0.5) ** 2))

    def dJ(p: Array) -> Array:
        return p - 1.0 + 10.0 * np.maximum(0.0, p - 0.5)

    p, active = np.array([0.5, 0.9, 0.2]), lambda p: tuple(p > 0.5)
    assert check(J, dJ, p, active_set=active).verdict == "agrees"
    assert check(J, lambda p: -dJ(p), p, active_set=active).verdict == "wrong-gradient"


@pytest.mark.parametrize(
    "inside",
    [
        lambda p: float(np.sin(p.astype(np.float32)).sum(dtype=np.float32)),
        lambda p: float(np.sin(np.round(p, 9)).sum()),
        lambda p: float(np.sin(np.round(p, 6)).sum()),
    ],
)
def test_steps_smaller_than_a_tread_convict_nobody(inside) -> None:
    p = np.array([0.1, 0.5, 0.9])
    found = check(lambda p: inside(p) + 0.5 * float(p @ p), lambda p: np.cos(p) + p, p)
    assert found.verdict in ("agrees", "noise-limited")
    within = check(lambda p: inside(p) + 0.5 * float(p @ p), lambda p: p, p)  # the slope within a tread
    assert within.verdict != "agrees"
    assert within.deciding is not None
    assert within.deciding.says == "plateau"


def test_a_single_parameter_in_treads_is_judged_like_several() -> None:
    def J(p: Array) -> float:
        return float(np.sin(np.round(p, 9)).sum() + 0.5 * p @ p)

    assert check(J, lambda p: np.cos(p) + p, [0.1]).verdict in ("agrees", "noise-limited")
    assert check(J, lambda p: p, [0.1]).verdict != "agrees"


def test_a_fine_but_smooth_J_is_no_staircase() -> None:
    def J(p: Array) -> float:
        return float(np.sum(p**2 + 1e-3 * np.sin(1e4 * p)))

    assert check(J, lambda p: 2.0 * p + 10.0 * np.cos(1e4 * p), P).verdict == "agrees"
    assert check(J, lambda p: 2.0 * p, P).verdict == "wrong-gradient"


def test_differences_tell_noise_from_a_kink_and_a_jump() -> None:
    t, rng = np.linspace(1.0, 1.01, 11), np.random.default_rng(0)
    assert 2e-7 < difference_noise(np.exp(t) + 1e-6 * rng.standard_normal(11)) < 3e-6
    for smooth_but_once in (0.0 * t, 1e-3 * np.maximum(0.0, t - 1.0042), 1e-3 * (t > 1.0042)):
        assert (difference_noise(np.exp(t) + smooth_but_once) or 0.0) < 1e-14  # rounding
    assert difference_noise(np.where(t > 1.005, np.nan, t)) is None
