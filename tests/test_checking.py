"""Verdicts on other people's code: right ones, wrong ones, noisy, kinked, hostile ones."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bench import assert_gradient, check
from bench.checking.check import check as check_subject
from bench.checking.curve import fit
from bench.checking.foreign import subject_of
from bench.checking.plan import Plan
from bench.checking.plateau import level
from bench.checking.result import Check
from bench.rows import clean
from problems.errors import InputError
from problems.problem import Array

N = 1000
A = np.random.default_rng(0).uniform(0.5, 2.0, N)
P = np.random.default_rng(1).uniform(0.2, 1.0, N)


def J(p: Array) -> float:
    return float(np.sum(A * np.sin(p) + 0.1 * p**3))


def dJ(p: Array) -> Array:
    return A * np.cos(p) + 0.3 * p**2


def wrong(index: object, factor: float):
    def gradient(p: Array) -> Array:
        g = dJ(p)
        g[index] *= factor
        return g

    return gradient


def noisy(size: float, seed: int = 0):
    rng = np.random.default_rng(seed)
    return lambda p: J(p) * (1.0 + size * rng.standard_normal())


# --- a black box of a thousand parameters


def test_a_right_gradient_of_a_thousand_parameters_costs_few_calls() -> None:
    found = check(J, dJ, P)
    assert (found.verdict, found.exit_code) == ("agrees", 0)
    assert found.calls <= 200
    assert found.gradients == 1
    line = found.deciding
    assert line.central.floor < 1e-9
    assert line.central.slope == pytest.approx(2.0, abs=0.1)
    assert line.one_sided.slope == pytest.approx(1.0, abs=0.1)
    assert line.central.roundoff == pytest.approx(-1.0, abs=0.2)  # noise: its slope scatters


@pytest.mark.parametrize(("index", "factor"), [(417, 2.0), (0, -1.0), (999, 0.0), (511, 1.01)])
def test_one_wrong_component_in_a_thousand_is_found(index: int, factor: float) -> None:
    found = check(J, wrong(index, factor), P)
    assert (found.verdict, found.exit_code) == ("wrong-gradient", 1)
    assert found.calls <= 200
    (worst,) = found.located.worst
    assert worst.index == index
    assert worst.factor == pytest.approx(factor, abs=1e-6)
    assert found.located.right == N - 1
    assert f"p_{index + 1}" in found.culprit


def test_three_wrong_components_are_found_within_the_budget() -> None:
    found = check(J, wrong([3, 417, 900], -1.0), P)
    assert {w.index for w in found.located.worst} == {3, 417, 900}
    assert found.located.right == N - 3
    assert found.calls <= 200


def test_a_factor_on_everything_is_called_by_its_name() -> None:
    found = check(J, wrong(slice(None), 2.0), P)
    assert found.verdict == "wrong-gradient"
    assert found.located.factor == pytest.approx(2.0)
    assert found.culprit == "the whole gradient, off by the factor 2"


def test_a_smaller_budget_says_less_and_says_so() -> None:
    found = check(J, wrong(417, 2.0), P, budget=50)
    assert found.calls <= 50
    assert found.verdict == "wrong-gradient"
    assert any("budget of 50 calls is spent" in remark for remark in found.remarks)


# --- noise


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
    assert "nothing can be told" in found.says


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


def test_float32_is_judged_as_float32() -> None:
    found = check(J, lambda p: dJ(p).astype(np.float32), P)
    assert found.verdict == "agrees"
    assert any("gradient is float32" in remark for remark in found.remarks)
    found = check(lambda p: np.float32(J(p)), dJ, P)
    assert found.verdict == "agrees"
    assert any("J has the precision of float32" in remark for remark in found.remarks)
    assert check(J, lambda p: 1.001 * dJ(p).astype(np.float32), P).verdict != "agrees"


X = np.linspace(0.1, 1.0, 10)


def sines(p: Array) -> float:
    return float(np.sin(p).sum())


@pytest.mark.parametrize(
    "objective",
    [
        lambda p: (1e6 + sines(p)) - 1e6,  # cancels
        lambda p: float(f"{sines(p):.5e}"),  # printed
        lambda p: round(sines(p), 8),
        lambda p: float(np.float16(sines(p))),
        lambda p: sines(p.astype(np.float32).astype(float)),  # p rounded
        lambda p: 1e16 + sines(p),  # drowned
    ],
)
def test_a_rounded_objective_convicts_no_right_gradient(objective) -> None:
    assert check(objective, np.cos, X).verdict in ("agrees", "noise-limited")
    assert check(objective, lambda p: -np.cos(p), X).verdict in ("wrong-gradient", "noise-limited")


def test_a_minimum_is_no_plateau() -> None:
    found = check(lambda p: float(np.sum(1.0 - np.cos(p - X))), lambda p: np.sin(p - X), X)
    assert found.verdict == "agrees"
    found = check(lambda p: float(np.cosh(p[0]) - 1.0), np.sinh, [1e-6], scale=1.0)
    assert found.verdict in ("agrees", "noise-limited")


@pytest.mark.parametrize("offset", [1e6, 1e9, 1e12])
def test_a_large_J_hides_a_sign_but_does_not_acquit_it(offset: float) -> None:
    found = check(lambda p: offset + 0.1 * sines(p), lambda p: -0.1 * np.cos(p), X)
    assert found.verdict in ("wrong-gradient", "noise-limited")


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_gradients_whose_squares_leave_float64(size: float) -> None:
    assert check(lambda p: size * sines(p), lambda p: size * np.cos(p), X).verdict == "agrees"
    wrong_one = np.where(np.arange(10) == 3, 1.5, 1.0)
    assert check(lambda p: size * sines(p), lambda p: size * wrong_one * np.cos(p), X).verdict == "wrong-gradient"


def test_float16_has_three_digits() -> None:
    assert check(sines, lambda p: np.cos(p).astype(np.float16), X).verdict == "agrees"
    assert check(sines, lambda p: (1.05 * np.cos(p)).astype(np.float16), X).verdict == "wrong-gradient"


def test_slowly_converging_quotients_convict_nobody() -> None:
    found = check(
        lambda p: float((p**1.1).sum()), lambda p: 1.1 * p**0.1, np.array([0.0, 1.0, 2.0]), bounds=(0.0, np.inf)
    )
    assert found.verdict != "wrong-gradient"


def test_small_components_are_looked_at_on_their_own() -> None:
    w, z = np.array([1.0, 1e-4, 1e-8, 1e-9]), np.array([1.0, 1.0, -1.0, 1.0])
    found = check(lambda p: float(w @ np.sin(p)), lambda p: z * w * np.cos(p), np.ones(4))
    assert found.verdict == "wrong-gradient"
    assert [x.index for x in found.located.worst] == [2]


def cold(tolerance: float):
    def objective(p: Array) -> float:
        u = 0.0
        for _ in range(60):
            if abs(u - np.exp(p[0])) <= tolerance:
                break
            u = 0.5 * (u + np.exp(p[0]))
        return float(u * u)

    return objective


def of_cold(p: Array) -> Array:
    return 2.0 * np.exp(2.0 * p)


@pytest.mark.parametrize("tighter", [lambda k: cold(0.002), lambda k: cold(0.002 * k**0.05)])
def test_a_tighten_that_does_little_convicts_nobody(tighter) -> None:
    found = check(cold(0.002), of_cold, [0.3], tighten=lambda k: (tighter(k), of_cold))
    assert found.verdict != "wrong-gradient"


def test_a_loose_solver_does_not_acquit_a_wrong_term() -> None:
    found = check(
        cold(0.3), lambda p: 1.1 * of_cold(p), [0.3], tighten=lambda k: (cold(0.3 * k), lambda p: 1.1 * of_cold(p))
    )
    assert found.verdict == "wrong-gradient"


def test_a_small_kink_hides_no_gross_mistake() -> None:
    found = check(lambda p: float(3e-5 * np.abs(p - 1.0).sum() + p @ p), lambda p: -2.0 * p, np.ones(300))
    assert found.verdict == "wrong-gradient"


# --- scales


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


def test_a_zero_component_has_a_scale_that_is_said() -> None:
    found = check(lambda p: float(p[0] ** 2), lambda p: np.array([2 * p[0], 0.0]), np.ones(2))
    assert found.verdict == "agrees"
    assert any("relative to the whole gradient" in remark and "p_2" in remark for remark in found.remarks)


def test_a_zero_gradient_is_right_where_nothing_changes_and_wrong_where_something_does() -> None:
    assert check(lambda p: 5.0, lambda p: 0.0 * p, np.ones(3)).verdict == "agrees"
    assert check(lambda p: 5.0 + 1e-6 * p[0], lambda p: 0.0 * p, np.ones(3)).verdict == "wrong-gradient"
    assert check(lambda p: 0.0, lambda p: 0.0 * p, np.ones(3)).verdict == "agrees"


# --- kinks


def kinked(p: Array) -> float:
    return float(np.abs(p).sum() + p[0] ** 2)


def kinked_gradient(p: Array) -> Array:
    return np.sign(p) + np.array([2.0 * p[0], 0.0, 0.0])


@pytest.mark.parametrize("distance", [0.0, 1e-14])
def test_a_kink_at_p_is_non_smooth(distance: float) -> None:
    found = check(kinked, kinked_gradient, np.array([1.0, distance, 2.0]), scale=np.ones(3))
    assert (found.verdict, found.exit_code) == ("non-smooth", 3)
    assert "converge to numbers" in found.says


@pytest.mark.parametrize("distance", [1e-1, 1e-4, 1e-8])
def test_a_kink_nearby_is_none_at_p(distance: float) -> None:
    p = np.array([1.0, distance, 2.0])
    assert check(kinked, kinked_gradient, p, scale=np.ones(3)).verdict == "agrees"
    assert check(kinked, lambda p: 1.1 * kinked_gradient(p), p, scale=np.ones(3)).verdict == "wrong-gradient"


def test_the_textbook_kink() -> None:
    found = check(lambda p: float(np.abs(p).sum()), np.sign, np.zeros(2))
    assert found.verdict == "non-smooth"
    assert "lies between the slopes" in found.todo


def test_a_gradient_outside_both_slopes_of_a_kink_is_wrong() -> None:
    found = check(kinked, lambda p: -7.0 * kinked_gradient(p) - 3.0, np.array([1.0, 0.0, 2.0]), scale=np.ones(3))
    assert found.verdict == "wrong-gradient"


@pytest.mark.parametrize("active_set", [lambda p: 1 / 0, lambda p: [1, 2], lambda p: None])
def test_an_active_set_that_fails_tells_nothing(active_set) -> None:
    assert check(J, dJ, P, active_set=active_set).verdict == "agrees"


def test_active_sets_are_asked_for_within_bounds() -> None:
    asked: list[float] = []
    check(
        lambda p: float((p**2).sum()),
        lambda p: 2.0 * p,
        np.ones(2),
        bounds=(1.0, 2.0),
        active_set=lambda p: asked.append(float(p.min())),
    )
    assert asked
    assert min(asked) >= 1.0


def test_active_sets_tell_of_a_kink_that_quotients_see() -> None:
    found = check(
        kinked, kinked_gradient, np.array([1.0, 0.0, 2.0]), active_set=lambda p: tuple(p > 0), scale=np.ones(3)
    )
    assert found.verdict == "non-smooth"
    assert found.as_dict()["active_set_changes"] == 1


# --- loosely solved objectives


def loosely(tolerance: float):
    """J = sum x^3 with x^2 = p by damped Newton steps that stop early; the gradient is that of the solution."""

    def solve(p: Array) -> Array:
        x = np.ones_like(p)
        for _ in range(200):
            if np.abs(x * x - p).max() <= tolerance:
                return x
            x = x - (x * x - p) / (4.0 * x)
        return x

    return (lambda p: float((solve(p) ** 3).sum())), (lambda p: 1.5 * np.sqrt(p))


ROOTS = np.array([2.0, 3.0])


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_a_plateau_that_falls_with_the_tolerance_is_the_solvers(tolerance: float) -> None:
    found = check(*loosely(tolerance), ROOTS, tighten=lambda factor: loosely(tolerance * factor))
    assert (found.verdict, found.exit_code) == ("solver-limited", 3)
    assert "the gradient is sound, J is loosely solved" in found.says
    assert found.tightened_plateau < 0.1 * found.plateau


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6])
def test_a_wrong_term_stays_when_the_solver_is_tightened(tolerance: float) -> None:
    def tightened(factor: float):
        objective, gradient = loosely(tolerance * factor)
        return objective, lambda p: 1.05 * gradient(p)

    found = check(*tightened(1.0), ROOTS, tighten=tightened)
    assert found.verdict == "wrong-gradient"
    assert found.tightened_plateau == pytest.approx(found.plateau, rel=0.5)  # less what was the solver's
    assert [w.factor for w in found.located.worst] == pytest.approx([1.05, 1.05], rel=2 * tolerance)


def test_a_small_plateau_without_a_way_to_tighten_is_undetermined() -> None:
    found = check(*loosely(1e-4), ROOTS)
    assert (found.verdict, found.exit_code) == ("undetermined", 3)
    assert "tighten(factor)" in found.todo


class Warm:
    """The same J, each solve starting where the last ended: what it gives depends on what was asked before."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance, self.x = tolerance, np.ones(2)

    def objective(self, p: Array) -> float:
        if (p <= 0.0).any():
            return float("nan")
        for _ in range(200):
            if np.abs(self.x**2 - p).max() <= self.tolerance:
                break
            self.x = self.x - (self.x**2 - p) / (4.0 * self.x)
        return float((self.x**3).sum())

    def gradient(self, p: Array) -> Array:
        return 1.5 * np.sqrt(p)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6])
