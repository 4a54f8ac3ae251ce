"""The shares of the initial state and of the rates in dJ/dp, against closed forms: each alone, and one p in both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gradient_routes.problems.problem import Linearization, Offers, Parameters
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model

T, H, D = 5, 0.1, 0.2
RATE, HEIGHT = 2.0, 3.0  # where p is the other one


class Decay(Transient):
    """u_t = u_{t-1}/(1 + h r), J = 1/2 (u_T - d)^2; p is the rate r, the height u_0, or both at once."""

    name = "decay"
    offers = Offers.LINEARIZE
    linear = constant = True
    n_state = steps = T
    parameters = Parameters(start=np.array([1.5]), scale=np.ones(1))

    def __init__(self, *of: str) -> None:
        self.of_rate, self.of_height = "rate" in of, "height" in of

    def initial_state(self, p: Any, xp: Any = np) -> Any:
        return p[:1] if self.of_height else np.full(1, HEIGHT, p.dtype)

    def initial_by(self, p: Any) -> Any:
        return np.eye(1) if self.of_height else None

    def _growth(self, p: Any) -> Any:
        return 1.0 + H * (p[:1] if self.of_rate else RATE)

    def step_residual(self, t: Any, u: Any, v: Any, p: Any, xp: Any = np) -> Any:
        return self._growth(p) * u - v

    def step_tangent(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return np.eye(1) * self._growth(p)

    def step_coupling(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return -np.eye(1)

    def step_objective(self, t: Any, u: Any, p: Any, xp: Any = np) -> Any:
        return 0.5 * (u[0] - D) ** 2 if t == T else 0.0

    def step_linearize(self, t: int, u: Any, v: Any, p: Any) -> Linearization:
        return Linearization(H * u[:, None] * self.of_rate, (u - D) * (t == T), np.zeros(1))


@pytest.mark.parametrize("of", [("height",), ("rate",), ("height", "rate")])
def test_the_shares_are_their_closed_forms(of: tuple[str, ...]) -> None:
    """u_T = c (1 + h r)^-T: by c, (u_T - d) u_T/c; by r, -(u_T - d) u_T T h/(1 + h r)."""
    problem, p = Decay(*of), Decay.parameters.start
    c, r = p[0] if "height" in of else HEIGHT, p[0] if "rate" in of else RATE
    u = c * (1.0 + H * r) ** -T
    by_height = (u - D) * u / c if "height" in of else 0.0
    by_rate = -(u - D) * u * T * H / (1.0 + H * r) if "rate" in of else 0.0
    found = adjoint.prepare(Model(problem), p)(p)
    assert found.gradient == pytest.approx([by_height + by_rate], rel=1e-13)
    few = adjoint.prepare(Model(problem), p, checkpoint="sqrt")(p)
    assert few.initial == pytest.approx([by_height], rel=1e-13)
    shown = problem.view(p, found.u, found.lam).columns
    if "height" not in of:
        assert shown == {}
        return
    assert shown["by u_0"] == pytest.approx([by_height], rel=1e-13)
    assert shown["by rates"] == pytest.approx([by_rate], rel=1e-13, abs=1e-14)


def test_rows_and_tables_tell_the_shares_where_the_initial_state_depends_on_p(cli: Any) -> None:
    both, rates = "heat[n=2,steps=2,unknown=diffusivity+initial]", "heat[n=2,steps=2]"
    options = ("--route", "adjoint", "--no-timing", "--no-store")
    for row in cli("run", "--json", "--problem", both, "--route", "adjoint[checkpoint=sqrt]", *options).rows:
        assert (row["gradient_initial"][0], row["gradient_rates"][1]) == (0.0, 0.0)
        assert np.add(row["gradient_initial"], row["gradient_rates"]) == pytest.approx(row["gradient"], rel=1e-15)
    (row,) = cli("run", "--json", "--problem", rates, *options).rows
    assert row["gradient_initial"] is row["gradient_rates"] is None
    shown = cli("run", "--gradient", "--problem", both, *options).out
    assert " by u_0 " in shown
    assert " by rates" in shown
