"""Loosely solved objectives: a plateau that is the solver's is told from one that is the gradient's."""

from __future__ import annotations

import numpy as np
import pytest
from objectives import boom

from gradient_routes import check
from gradient_routes.problems.problem import Array


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
    assert "the gradient is right, J is solved loosely" in found.says
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
def test_a_warm_started_objective_does_not_make_a_right_gradient_wrong(tolerance: float) -> None:
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


def test_a_budget_too_small_to_tighten_is_undetermined() -> None:
    found = check(*loosely(1e-3), ROOTS, tighten=lambda factor: loosely(1e-3 * factor), budget=96)
    assert found.verdict == "undetermined"
    assert "was not tightened" in found.not_done[0]
    assert check(*loosely(1e-3), ROOTS, tighten=lambda factor: loosely(1e-3 * factor)).verdict == "solver-limited"


@pytest.mark.parametrize(
    ("tighten", "says"),
    [
        (lambda factor: 1 / 0, "ZeroDivisionError"),
        (lambda factor: None, "has no objective(p)"),
        (lambda factor: (boom, lambda p: p), "cannot be evaluated"),
        (lambda factor: (lambda p: 1.0, boom), "the gradient raises"),
    ],
)
def test_a_tighten_that_fails_is_said(tighten, says: str) -> None:
    found = check(*loosely(1e-4), ROOTS, tighten=tighten)
    assert found.verdict == "undetermined"
    assert says in found.not_done[0]
    assert found.todo.startswith("fix this first")


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
def test_a_tighten_that_does_little_does_not_make_a_gradient_wrong(tighter) -> None:
    found = check(cold(0.002), of_cold, [0.3], tighten=lambda k: (tighter(k), of_cold))
    assert found.verdict != "wrong-gradient"


def test_a_loose_solver_does_not_excuse_a_wrong_term() -> None:
    found = check(
        cold(0.3), lambda p: 1.1 * of_cold(p), [0.3], tighten=lambda k: (cold(0.3 * k), lambda p: 1.1 * of_cold(p))
    )
    assert found.verdict == "wrong-gradient"