def test_a_warm_started_objective_never_convicts_a_right_gradient(tolerance: float) -> None:
    warm = Warm(tolerance)
    found = check(warm.objective, warm.gradient, ROOTS)
    assert found.verdict in ("noise-limited", "undetermined", "agrees")
    warm = Warm(tolerance)
    found = check(warm.objective, warm.gradient, ROOTS, tighten=lambda factor: Warm(tolerance * factor))
    assert found.verdict in ("solver-limited", "agrees")


def test_an_objective_that_remembers_is_told() -> None:
    warm = Warm(1e-3)
    found = check(warm.objective, warm.gradient, ROOTS)
    assert any("does it start from the last" in remark for remark in found.remarks)


def test_a_budget_too_small_to_tighten_convicts_nobody() -> None:
    found = check(*loosely(1e-3), ROOTS, tighten=lambda factor: loosely(1e-3 * factor), budget=96)
    assert found.verdict == "undetermined"
    assert "was not tightened" in found.not_done[0]
    assert check(*loosely(1e-3), ROOTS, tighten=lambda factor: loosely(1e-3 * factor)).verdict == "solver-limited"


@pytest.mark.parametrize(
    ("tighten", "says"),
    [
        (lambda factor: 1 / 0, "ZeroDivisionError"),
        (lambda factor: None, "has no objective(p)"),
        (lambda factor: (boom, lambda p: p), "is not to be had"),
        (lambda factor: (lambda p: 1.0, boom), "the gradient raises"),
    ],
)
def test_a_tighten_that_fails_is_said(tighten, says: str) -> None:
    found = check(*loosely(1e-4), ROOTS, tighten=tighten)
    assert found.verdict == "undetermined"
    assert says in found.not_done[0]
    assert found.todo.startswith("mend this")


