"""The bar with a stop: contact laws, active sets, the gradient behind the last sensor, solves that fail."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from conftest import relative_error, somewhere
from test_problems import complex_derivative
from test_routes import differentiate, ids, reference

from gradient_routes.bench.execution.references import error
from gradient_routes.problems.bar import Bar, true_modulus
from gradient_routes.problems.contact import CompliantStop, ContactLaw, Penalty, Quadratic, Softplus
from gradient_routes.problems.dynamics.both_sides import BothSides
from gradient_routes.problems.errors import InputError, NotConverged
from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route
from gradient_routes.routes.tangent import tangent

LAWS = (Penalty(50.0), Softplus(50.0, 0.02), Quadratic(50.0, 0.02))
STOPS = ("penalty", "softplus", "quadratic", "multiplier")
FADING = ("penalty", "quadratic", "multiplier")
by_stop = pytest.mark.parametrize("stop", STOPS)


@pytest.mark.parametrize("law", [*LAWS, BothSides(LAWS[1], 0.05)], ids=lambda law: type(law).__name__)
def test_forces_are_the_derivative_of_their_energy(law: ContactLaw) -> None:
    """Gauss' rule, exact for the polynomials between the kinks at -0.02, 0 and 0.02."""
    x, w = np.polynomial.legendre.leggauss(16)
    for a, b in pairwise([-0.12, -0.1, -0.08, -0.02, 0.0, 0.02, 0.1]):
        g = 0.5 * (a + b) + 0.5 * (b - a) * x
        work = 0.5 * (b - a) * (w @ law.force(g))
        assert law.energy(np.float64(b)) - law.energy(np.float64(a)) == pytest.approx(work, rel=1e-11, abs=1e-15)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("g", [-3.0, -0.03, -0.01, 0.01, 0.03, 3.0])
def test_forces_have_their_stiffness_and_differ_by_the_rounded_kink(law: ContactLaw, g: float) -> None:
    k = float(law.stiffness(np.float64(g)))
    assert k == pytest.approx(complex_derivative(law.force, np.array(g), 1.0), rel=1e-13)
    q, dq = jax.jvp(lambda g: law.force(g, jnp), (g,), (1.0,))
    np.testing.assert_allclose([q, dq], [law.force(np.float64(g)), k], rtol=1e-13, atol=1e-300)
    above = law.force(np.float64(g)) - Penalty(50.0).force(np.float64(g))
    assert 0.0 <= above <= 50.0 * 0.02 * np.log(2.0) * (1 + 1e-12)


@pytest.mark.parametrize("g", [-1e70, -50.0, 50.0, 1e70])
def test_softplus_overflows_nowhere(g: float) -> None:
    law = LAWS[1]
    assert law.force(np.complex128(g)) == Penalty(50.0).force(g * np.float64(1.0))
    assert law.stiffness(np.complex128(g)) == (50.0 if g > 0 else 0.0)


@by_stop
@pytest.mark.parametrize("penetration", [-0.3, -0.004, 0.004, 0.3])
def test_partial_derivatives_hold_for_every_active_set(stop: str, penetration: float) -> None:
    bar = Bar(n=4, stop=stop)
    p, rng = somewhere(bar), np.random.default_rng(2)
    u = rng.standard_normal(bar.n_state)
    u[3] = bar.stop.gap + penetration
    if stop == "multiplier":
        u[4] = penetration  # lam and g of one sign: no doubt which set
    du = rng.standard_normal(bar.n_state)
    by_complex_step = complex_derivative(lambda u: bar.residual(u, p.astype(complex)), u, du)
    np.testing.assert_allclose(bar.tangent(u, p) @ du, by_complex_step, rtol=1e-12, atol=1e-13)
    traced = bar.traced()
    by_jax = jax.jvp(lambda u: traced.residual(u, p), (u,), (du,))[1]
    np.testing.assert_allclose(by_jax, by_complex_step, rtol=1e-12, atol=1e-13)
    active_set = "closed" if penetration > 0 else "open"
    assert bar.active_set(u, p) == (None if stop in ("softplus", "quadratic") else active_set)


