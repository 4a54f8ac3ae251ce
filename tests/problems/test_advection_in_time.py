"""Advection in time: against its steady state and an integrator that is not ours; gradients by every route."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import ROUTES, relative_error
from scipy.integrate import solve_ivp

from gradient_routes.bench.verification.contract import of_problem
from gradient_routes.problems.advection import Advection
from gradient_routes.problems.advection_in_time import AdvectionInTime
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

VARIANTS: dict[str, dict[str, Any]] = {
    "diffusivity": {"parametrization": "raw", "alpha": 0.1},
    "source": {"unknown": "source", "sensors": "everywhere", "scheme": "crank-nicolson"},
    "initial": {"unknown": "initial", "alpha": 0.1},
}


def made(**options: Any) -> AdvectionInTime:
    return with_synthetic_data(AdvectionInTime(**{"n": 2, "steps": 4, "dt": 0.2} | options))


@pytest.mark.parametrize("name", VARIANTS)
def test_exact_routes_give_the_gradient_of_complex_steps(name: str) -> None:
    """Those by automatic differentiation on one variant; what they trace is held against NumPy on all: the contract."""
    problem = made(**VARIANTS[name])
    model, p = Model(problem), problem.parameters.start * np.array([1.0, 1.1, 0.9, 1.2])
    exact = complex_step.prepare(model, p)(p).gradient
    for route in ROUTES if name == "diffusivity" else (tangent, adjoint):
        found = route.prepare(model, p)(p)
        assert relative_error(found.gradient, exact) < (route.accuracy or 1e-12), route.name
    kept = adjoint.prepare(model, p, checkpoint="all")(p).gradient
    for checkpoint in ("none", "sqrt", "every=3", "revolve=2"):
        assert np.array_equal(adjoint.prepare(model, p, checkpoint=checkpoint)(p).gradient, kept), checkpoint
    assert not of_problem(problem, p, [], Solver()).broken


@pytest.mark.parametrize("unknown", ["diffusivity", "source"])
def test_it_ends_at_the_steady_state(unknown: Any) -> None:
    """After 20 crossings, by backward Euler."""
    march = AdvectionInTime(n=4, steps=40, dt=0.5, unknown=unknown).twin()
    steady = Advection(n=4, unknown=unknown, data="twin").twin()
    p = march.parameters.start
    u = Model(march).solve(p).u.reshape(40, -1)[-1]
    np.testing.assert_allclose(u, Model(steady).solve(p).u, rtol=1e-9)


@pytest.mark.parametrize(("scheme", "order"), [("backward-euler", 1.0), ("crank-nicolson", 2.0)])
def test_the_march_converges_to_that_of_a_fine_integrator(scheme: Any, order: float) -> None:
    """SciPy's DOP853 on M u' = f - R_u u, with the matrices of the stabilized method assembled by scikit-fem."""
    from skfem import Basis, BilinearForm, ElementQuad1
    from skfem.helpers import dot, grad

    first = made(unknown="initial", n=3)
    supg, kappa, p = first.supg, 0.05, first.truth()
    tau, b = float(supg.tau(kappa)), supg.b
    along = lambda v: b[0] * grad(v)[0] + b[1] * grad(v)[1]  # noqa: E731
    basis = Basis(supg.mesh, ElementQuad1())
    M = BilinearForm(lambda u, v, _: (v + tau * along(v)) * u).assemble(basis)
    K = BilinearForm(lambda u, v, _: kappa * dot(grad(v), grad(u)) + (v + tau * along(v)) * along(u)).assemble(basis)
    A = np.linalg.solve(*(X.toarray()[np.ix_(supg.free, supg.free)] for X in (M, K)))
    exact = solve_ivp(lambda t, u: -A @ u, (0.0, 0.3), first.field_at_start(p), "DOP853", rtol=1e-11, atol=1e-12).y[
        :, -1
    ]
    off = []
    for steps in (40, 80):
        march = AdvectionInTime(n=3, unknown="initial", steps=steps, dt=0.3 / steps, scheme=scheme).twin()
        off.append(np.abs(Model(march).solve(p).u.reshape(steps, -1)[-1] - exact).max())
    assert np.log2(off[0] / off[1]) == pytest.approx(order, abs=0.1)
    assert off[1] < (2e-2 if order == 1.0 else 1e-4)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"steps": 0}, "advection-in-time: steps=0 - choose"),
        ({"dt": 0.0}, "advection-in-time: dt=0.0 - choose dt > 0"),
        ({"n": 0}, "advection-in-time: n=0 cells"),
        ({"noise": -1.0}, "advection-in-time: noise=-1"),
        ({"n": 1000, "steps": 1000}, "1000 steps of 1000000 cells"),
    ],
)
def test_bad_options_are_told(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        AdvectionInTime(**options)
