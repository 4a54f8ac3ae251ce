"""The impact block: its motion against an integrator that is not ours, laws of mechanics, gradients by every route."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import ROUTES, relative_error
from scipy.integrate import solve_ivp

from gradient_routes.bench.verification.contract import of_problem
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.impact_block import ImpactBlock
from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

COLUMN: dict[str, Any] = {"nx": 1, "ny": 1, "nz": 2, "steps": 4, "dt": 0.15, "velocity": "0.3"}
STOPS: dict[str, dict[str, Any]] = {
    "softplus": {"stop": "softplus", "width": 0.02},
    "penalty": {"stop": "penalty"},
}


def made(**options: Any) -> ImpactBlock:
    return with_synthetic_data(ImpactBlock(**COLUMN | options))


def thrown(**options: Any) -> ImpactBlock:
    """Where no data are asked for."""
    block = ImpactBlock(**COLUMN | options).twin()
    assert block is not None
    return block


def solved(block: ImpactBlock) -> tuple[Any, Any]:
    """Displacements and velocities (T + 1, n)."""
    p = block.parameters.start
    return block.history(Model(block).solve(p).u, p)


def moved(block: ImpactBlock, v: Any) -> Any:
    """M v of every row."""
    return np.stack([block.M @ one for one in v])


def test_every_route_gives_the_gradient_of_complex_steps_at_the_declared_work(cli) -> None:
    """Of the smooth law the guide shows them. The second derivative of the quadratic law jumps: 1e-10."""
    selector = "impact-block[n=1,steps=3,dt=0.15,velocity=0.4,stop=quadratic,width=0.02,alpha=0.1]"
    rows = cli("run", "--json", "--no-store", "--no-timing", "--problem", selector, "--route", "all").rows
    accuracy = {route.name: route.accuracy or 1e-10 for route in ROUTES}
    assert accuracy.keys() == {row["route"].partition("[")[0] for row in rows}
    for row in rows:
        assert row["gradient_error"] < accuracy[row["route"].partition("[")[0]], row["route"]
        assert row["work"] == row["predicted_work"], row["route"]


@pytest.mark.parametrize("stop", ["softplus", "penalty"])
def test_gradients_of_constants_hold(stop: str) -> None:
    """Of the penalty no node is within rounding of a kink."""
    block = made(mass="lumped", unknown="constants", **STOPS[stop])
    model, p = Model(block, Solver(rtol=1e-14)), block.parameters.start
    exact = complex_step.prepare(model, p)(p).gradient
    for route in (tangent, adjoint):
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12, route.name


def test_checkpoints_change_steps_not_the_gradient() -> None:
    block, found = made(), {}
    p, steps = block.parameters.start, {"all": 4, "sqrt": 5, "none": 7}
    for checkpoint, count in steps.items():
        model = Model(block)
        found[checkpoint] = adjoint.prepare(model, p, checkpoint=checkpoint)(p)
        assert model.tally.work.steps == count
        assert np.array_equal(found[checkpoint].gradient, found["all"].gradient)
    assert relative_error(found["all"].gradient, adjoint.prepare(Model(block), p)(p).gradient) < 1e-12


@pytest.mark.parametrize("element", ["hex8", "tet4", "tet10"])
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_a_throw_is_rigid_until_it_touches_and_has_all_the_mass(element: str, mass: str) -> None:
    """Along x besides, which the plane does not change; momentum is rho V v."""
    block = thrown(
        velocity="0.1,0,-0.3", stop="penalty", element=element, mass=mass, size="1,1,2", density=3.0, steps=2, dt=0.1
    )
    u, v = solved(block)
    still = u[:2].reshape(2, -1, 3)
    np.testing.assert_allclose(still[1], np.broadcast_to([0.01, 0.0, -0.03], still[1].shape), atol=1e-15)
    momentum = moved(block, v).reshape(3, -1, 3).sum(axis=1)
    np.testing.assert_allclose(momentum[:2], np.broadcast_to(6.0 * np.array([0.1, 0.0, -0.3]), (2, 3)), atol=1e-14)
    assert momentum[2, 0] == pytest.approx(0.6, rel=1e-12)
    assert momentum[2, 2] > -1.8
    if mass == "lumped":
        assert (block.M.diagonal > 0.0).all()
        assert abs(block.M.full()).sum() == pytest.approx(18.0, rel=1e-13)


def test_the_plane_changes_momentum_by_its_impulse_and_no_energy() -> None:
    """A linear body: half the sum of u.K u and v.M v, and of a linear spring while it is pressed."""
    block = thrown(law="linear", stop="penalty", steps=12, dt=0.1)
    p, (u, v) = block.parameters.start, solved(block)
    pressed = -np.stack([block.plane.forces(x) for x in u]).sum(axis=1)
    gained = np.diff(moved(block, v)[:, 2::3].sum(axis=1))
    np.testing.assert_allclose(gained, 0.05 * (pressed[1:] + pressed[:-1]), atol=1e-13)
    K = block.solid.tangent(0.0 * u[0], p)
    g = np.maximum(block.plane.penetration(u), 0.0)
    body = 0.5 * np.array([x @ (K @ x) for x in u]) + 0.5 * (v * moved(block, v)).sum(axis=1)
    total = body + 0.5 * block.plane.stop.law.k_c * (g**2 @ block.plane.area)
    touching = (g > 0.0).any(axis=1)
    assert 2 < touching.sum() < 12
    same = touching[1:] == touching[:-1]
    np.testing.assert_allclose(total[1:][same], total[:-1][same], rtol=1e-12)


def test_a_column_moves_as_a_fine_integrator_says() -> None:
    """One cell, squeezed along z alone by nu = 0: P = mu (F - 1/F), and masses of a third and a sixth, written out.

    SciPy's DOP853; the error falls by 4 for half the step.
    """
    k_c, w, gap, end, off = 30.0, 0.02, 0.05, 0.6, []
    M = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0

    def rate(t: float, z: Any) -> Any:
        F = 1.0 + z[1] - z[0]
        f = 0.5 * (F - 1.0 / F) * np.array([1.0, -1.0])
        f[0] += k_c * w * np.logaddexp(0.0, (-z[0] - gap) / w)
        return np.concatenate([z[2:], np.linalg.solve(M, f)])

    exact = solve_ivp(rate, (0.0, end), [0.0, 0.0, -0.3, -0.3], "DOP853", rtol=1e-10, atol=1e-12).y[:2, -1]
    for steps in (16, 32):
        options = {"nz": 1, "nu": 0.0, "k_c": k_c, "width": w}
        block = thrown(steps=steps, dt=end / steps, **options)
        u, _ = solved(block)
        z, height = u[-1].reshape(-1, 3)[:, 2], block.solid.mesh.geometry.X[:, 2]
        off.append(max(abs(z[height == 0.0] - exact[0]).max(), abs(z[height == 1.0] - exact[1]).max()))
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)
    assert off[1] < 1e-3


def test_its_contract_holds_as_a_march_and_as_a_step() -> None:
    """Traced, as the routes by automatic differentiation take it, only the step: they have the march above."""
    block = made(alpha=0.1)
    block.offers &= ~Offers.TRACE
    assert not of_problem(block, block.parameters.start + 0.1, [], Solver()).broken
    rng, p = np.random.default_rng(0), block.parameters.start
    z = 0.02 * rng.standard_normal((block.steps, 2 * block.n))
    rows = block.residual(z.ravel(), p).reshape(block.steps, -1)
    step, q = block.at(3), np.concatenate([z[1], p])
    np.testing.assert_allclose(step.residual(z[2], q), rows[2], atol=1e-15)
    traced = jax.jit(lambda u, v, p: block.step_residual(3, u, v, p, jnp))
    np.testing.assert_allclose(np.asarray(traced(z[2], z[1], p)), rows[2], atol=1e-14)
    lin, dq, dz = step.linearize(z[2], q), rng.standard_normal(len(q)), rng.standard_normal(2 * block.n)
    by_q = step.residual(z[2].astype(complex), q + 1e-30j * dq).imag / 1e-30
    np.testing.assert_allclose(lin.R_p @ dq, by_q, atol=1e-13)
    assert dz @ (lin.R_p @ dq) == pytest.approx((lin.R_p.T @ dz) @ dq, rel=1e-12)
    by_u = step.residual(z[2] + 1e-30j * dz, q.astype(complex)).imag / 1e-30
    np.testing.assert_allclose(step.tangent(z[2], q) @ dz, by_u, atol=1e-13)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"steps": 0}, "steps=0 - choose"),
        ({"dt": -0.1}, "dt=-0.1 - choose a finite dt > 0"),
        ({"dt": float("nan")}, "dt=nan"),
        ({"n": 2, "nx": None, "ny": None, "nz": None, "steps": 10**6}, "unknowns of all steps - at most 1e\\+08"),
        ({"sensors": "lid"}, "no boundary 'lid'"),
        ({"noise": -1.0}, "noise=-1"),
        ({"density": 0.0}, "density=0"),
        ({"velocity": "fast"}, "velocity=fast - give"),
        ({"velocity": "1,2"}, "velocity=1,2 - give"),
        ({"velocity": "-0.3"}, "velocity=-0.3 reaches no plane at gap=0.05 in 4 steps"),
        ({"stop": "penalty", "width": 0.1}, "width needs stop=softplus"),
        ({"nz": 0}, "impact-block: nz=0 - choose nz >= 1"),
        ({"layers": 2}, "layers needs unknown=layers"),
    ],
)
def test_bad_options_are_told(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        ImpactBlock(**COLUMN | options)