def test_what_is_tightened_keeps_its_bounds() -> None:
    asked: list[float] = []

    def tightened(factor: float):
        objective, gradient = loosely(1e-3 * factor)

        def watched(p: Array) -> float:
            asked.append(float(p.min()))
            return objective(p)

        return watched, gradient

    check(*tightened(1.0), ROOTS, bounds=(1.99, 4.0), tighten=tightened)
    assert min(asked) >= 1.99


def test_many_wrong_components_are_wrong_however_small_their_share() -> None:
    found = check(J, wrong(np.arange(0, 1000, 33), 2.0), P)
    assert found.verdict == "wrong-gradient"
    assert "at least" in found.says or "many components" in found.says


def test_a_factor_of_three_components_is_none_of_the_whole() -> None:
    factors = np.full(64, 0.7)
    p = np.linspace(0.2, 1.0, 64)
    order = np.argsort(-np.abs(np.cos(p) * p))
    factors[order[[0, 32, 63]]] = 1.3  # the ones looked at
    found = check(lambda p: float(np.sin(p).sum()), lambda p: factors * np.cos(p), p)
    assert found.verdict == "wrong-gradient"
    assert "the whole" not in found.culprit


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


# --- hostile code


def test_accidents_are_reported_with_their_point() -> None:
    found = check(lambda p: float(np.log(p).sum()), lambda p: 1.0 / p, np.array([1e-3, 1.0]), scale=np.ones(2))
    assert found.verdict == "agrees"
    assert any("points left out" in remark and "J = nan" in remark and "p_1 = " in remark for remark in found.remarks)


