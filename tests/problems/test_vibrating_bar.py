"""The vibrating bar: its motion against an integrator that is not ours, its steps, its gradients by every route."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import ROUTES, relative_error
from scipy.integrate import solve_ivp

from gradient_routes.problems.errors import DomainError, InputError
from gradient_routes.problems.vibrating_bar import GAP, VibratingBar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

SCHEMES = ("newmark", "backward-euler", "central-difference")
DAMPINGS: dict[str, dict[str, Any]] = {
    "none": {},
    "rayleigh": {"damping": "rayleigh", "c_m": 0.3, "c_k": 0.02},
    "skew": {"damping": "skew", "c_g": 2.0},
}


def made(**options: Any) -> VibratingBar:
    return with_synthetic_data(VibratingBar(**{"n": 4, "steps": 12, "dt": 0.1} | options))


def solved(bar: VibratingBar) -> tuple[Any, Any]:
    """Displacements and velocities (T, N)."""
    u = Model(bar).solve(bar.parameters.start).u.reshape(bar.steps, 2, bar.n)
    return u[:, 0], u[:, 1]


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize(("scheme", "order"), [*zip(SCHEMES, (2.0, 1.0, 2.0), strict=True)])
def test_the_motion_converges_to_that_of_a_fine_integrator(scheme: str, order: float, damping: str) -> None:
    """SciPy's DOP853 on M u'' + C u' + K u = f(t), whose matrices are written out here. Damping by the new velocity
    makes central differences first-order accurate."""
    n, end, off = 3, 1.2, []
    k, m = np.full(n, float(n)), np.array([1.0, 1.0, 0.5]) / n
    B = np.eye(n) - np.eye(n, k=-1)
    K, G = B.T @ np.diag(k) @ B, np.eye(n, k=1) - np.eye(n, k=-1)
    c = {"none": (0.0, 0.0, 0.0), "rayleigh": (0.3, 0.02, 0.0), "skew": (0.0, 0.0, 2.0)}[damping]
    C = c[0] * np.diag(m) + c[1] * K + c[2] * m[0] * G

    def rate(t: float, z: Any) -> Any:
        f = np.zeros(n)
        f[-1] = np.sin(np.pi * t / 0.5) ** 2 if t < 0.5 else 0.0
        return np.concatenate([z[n:], (f - K @ z[:n] - C @ z[n:]) / m])

    exact = solve_ivp(rate, (0.0, end), np.zeros(2 * n), "DOP853", rtol=1e-10, atol=1e-12, max_step=0.02).y[:n, -1]
    for steps in (120, 240, 480):
        u, _ = solved(made(n=n, steps=steps, dt=end / steps, scheme=scheme, **DAMPINGS[damping]))
        off.append(np.abs(u[-1] - exact).max())
    if scheme == "central-difference" and damping != "none":
        order = 1.0
    assert np.log2(off[1] / off[2]) == pytest.approx(order, abs=0.2)
    assert off[2] < (1e-4 if order == 2.0 else 2e-2)


@pytest.mark.parametrize("damping", ["none", "skew"])
def test_the_trapezoidal_rule_keeps_the_energy_of_a_free_bar(damping: str) -> None:
    """After the pulse, also with damping that does no work."""
    bar = made(steps=60, **DAMPINGS[damping])
    u, v = solved(bar)
    k = bar.stiffness(bar.parameters.start)
    stretch = np.diff(u, axis=1, prepend=0.0)
    energy = 0.5 * (k * stretch**2).sum(axis=1) + 0.5 * (bar.mass * v**2).sum(axis=1)
    np.testing.assert_allclose(bar.energy(np.hstack([u, v]), bar.parameters.start), energy, rtol=1e-14)
    free = energy[6:]
    assert np.ptp(free) < 1e-13 * free[0]
    assert free[0] > 0.01
    assert bar.energy_growth(np.hstack([u, v]).ravel(), bar.parameters.start) < 1e-13


def test_energy_that_the_trapezoidal_rule_adds_at_a_stiff_stop_is_told() -> None:
    """It is bounded for linear forces alone; shorter steps add less."""
    grown = []
    for dt in (0.05, 0.0125):
        bar = made(n=3, steps=round(2.4 / dt), dt=dt, stop="penalty", stops="both", gap=0.05, k_c=1000.0)
        p = bar.parameters.start
        grown.append(bar.energy_growth(Model(bar).solve(p).u, p))
    assert grown[0] > 0.3
    assert grown[1] < 0.1 * grown[0]
    assert made(n=3, steps=2).energy_growth(np.zeros(12), p) is None


@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_every_route_gives_the_gradient_of_complex_steps(scheme: str, damping: str) -> None:
    bar = made(scheme=scheme, alpha=0.1, parametrization="raw", **DAMPINGS[damping])
    model, p = Model(bar), 1.0 + 0.2 * np.sin(np.arange(4.0))
    exact = complex_step.prepare(model, p)(p).gradient
    for route in ROUTES:
        found = route.prepare(model, p)(p)
        assert relative_error(found.gradient, exact) < (route.accuracy or 1e-12), route.name


@pytest.mark.parametrize("unknown", ["moduli,damping,velocity", "damping", "velocity"])
def test_damping_and_the_initial_velocity_are_sought_like_moduli(unknown: str) -> None:
    """By all routes, with stiffness in the damping; the velocities are all of the share of the initial state."""
    bar = made(n=3, steps=4, unknown=unknown, **DAMPINGS["rayleigh"])
    model, rng = Model(bar), np.random.default_rng(0)
    p = bar.parameters.start + 0.1 * rng.standard_normal(len(bar.parameters))
    exact = complex_step.prepare(model, p)(p).gradient
    assert abs(exact).min() > 0.0
    for route in ROUTES:
        found = route.prepare(model, p)(p)
        assert relative_error(found.gradient, exact) < (route.accuracy or 1e-12), route.name
    few = adjoint.prepare(model, p, checkpoint="revolve=2")(p)
    assert relative_error(few.gradient, exact) < 1e-12
    state = adjoint.prepare(model, p)(p)
    shares = bar.view(p, state.u, state.lam).columns
    if "velocity" in unknown:
        v = bar.unknowns.slice("velocity")
        np.testing.assert_allclose(shares["by u_0"][v], exact[v], rtol=1e-11)
        np.testing.assert_array_equal(shares["by rates"][v], 0.0)
        assert not shares["by u_0"][: v.start].any()
    else:
        assert "by u_0" not in shares


def test_skew_damping_is_sought_too() -> None:
    bar = made(n=3, steps=4, unknown="damping", damping="skew", parametrization="raw")
    p = np.array([0.7])
    exact = complex_step.prepare(Model(bar), p)(p).gradient
    assert relative_error(adjoint.prepare(Model(bar), p)(p).gradient, exact) < 1e-12


FILE = "t [ms],node,displacement [mm]\n100,4,1\n200,4,3\n100,2,0.5\n400,2,2\n"


def test_histories_of_a_file_are_weighed_where_they_are(tmp_path) -> None:
    (tmp_path / "d.csv").write_text(FILE)
    bar = VibratingBar(n=4, steps=5, dt=0.1, data=str(tmp_path / "d.csv"), modulus=2.0, noise="0.1mm")
    U = np.random.default_rng(0).standard_normal(bar.n_state)
    u = U.reshape(5, 2, 4)[:, 0]
    off = [u[0, 3] - 1e-3, u[1, 3] - 3e-3, u[0, 1] - 0.5e-3, u[3, 1] - 2e-3]
    p = bar.parameters.start
    assert bar.objective(U, p) == pytest.approx(0.5 * np.sum(np.square(off)), rel=1e-14)
    seen = bar.observation(U, p)
    np.testing.assert_allclose(np.sort(seen.predicted - seen.data), np.sort(off), rtol=1e-14)
    assert seen.sigma == pytest.approx(1e-4)
    model = Model(bar)
    exact = complex_step.prepare(model, p)(p).gradient
    for route in (adjoint, implicit_ad):
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12


def test_steps_half_as_long_meet_the_same_data(tmp_path) -> None:
    (tmp_path / "d.csv").write_text(FILE)
    bar = VibratingBar(n=4, steps=5, dt=0.1, data=str(tmp_path / "d.csv"), modulus=2.0)
    fine, p = bar.halved(), bar.parameters.start
    stated = VibratingBar(n=4, steps=10, dt=0.05, data=str(tmp_path / "d.csv"), modulus=2.0)
    u = Model(fine).solve(p).u
    assert fine.objective(u, p) == stated.objective(u, p)
    np.testing.assert_array_equal(fine.residual(u, p), stated.residual(u, p))
    np.testing.assert_array_equal(fine.observation(u, p).data, bar.observation(Model(bar).solve(p).u, p).data)


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("0.1,9,1\n", r"line 2: node 9, t = 0.1 s: there is no such node, they are 1..4"),
        ("0.13,1,1\n", r"t = 0.13 s: this is no step, they are 0.1 s apart - choose dt"),
        ("0.9,1,1\n", "this is none of the 5 steps"),
        ("0,1,1\n", "this is none of the 5 steps"),
        ("0.2,1,1\n0.1,1,2\n", "line 3: t = 0.1 s of node 1 follows 0.2 s in line 2 - sort"),
        ("0.2,1,1\n0.2,1,2\n", "each once"),
    ],
)
def test_histories_that_do_not_fit_the_march_are_refused(rows: str, says: str, tmp_path) -> None:
    (tmp_path / "d.csv").write_text("t,node,displacement\n" + rows)
    with pytest.raises(InputError, match=says):
        VibratingBar(n=4, steps=5, dt=0.1, data=str(tmp_path / "d.csv"), modulus=1.0)


STOPPED: dict[str, dict[str, Any]] = {
    "softplus": {"stop": "softplus", "width": 0.01},
    "quadratic": {"stop": "quadratic", "width": 0.05},
    "penalty": {"stop": "penalty"},
}


@pytest.mark.parametrize("stop", STOPPED)
@pytest.mark.parametrize("scheme", SCHEMES)
def test_gradients_hold_where_the_tip_meets_a_stop(scheme: str, stop: str) -> None:
    """It closes and opens again within these steps; the second derivative of J jumps where a penalty does. Every scheme
    and every stop once by unrolled AD, which is traced longest and sees a step as implicit AD does.
    """
    bar = made(scheme=scheme, steps=16, gap=0.05, k_c=30.0, **STOPPED[stop])
    model, p = Model(bar, Solver(rtol=1e-14)), bar.parameters.start
    closed = model.solve(p).u.reshape(16, 2, 4)[:, 0, -1] > 0.05
    assert np.diff(closed.astype(int)).min() < 0 < closed.sum()
    exact = complex_step.prepare(model, p)(p).gradient
    unrolled = [unrolled_ad] if [*SCHEMES].index(scheme) == [*STOPPED].index(stop) else []
    for route in (tangent, adjoint, implicit_ad, *unrolled):
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12, route.name


def test_two_stops_hold_the_tip_between_them() -> None:
    bar = made(steps=200, dt=0.05, gap=0.05, k_c=1e3, stop="quadratic", width=0.01, stops="both", n=2)
    model, p = Model(bar, Solver(rtol=1e-14)), bar.parameters.start
    tip = model.solve(p).u.reshape(200, 2, 2)[:, 0, -1]
    assert tip.max() > 0.04
    assert tip.min() < -0.04
    assert np.abs(tip).max() < 0.1
    short = made(steps=20, dt=0.05, gap=0.05, stop="softplus", stops="both", n=2)
    model = Model(short, Solver(rtol=1e-14))
    exact = complex_step.prepare(model, p)(p).gradient
    for route in (adjoint, implicit_ad):
        assert relative_error(route.prepare(model, p)(p).gradient, exact) < 1e-12, route.name


def test_differences_near_a_march_with_a_stop_start_from_rest() -> None:
    bar = made(stop="softplus")
    for start in ("warm", "chord"):
        assert "is solved step by step from rest" in str(fd_central.objection(bar, start=start))
        assert fd_central.objection(made(), start=start) is None
    assert fd_central.objection(bar, start="cold") is None


def test_a_stop_throws_the_bar_back_as_a_fine_integrator_says() -> None:
    """SciPy's DOP853 with the force of the stop written out; errors fall by 4 for half the step."""
    n, end, off = 2, 1.2, []
    k, m, gap, k_c, w = np.full(n, float(n)), np.array([1.0, 0.5]) / n, 0.1, 30.0, 0.01
    B = np.eye(n) - np.eye(n, k=-1)
    K = B.T @ np.diag(k) @ B

    def rate(t: float, z: Any) -> Any:
        f = np.zeros(n)
        f[-1] = (np.sin(np.pi * t / 0.5) ** 2 if t < 0.5 else 0.0) - k_c * w * np.logaddexp(0.0, (z[n - 1] - gap) / w)
        return np.concatenate([z[n:], (f - K @ z[:n]) / m])

    exact = solve_ivp(rate, (0.0, end), np.zeros(2 * n), "DOP853", rtol=1e-10, atol=1e-12, max_step=0.02).y[:n, -1]
    for steps in (120, 240):
        options = {"n": n, "steps": steps, "dt": end / steps, "gap": gap, "k_c": k_c}
        off.append(np.abs(solved(made(**options, **STOPPED["softplus"]))[0][-1] - exact).max())
    assert off[0] / off[1] == pytest.approx(4.0, rel=0.1)
    assert off[1] < 1e-3