def test_exact_contact_holds_signorini_s_conditions() -> None:
    """g <= 0, q >= 0, g q = 0; the multiplier is the force that the equilibrium of the bar asks for."""
    for gap, closed in ((0.8, True), (1.2, False), (0.0, True), (-0.3, True)):
        bar = Bar(stop="multiplier", gap=gap)
        p = somewhere(bar)
        C = np.sum(1 / 8 / np.exp(p))
        u = Model(bar).solve(p).u
        assert u[-1] == pytest.approx(1.0 - gap / C if closed else 0.0, rel=1e-13, abs=1e-15)
        assert u[-2] == pytest.approx(gap if closed else C, rel=1e-13, abs=1e-15)
        assert bar.active_set(u, p) == ("closed" if closed else "open")


@pytest.mark.parametrize("stop", ["penalty", "softplus", "quadratic"])
def test_stiffer_stops_come_nearer_to_exact_contact(stop: str) -> None:
    p = somewhere(Bar())
    exact = Bar(stop="multiplier").reference(p).gradient
    wide = {} if stop == "penalty" else {"width": 1e-9}
    errors = [relative_error(Bar(stop=stop, k_c=k, **wide).reference(p).gradient, exact) for k in (1e2, 1e4, 1e6)]
    assert all(0.005 < after / before < 0.02 for before, after in pairwise(errors))  # O(1 / k_c)


GAPS = {"closed": 0.8, "open": 1.5}


@pytest.mark.parametrize("active_set", GAPS)
@pytest.mark.parametrize("route", [tangent, adjoint, implicit_ad, complex_step], ids=ids)
def test_exact_routes_agree_on_each_active_set_at_the_declared_price(route: Route, active_set: str) -> None:
    bar = Bar(n=8, stop="multiplier", gap=GAPS[active_set])
    p = somewhere(bar)
    result, counted, declared = differentiate(route, bar, p, Solver())
    assert error(result.gradient, reference(bar, p))[0] < 1e-12
    assert counted == declared
    each = 2 if active_set == "closed" else 1  # active-set steps: one finds the set, one the state
    solves, polish = (8, 8) if route is complex_step else (1, 0)
    assert counted.newton_iterations == solves * each + polish
    assert counted.residuals == counted.newton_iterations + solves, "no step is halved"


@pytest.mark.parametrize("stop", FADING)
@pytest.mark.parametrize("n", [8, 10_000])
@pytest.mark.parametrize("route", [tangent, adjoint, implicit_ad], ids=ids)
def test_the_tail_is_blind_until_the_tip_meets_the_stop(route: Route, n: int, stop: str) -> None:
    n = min(n, 300) if route is tangent else n
    for gap, in_contact in ((2.0, False), (0.5, True)):
        bar = Bar(n=n, sensors=[2, 5], stop=stop, gap=gap)
        p = somewhere(bar)
        result, _, _ = differentiate(route, bar, p)
        assert result.gradient[:5].all()
        assert result.gradient[5:].all() if in_contact else not result.gradient[5:].any()
        assert bar.view(p, result.u, result.lam).blind.tolist() == [False] * 5 + [not in_contact] * (n - 5)
        assert bar.reference(p).gradient[5:].any() == in_contact


def test_notes_say_what_is_blind_and_when() -> None:
    for stop in FADING:
        assert Bar(stop=stop).notes == (
            "3 of 8 elements lie behind the last sensor: blind unless the tip touches the stop",
        )
    assert "never quite 0" in Bar(stop="softplus").notes[0]
    assert Bar(stop="penalty", sensors=8).notes == ()
    assert "presses on the tip of the unloaded bar" in Bar(stop="multiplier", gap=-0.1, sensors=8).notes[0]


@by_stop
def test_a_hundred_thousand_moduli_behind_a_stop(stop: str) -> None:
    bar = Bar(n=10**5, stop=stop)
    result, counted, declared = differentiate(adjoint, bar, bar.parameters.start, Solver())
    assert error(result.gradient, bar.reference(bar.parameters.start))[0] < 1e-11  # eps N, what strains keep
    assert counted == declared


def test_newton_s_steps_come_down_to_the_solution_from_one_side() -> None:
    """Ortega & Rheinboldt 1970, 13.3.4: R convex, R_u^{-1} >= 0; so no step needs halving, though |R| rises first."""
    bar, u, tips = Bar(stop="softplus"), np.zeros(8), []
    p = somewhere(bar)
    for _ in range(12):
        u = u - np.linalg.solve(np.column_stack([bar.tangent(u, p) @ e for e in np.eye(8)]), bar.residual(u, p))
        tips.append(u[-1])
    assert all(after <= before + 1e-15 for before, after in pairwise(tips))
    state = Model(bar).solve(p)
    assert state.history[1] > state.history[0]
    assert state.work.residuals == state.work.newton_iterations + 1


