"""Judges: references that problems do not have of their own."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import relative_error
from duffing.problem import Duffing

from gradient_routes.bench.cases import registry
from gradient_routes.bench.execution.references import Judge, Judges
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.tangent import tangent

LOOSE, TIGHT = Solver(rtol=1e-3), Solver(rtol=1e-12, polish=2)


@pytest.mark.parametrize(("judged", "judge"), [(complex_step, tangent), (tangent, complex_step)])
def test_a_judge_is_solved_further_than_what_it_judges(judged, judge) -> None:
    problem = Duffing()
    p = problem.parameters.start
    exact = tangent.prepare(Model(problem, TIGHT), p)(p).gradient
    same = tangent.prepare(Model(problem, LOOSE), p)(p).gradient
    found = Judges(Model(problem, LOOSE), p, lambda route, n: None).judge(judged)
    assert isinstance(found, Judge)
    assert found.reference.name == judge.name
    assert registry.find("route", judge.name).load() is judge
    assert np.linalg.norm(same) > 0.0
    assert relative_error(found.reference.gradient, exact) < 0.1 * relative_error(same, exact)
