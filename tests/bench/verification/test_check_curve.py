"""The parts of a verdict: the level of a plateau, slopes and the floor of a curve."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.bench.verification.curve import fit
from gradient_routes.bench.verification.plateau import level


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