def test_bills_are_as_declared(cli) -> None:
    problems = ("vibrating-bar[n=1,steps=6]", "vibrating-bar[n=3,steps=6,stop=softplus,gap=0.001]")
    for problem in problems:
        rows = cli("run", "--json", "--no-store", "--no-timing", "--problem", problem, "--route", "all").rows
        assert [row["status"] for row in rows] == 7 * ["ok"]
        for row in rows:
            assert row["work"] == row["predicted_work"], (problem, row["route"])
            assert row["work"]["steps"] == 6 * row["work"]["forward_solves"]


@pytest.mark.parametrize("stop", ["none", "softplus"])
def test_a_step_is_a_problem_whose_rows_are_those_of_the_march(stop: str) -> None:
    bar = made(damping="rayleigh", alpha=0.2, stop=stop)
    rng, p = np.random.default_rng(0), bar.parameters.start
    U = rng.standard_normal(bar.n_state)
    z = np.concatenate([[np.zeros(8)], U.reshape(bar.steps, -1)])
    rows = bar.residual(U, p).reshape(bar.steps, -1)
    J = sum(bar.at(t).objective(z[t], np.concatenate([z[t - 1], p])) for t in range(1, 13))
    assert bar.objective(U, p) == pytest.approx(J, rel=1e-14)
    for t in (1, 5, 12):
        step, q = bar.at(t), np.concatenate([z[t - 1], p])
        np.testing.assert_allclose(step.residual(z[t], q), rows[t - 1], atol=1e-14)
        lin, dq, dz = step.linearize(z[t], q), rng.standard_normal(len(q)), rng.standard_normal(8)
        by_q = step.residual(z[t].astype(complex), q + 1e-30j * dq).imag / 1e-30
        np.testing.assert_allclose(lin.R_p @ dq, by_q, atol=1e-13)
        assert dz @ (lin.R_p @ dq) == pytest.approx((lin.R_p.T @ dz) @ dq, rel=1e-12)
        by_u = step.residual(z[t] + 1e-30j * dz, q.astype(complex)).imag / 1e-30
        np.testing.assert_allclose(step.tangent(z[t], q) @ dz, by_u, atol=1e-13)