def boom(p: Array) -> float:
    raise ValueError("the mesh\nis gone")


@pytest.mark.parametrize(
    ("objective", "gradient", "verdict", "says"),
    [
        (boom, dJ, "undetermined", "ValueError: the mesh is gone"),
        (J, boom, "undetermined", "the gradient raises ValueError: the mesh is gone"),
        (lambda p: float("nan"), dJ, "undetermined", "J = nan"),
        (lambda p: "many", dJ, "undetermined", "not one real number"),
        (lambda p: np.ones(2), dJ, "undetermined", "shape (2,)"),
        (lambda p: 1j, dJ, "undetermined", "complex128"),
        (J, lambda p: dJ(p)[:-1], "wrong-gradient", "shape (999,) for 1000 parameters"),
        (J, lambda p: dJ(p) * 1j, "wrong-gradient", "complex128"),
        (J, lambda p: np.full(N, np.nan), "wrong-gradient", "1000 of 1000 components"),
        (J, lambda p: None, "wrong-gradient", "object"),
        (lambda p: exit(3), dJ, "undetermined", "SystemExit"),
    ],
)
def test_what_is_no_number_is_said(objective, gradient, verdict: str, says: str) -> None:
    found = check(objective, gradient, P)
    assert found.verdict == verdict
    assert says in found.says
    assert "\n" not in found.says


