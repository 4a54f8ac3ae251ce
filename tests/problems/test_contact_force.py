"""The force of a stop in series with a bar, to the last digits in float64: by the law, or by what the bar leaves."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.problems.contact import CompliantStop, ContactLaw, Quadratic, Softplus


def force(law: ContactLaw, C: float, number: type) -> float:
    """At k C < 1 by the law, from a g that is as good as g_0; at k C > 1 by g_0 - g, which is nearly all of g_0."""
    return CompliantStop(0.8, law).equilibrium(number(C) - number(0.8), number(C))[1]


@pytest.mark.parametrize(
    ("law", "C"),
    [
        (Softplus(1e3, 1e-2), 0.5),  # open, k C = 5e-11: by differences 5e-5 would be lost
        (Softplus(1e-3, 1e-2), 0.81),  # closed and soft, k C = 6e-4: 1e-13
        (Softplus(1e12, 1.0), 1e3),  # k C = 1e3: the law would lose 3e-15
        (Softplus(1e3, 1e-2), 0.81),  # k C = 6: the law would lose 6e-16
        (Quadratic(1e3, 1e-2), 0.81),  # k C = 39: the law would lose 6e-16
    ],
)
def test_the_force_in_series_is_found_the_better_way(law: ContactLaw, C: float) -> None:
    exact = force(law, C, np.longdouble)
    tolerance = 2e-15 if C < 0.8 else 2.3e-16
    assert abs(float((force(law, C, np.float64) - exact) / exact)) <= tolerance
