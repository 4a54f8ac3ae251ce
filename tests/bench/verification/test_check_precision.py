"""Rounded objectives and gradients are judged by the digits they have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from objectives import J, Model, P, X, dJ, sines

from gradient_routes import check
from gradient_routes.bench.verification.check import check as check_subject
from gradient_routes.bench.verification.foreign import subject_of
from gradient_routes.bench.verification.plan import Plan


def test_float32_is_judged_as_float32() -> None:
    found = check(J, lambda p: dJ(p).astype(np.float32), P)
    assert found.verdict == "agrees"
    assert any("gradient is float32" in remark for remark in found.remarks)
    found = check(lambda p: np.float32(J(p)), dJ, P)
    assert found.verdict == "agrees"
    assert any("J has the precision of float32" in remark for remark in found.remarks)
    assert check(J, lambda p: 1.001 * dJ(p).astype(np.float32), P).verdict != "agrees"


@pytest.mark.parametrize("objective", [J, lambda p: np.float32(J(p))])
@pytest.mark.parametrize("gradient", [dJ, lambda p: dJ(p).astype(np.float32)])
def test_float32_gets_the_hint_to_use_float64(objective, gradient) -> None:
    """Once, whichever side is float32, and not where neither is."""
    hints = [r for r in check(objective, gradient, P).remarks if "jax.config.update('jax_enable_x64', True)" in r]
    assert len(hints) == ((objective, gradient) != (J, dJ))
    assert all("dtype=torch.float64" in hint for hint in hints)


def test_a_float32_objective_that_hides_its_gradient_is_sent_to_float64() -> None:
    found = check(lambda p: np.float32(1e4 + 1e-3 * sines(p)), lambda p: 1e-3 * np.cos(p), X)
    assert found.verdict == "noise-limited"
    assert "jax_enable_x64" in found.todo


def test_float16_has_three_digits() -> None:
    assert check(sines, lambda p: np.cos(p).astype(np.float16), X).verdict == "agrees"
    assert check(sines, lambda p: (1.05 * np.cos(p)).astype(np.float16), X).verdict == "wrong-gradient"


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
def test_a_rounded_objective_does_not_make_a_right_gradient_wrong(objective) -> None:
    assert check(objective, np.cos, X).verdict in ("agrees", "noise-limited")
    assert check(objective, lambda p: -np.cos(p), X).verdict in ("wrong-gradient", "noise-limited")


def test_a_minimum_is_no_plateau() -> None:
    found = check(lambda p: float(np.sum(1.0 - np.cos(p - X))), lambda p: np.sin(p - X), X)
    assert found.verdict == "agrees"
    found = check(lambda p: float(np.cosh(p[0]) - 1.0), np.sinh, [1e-6], scale=1.0)
    assert found.verdict in ("agrees", "noise-limited")


@pytest.mark.parametrize("offset", [1e6, 1e9, 1e12])
def test_a_wrong_sign_beside_a_large_J_is_not_called_right(offset: float) -> None:
    found = check(lambda p: offset + 0.1 * sines(p), lambda p: -0.1 * np.cos(p), X)
    assert found.verdict in ("wrong-gradient", "noise-limited")


@pytest.mark.parametrize("size", [1e-200, 1e200])
def test_gradients_whose_squares_leave_float64(size: float) -> None:
    assert check(lambda p: size * sines(p), lambda p: size * np.cos(p), X).verdict == "agrees"
    wrong_one = np.where(np.arange(10) == 3, 1.5, 1.0)
    assert check(lambda p: size * sines(p), lambda p: size * wrong_one * np.cos(p), X).verdict == "wrong-gradient"


def test_a_gradient_of_differences_knows_no_more_than_J() -> None:
    """Its allowance for noise in J must not cover a J of a million."""
    subject = subject_of(type("O", (Model,), {}), "O")
    far = replace(subject, objective=lambda p: 1e6 + float(np.sin(p).sum()), gradient=np.zeros_like, accuracy=1e-5)
    assert check_subject(far, Plan()).verdict != "agrees"