@pytest.mark.parametrize("stop", ["none", "softplus"])
@pytest.mark.parametrize("checkpoint", ["all", "none", "sqrt", "every=5", "revolve=2", "revolve=12"])
def test_checkpoints_change_memory_and_steps_not_the_gradient(checkpoint: str, stop: str) -> None:
    """Bitwise: the same operations on the same states."""
    bar = made(scheme="newmark", damping="skew", alpha=0.1, stop=stop, gap=0.05 if stop == "softplus" else GAP)
    p = bar.parameters.start + 0.1
    kept = adjoint.prepare(Model(bar), p, checkpoint="all")(p)
    model = Model(bar)
    found = adjoint.prepare(model, p, checkpoint=checkpoint)(p)
    assert np.array_equal(found.gradient, kept.gradient)
    assert found.J == kept.J
    whole = adjoint.prepare(Model(bar), p)(p)
    assert relative_error(found.gradient, whole.gradient) < 1e-13
    assert found.J == pytest.approx(whole.J, rel=1e-13)
    again = {"all": 0, "none": 55, "sqrt": 6, "every=5": 8, "revolve=2": 17, "revolve=12": 0}
    assert model.tally.work.steps == 12 + again[checkpoint]


def test_steps_marched_again_are_declared(cli) -> None:
    routes = "adjoint[checkpoint=all|sqrt|every=2|none|revolve=2]", "unrolled-ad[inner=direct,checkpoint=4]"
    by = ("--route", routes[0], "--route", routes[1])
    for problem in ("vibrating-bar[n=3,steps=6]", "vibrating-bar[n=3,steps=6,stop=softplus,gap=0.001]"):
        rows = cli("run", "--json", "--no-store", "--no-timing", "--problem", problem, *by).rows
        assert [row["status"] for row in rows] == 6 * ["ok"]
        assert [row["work"]["steps"] for row in rows] == [6, 8, 8, 16, 9, 10]
        for row in rows:
            assert row["work"] == row["predicted_work"], (problem, row["route"])


