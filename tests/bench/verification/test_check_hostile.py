"""Code that raises, returns what is no number, prints, or changes what it was given."""

from __future__ import annotations

import numpy as np
import pytest
from objectives import J, N, P, boom, dJ

from gradient_routes import check
from gradient_routes.problems.problem import Array


def test_accidents_are_reported_with_their_point() -> None:
    found = check(lambda p: float(np.log(p).sum()), lambda p: 1.0 / p, np.array([1e-3, 1.0]), scale=np.ones(2))
    assert found.verdict == "agrees"
    assert any("points left out" in remark and "J = nan" in remark and "p_1 = " in remark for remark in found.remarks)


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
