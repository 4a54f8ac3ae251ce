"""The contract of a march in time: it holds for the example of the guide, and names what a wrong one breaks."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gradient_routes.bench.verification.steps import of_steps

Front = runpy.run_path(str(Path(__file__).parents[3] / "examples" / "transient" / "front.py"))["Front"]


class NoInitial(Front):
    def initial_by(self, p: Any) -> None:
        return None


class WrongCoupling(Front):
    def step_coupling(self, t: int, u: Any, v: Any, p: Any) -> Any:
        return super().step_coupling(t, u, v, p) * 2.0


class OtherRows(Front):
    def residual(self, u: Any, p: Any) -> Any:
        R = super().residual(u, p).copy()
        R[0] += 1.0
        return R


class OtherSum(Front):
    def objective(self, u: Any, p: Any) -> Any:
        return 2.0 * super().objective(u, p)


@pytest.mark.parametrize(
    ("march", "broken"),
    [
        (Front, None),
        (NoInitial, "du_0/dp against u_0"),
        (WrongCoupling, "step 2: dR/dq against complex step of R"),
        (OtherRows, "rows of the march are those of its steps"),
        (OtherSum, "J = sum of all J_t + alpha Phi"),
    ],
)
def test_what_is_wrong_in_a_march_is_named(march: Any, broken: str | None) -> None:
    problem = march(n=5, steps=4)
    u = np.random.default_rng(0).uniform(0.1, 1.0, problem.n_state)
    found = {finding.name: finding.sound for finding in of_steps(problem, u, problem.parameters.start)}
    assert len(found) == 9
    assert [name for name, sound in found.items() if not sound] == ([broken] if broken else [])
