"""The horizon of gradients: smooth marches, chaos between two stops, jumps that slopes do not see."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gradient_routes.bench.cases.case import problems
from gradient_routes.bench.studies.horizon.measure import horizon, lengths, verdict

CHAOS = "vibrating-bar[n=3,steps=128,stop=penalty,stops=both,gap=0.05,k_c=1000]"


def marches(selector: str, **options: Any) -> Any:
    return horizon(problems([selector])[0], **options).marches


def test_lengths_double_up_to_the_whole_march() -> None:
    assert lengths(1) == [1]
    assert lengths(8) == [1, 2, 4, 8]
    assert lengths(60) == [1, 2, 4, 8, 16, 32, 60]


def test_slopes_of_a_smooth_march_are_the_quotient() -> None:
    """The midpoint rule over the interval: errors of second order in its length."""
    for march in marches("vibrating-bar[n=2,steps=16]", places=3):
        assert march.verdict == "smooth"
        assert march.flips is None
        assert march.slope_mean == pytest.approx(march.quotient, rel=1e-5)
        assert march.slope == pytest.approx(march.quotient, rel=1e-3)


def test_chaos_between_two_stops_makes_slopes_scatter() -> None:
    found = {march.steps: march for march in marches(CHAOS, places=4, spread=1e-2)}
    assert found[8].verdict == "smooth"
    assert found[128].verdict != "smooth"
    assert found[128].flips > 0
    assert found[128].slope_scatter > abs(found[128].quotient)


def test_what_slopes_say_of_a_quotient() -> None:
    rng = np.random.default_rng(0)
    assert verdict(1.0 + 0.01 * rng.standard_normal(12), 1.0) == "smooth"
    assert verdict(rng.standard_normal(12), 0.1) == "noisy"
    assert verdict(1.0 + 0.01 * rng.standard_normal(12), 1.5) == "biased"  # J jumps by half of what it rises
    assert verdict(np.zeros(3), 0.0) == "smooth"


def test_what_is_beyond_the_budget_or_has_no_step_is_told(cli) -> None:
    clock = iter(range(100))
    told = marches("vibrating-bar[n=1,steps=8]", places=2, budget=2.5, clock=lambda: next(clock))
    assert [march.status for march in told] == ["ok", "ok", "skipped", "skipped"]
    assert told[2].reason == "beyond the budget of 2.5 s"
    refused = cli("horizon", "--problem", "bar", "--no-store", "--no-plot")
    assert refused.code == 2
    assert "bar has no option steps - name a problem that marches in time" in refused.err


def test_the_command_prints_what_it_found(cli) -> None:
    done = cli("horizon", "--problem", "vibrating-bar[n=1,steps=4]", "--places", "2", "--no-store", "--no-plot")
    assert done.code == 0
    assert "smooth: at every T the gradient says what J does over the interval" in done.out