def test_more_states_than_steps_are_wrong_usage(cli) -> None:
    problem, route = "vibrating-bar[n=3,steps=6]", "adjoint[checkpoint=every=7]"
    ran = cli("run", "--no-store", "--no-timing", "--problem", problem, "--route", route)
    assert ran.code == 2
    assert "checkpoint=every=7 of 6 steps - choose 1 to 6" in ran.err


def test_an_explicit_step_beyond_its_limit_is_refused() -> None:
    """2 / omega_max of the chain, bounded by the largest row: 2 sqrt(m / 4 k), 0.25 s."""
    with pytest.raises(DomainError, match=r"dt=0.3 is beyond 0.25, up to which central differences are stable"):
        VibratingBar(n=4, steps=12, dt=0.3, scheme="central-difference")
    bar = made(scheme="central-difference")
    with pytest.raises(DomainError, match=r"choose a smaller dt"):
        Model(bar).solve(bar.parameters.start + 3.0)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"steps": 0}, "steps=0 - choose"),
        ({"dt": -0.1}, "dt=-0.1 - choose a finite dt > 0"),
        ({"dt": float("nan")}, "dt=nan"),
        ({"n": 10**5, "steps": 10**6}, "2 n steps <= 1e\\+08"),
        ({"c_m": 0.2}, "c_m"),
        ({"sensors": "9"}, "there are 4"),
        ({"noise": -1.0}, "noise=-1"),
        ({"sensors": 0}, "sensors=0 measure nothing"),
        ({"unknown": "mass"}, "unknown=mass - choose among moduli, damping, velocity"),
        ({"unknown": "damping"}, "there is no damping - choose damping=rayleigh or skew"),
        ({"unknown": "velocity", "alpha": 1.0}, "alpha"),
        ({"data": "d.csv"}, "data=d.csv - say where to start: modulus=E in Pa"),
        ({"dt": 0.5}, "pulse=0.5 acts at none of 12 steps of dt=0.5 and moves nothing"),
        ({"force": 0.0}, "force=0,pulse=0.5 acts at none"),
    ],
)
def test_bad_options_are_told(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        VibratingBar(**{"n": 4, "steps": 12} | options)