def test_newton_that_cycles_between_active_sets_says_so() -> None:
    """At k_c = 1e20 the penetration is below the rounding of u_N, which is open or closed as rounding likes."""
    bar = Bar(stop="penalty", k_c=1e20)
    with pytest.raises(NotConverged, match=r"max-steps=50.*; active sets: (closed open ?){4}$"):
        Model(bar).solve(bar.parameters.start)


@pytest.mark.parametrize("k_c", [1e8, 1e15, 1e16, 1e18])
def test_stiff_penalties_are_right_or_refused(k_c: float) -> None:
    rng, refused = np.random.default_rng(0), []
    for _ in range(20):
        n = int(rng.integers(1, 12))
        bar = Bar(n=n, stop="penalty", k_c=k_c, gap=rng.uniform(0.3, 0.8))
        p = rng.uniform(-0.3, 0.3, n)
        try:
            gradient = adjoint.prepare(Model(bar), p)(p).gradient
        except NotConverged as failure:
            refused.append(str(failure))
        else:
            assert error(gradient, bar.reference(p))[0] < 1e-12
    assert bool(refused) == (k_c > 1e15)
    assert all("active sets: " in failure for failure in refused)


@pytest.mark.parametrize("stop", ["penalty", "multiplier"])
def test_a_tip_that_just_reaches_the_stop_is_no_failure(stop: str) -> None:
    """Whether it touches is then decided by rounding, again at every step, and does not matter."""
    rng = np.random.default_rng(1)
    for ulps in range(-4, 5):
        p = rng.uniform(-0.3, 0.3, 8)
        bar = Bar(stop=stop, gap=np.sum(1 / 8 / np.exp(p)) * (1 + ulps * 1.1e-16))
        assert Model(bar).solve(p).residual < 1e-12


def test_a_stiff_bar_is_not_solved_on_the_wrong_set() -> None:
    """With E = 1e13 Pa all displacements are below rtol |R|: only the sets tell that the tip went too far."""
    bar = Bar(stop="multiplier", gap=0.5e-13, parametrization="raw")
    p = np.full(8, 1e13)
    assert Model(bar).solve(p).u[-1] == pytest.approx(0.5, rel=1e-12)


@by_stop
@pytest.mark.parametrize("E", [1e-9, 1e9])
def test_the_closed_form_holds_where_the_stop_carries_nearly_all_or_nothing(stop: str, E: float) -> None:
    """F - q is 1e-9 F where the bar is soft; the closed form takes it from u_N instead."""
    bar = Bar(stop=stop, parametrization="raw")
    p = E * np.random.default_rng(0).uniform(0.8, 1.2, 8)
    result, _, _ = differentiate(adjoint, bar, p)
    assert error(result.gradient, bar.reference(p))[0] < 1e-12


@by_stop
@pytest.mark.parametrize("log_E", [-165.0, -120.0, -80.0, -20.0, 20.0, 80.0, 165.0])
def test_extreme_moduli_give_the_gradient_or_fail(stop: str, log_E: float) -> None:
    """A soft bar's first iterate is 1e70 m away: all is rounding there, and R does not feel what then cancels."""
    rng, refused = np.random.default_rng(4), 0
    for _ in range(5):
        bar, p = Bar(stop=stop), log_E + rng.uniform(-0.3, 0.3, 8)
        try:
            gradient = adjoint.prepare(Model(bar), p)(p).gradient
        except NotConverged:
            refused += 1
        else:
            assert error(gradient, bar.reference(p))[0] < 1e-10  # up to four digits cancel
    assert refused == (5 if stop != "multiplier" and log_E < -50.0 else 0)


@pytest.mark.parametrize("law", [Softplus(1e3, 1e-9), Softplus(1e-3, 1e-2), Softplus(1e12, 1.0), Quadratic(1e3, 1e-9)])
@pytest.mark.parametrize("C", np.geomspace(1e-43, 1e43, 9))
def test_the_force_of_a_stop_in_series_with_a_bar_is_in_equilibrium(law: ContactLaw, C: float) -> None:
    """g + C q(g) = F C - gap, however soft the bar or narrow the width, and pressed on by a wide softplus unloaded."""
    g_0 = np.longdouble(C) - 0.8
    g, q, _ = CompliantStop(0.8, law).equilibrium(g_0, np.longdouble(C))
    assert float(abs(g + C * q - g_0)) <= 1e-15 * float(abs(g) + C * q + abs(g_0))
    assert float(q) == pytest.approx(float(law.force(g)), rel=1e-12, abs=1e-18 * law.k_c * float(abs(g)))


