"""An inversion stops where the error that its solves leave in the gradient exceeds what is left of it."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.problems.bar import Bar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver


def inverted(rtol: float, route: str = "adjoint") -> Inversion:
    (problem,), (spec,) = case.problems(["bar"]), case.routes([route])
    return invert(problem, spec, Engine(solver=Solver(rtol, linear_solver="descent", adjoint_rtol=rtol)))


def exact(p: np.ndarray) -> np.ndarray:
    reference = Bar().reference(p)
    assert reference is not None
    return reference.gradient


@pytest.mark.parametrize("rtol", [1e-3, 1e-5])
def test_it_stops_at_its_error_bar(rtol: float) -> None:
    found = inverted(rtol)
    assert found.end.startswith("stopped: dJ/dp is less than the error that the solves leave in it, about ")
    assert found.end.endswith(f"(--rtol {rtol:g}) - tighten them")
    error = np.linalg.norm(found.gradient - exact(found.p))
    assert error > np.linalg.norm(found.gradient), "the gradient is hidden by its error, as it says"


def test_the_error_at_the_end_is_the_one_told() -> None:
    found = inverted(1e-3)
    told = float(found.end.split("about ")[1].split()[0]) * found.iterates[0].gradient_norm
    assert told == pytest.approx(np.linalg.norm(found.gradient - exact(found.p)), rel=0.5)


def test_tight_solves_converge() -> None:
    assert inverted(1e-13).end.startswith("converged")


def test_finite_differences_are_not_stopped_by_an_error_bar() -> None:
    assert not inverted(1e-3, "fd-central").end.startswith("stopped: dJ/dp is less")


def test_the_start_is_not_hidden() -> None:
    """A gradient that is all error is told at the first step already: here it is not."""
    model, p = Model(Bar(), Solver(1e-3, linear_solver="descent", adjoint_rtol=1e-3)), np.zeros(8)
    gradient = adjoint.function(model, p).gradient
    assert np.linalg.norm(gradient - exact(p)) < np.linalg.norm(gradient)