def test_an_objective_that_changes_p_gets_copies() -> None:
    def objective(p: Array) -> float:
        p *= 2.0
        return float((p**2).sum())

    start = np.ones(3)
    found = check(objective, lambda p: 8.0 * p, start)
    assert found.verdict == "agrees"
    assert (start == 1.0).all()
    assert any("changes p in place" in remark for remark in found.remarks)


def test_what_is_printed_stays_off_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    def objective(p: Array) -> float:
        print("iteration 1")
        return J(p)

    check(objective, dJ, P)
    assert capsys.readouterr().out == ""


def test_bounds_are_never_left() -> None:
    asked: list[Array] = []

    def objective(p: Array) -> float:
        asked.append(p.copy())
        return float(np.sqrt(p - 1.0 + 1e-2).sum())

    start = np.array([1.0, 2.0, 3.0])
    found = check(objective, lambda p: 0.5 / np.sqrt(p - 1.0 + 1e-2), start, bounds=(1.0, [3.0, 3.0, 3.0]))
    assert found.verdict == "agrees"
    assert all(((p >= 1.0) & (p <= 3.0)).all() for p in asked)
    assert any("on their bounds" in remark and "p_1" in remark for remark in found.remarks)
    found = check(objective, lambda p: 0.6 / np.sqrt(p - 1.0 + 1e-2), start, bounds=(1.0, 3.0))
    assert found.verdict == "wrong-gradient"


# --- what may be given, and how


class Model:
    start = np.array([0.3, 0.7])
    names = ("stiffness", "damping")

    def value_and_gradient(self, p: Array) -> tuple[float, Array]:
        return float(p[0] ** 2 * p[1]), np.array([2.0 * p[0] * p[1], p[0] ** 2])


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
def test_what_cannot_be_asked_is_one_line(arguments: dict, says: str) -> None:
    with pytest.raises(InputError) as caught:
        check(lambda p: float(p.sum()), lambda p: np.ones_like(p), **arguments)
    assert says in str(caught.value)
    assert " - " in str(caught.value)


@pytest.mark.parametrize("keyword", ["scale", "bounds", "names", "tighten", "active_set"])
def test_an_object_brings_its_own(keyword: str) -> None:
    with pytest.raises(InputError, match=f"brings its own {keyword}"):
        check(Model(), **{keyword: lambda factor: factor})


def test_a_gradient_of_differences_knows_no_more_than_J() -> None:
    """Its allowance for noise in J must not cover a J of a million."""
    subject = subject_of(type("O", (Model,), {}), "O")
    far = replace(subject, objective=lambda p: 1e6 + float(np.sin(p).sum()), gradient=np.zeros_like, accuracy=1e-5)
    assert check_subject(far, Plan()).verdict != "agrees"


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


# --- the parts


def test_a_level_is_the_limit_of_small_steps() -> None:
    """Quotients settle on 1 for large steps and on 2 for small ones: the derivative is 2."""
    h = 10.0 ** np.arange(-12, 0.1, 0.25)
    q = np.where(h < 1e-6, 2.0, 1.0) + 1e-12 / h * np.sin(np.arange(len(h)))
    found = level(h, q, 1e-13, 1e-3)
    assert found.value == pytest.approx(2.0, abs=1e-4)
    assert abs(found.value - 2.0) <= found.uncertainty


def test_no_level_without_points() -> None:
    h = 10.0 ** np.arange(-6.0, 0.0)
    assert level(h, np.full(6, np.nan), 0.0, 1.0) is None
    assert level(h, np.array([1.0, np.nan, np.nan, np.nan, np.nan, 1.0]), 0.0, 1.0) is None


@pytest.mark.parametrize("order", [1, 2, 4])
def test_slopes_and_floors_of_made_up_curves(order: int) -> None:
    h = 10.0 ** np.arange(-14.0, 0.1, 0.25)
    noise = 1e-15
    curve = fit(h, h**order + noise / h, noise)
    assert curve.slope == pytest.approx(order, abs=0.02)
    assert curve.roundoff == pytest.approx(-1.0, abs=0.02)
    best = (noise / order) ** (1.0 / (order + 1))
    assert abs(np.log10(curve.best_step / best)) < 0.3
    assert curve.floor < 2.0 * (best**order + noise / best)