@by_stop
def test_synthetic_data_are_read_from_the_bar_with_its_stop(stop: str) -> None:
    bar = Bar(n=40, sensors=40, stop=stop, gap=0.7)
    assert Model(bar).value(bar.truth()) < 1e-28
    free = np.cumsum(1 / 40 / true_modulus(bar.x))
    assert bar.sensors.d[-1] < free[-1] - 0.1
    noisy = Bar(n=40, sensors=40, stop=stop, gap=0.7, noise=0.1, seed=3).sensors.d - bar.sensors.d
    plain = Bar(n=40, sensors=40, noise=0.1, seed=3).sensors.d - Bar(n=40, sensors=40).sensors.d
    np.testing.assert_allclose(noisy, plain, atol=1e-15)


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"gap": 0.5}, "gap needs stop=penalty, say - leave gap out or change stop"),
        ({"k_c": 1.0}, "k_c needs stop=penalty, softplus or quadratic"),
        ({"stop": "multiplier", "k_c": 1.0}, "k_c needs stop=penalty, softplus or quadratic"),
        ({"stop": "penalty", "width": 0.1}, "width needs stop=softplus or quadratic"),
        ({"stop": "multiplier", "width": 0.1}, "width needs stop=softplus or quadratic"),
        ({"stop": "softplus", "width": 0.0}, "width=0 - choose"),
        ({"stop": "quadratic", "width": -1.0}, "width=-1 - choose"),
        ({"stop": "softplus", "width": np.inf}, "width=inf - choose"),
        ({"stop": "penalty", "k_c": 0.0}, "k_c=0 - choose"),
        ({"stop": "penalty", "k_c": np.nan}, "k_c=nan - choose"),
        ({"stop": "penalty", "gap": np.inf}, "gap=inf - a distance is finite"),
    ],
)
def test_bad_options_of_the_stop_are_one_line(options: dict, says: str) -> None:
    with pytest.raises(InputError) as caught:
        Bar(**options)
    assert str(caught.value).startswith(f"bar: {says}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("sensors", [[2, 3, 7], [8, 1], 5, 8])
def test_the_integral_is_that_of_the_interpolated_misfit(sensors) -> None:
    """Against a fine midpoint rule; its derivative against differences, exact for a quadratic function."""
    bar = Bar(stop="multiplier", sensors=sensors, alpha=0.3)
    p = somewhere(bar)
    u = np.random.default_rng(3).standard_normal(9)
    value, by_u = bar.integral(u, p)
    nodes = np.sort(bar.sensors.nodes)
    misfit = (u[bar.sensors.nodes - 1] - bar.sensors.d)[np.argsort(bar.sensors.nodes)]
    x = nodes[0] + (np.arange(70_000) + 0.5) / 70_000 * (nodes[-1] - nodes[0])
    mean = (np.interp(x, nodes, misfit) ** 2).mean()
    Phi = bar.objective(u, p) - bar.sensors.misfit(np, u)
    assert value == pytest.approx(0.5 * (len(nodes) - 1) * mean + Phi, rel=1e-8)
    slopes = [(bar.integral(u + e, p)[0] - bar.integral(u - e, p)[0]) / 2 for e in np.eye(9)]
    np.testing.assert_allclose(by_u, slopes, atol=1e-13)


def test_the_objective_is_a_quadrature_of_the_integral() -> None:
    """The more sensors, the nearer: the first and the last count half in the integral, neighbours are averaged."""
    gaps = []
    for n in (8, 80, 800):
        bar = Bar(n=n, sensors=n)
        u = np.sin(bar.x)
        gaps.append(abs(bar.integral(u, bar.parameters.start)[0] / bar.objective(u, bar.parameters.start) - 1))
    assert 0.02 < gaps[0] < 0.5
    assert all(after < 0.2 * before for before, after in pairwise(gaps))
    assert Bar(sensors=1).integral(np.zeros(8), np.zeros(8)) is None
