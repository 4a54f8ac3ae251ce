"""Laws of every route on every problem: right, at the declared price, zero where no datum looks."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from functools import cache
from typing import Any, get_args

import numpy as np
import pytest
from conftest import EXACT, OPTIONS, ROUTES, options_of, relative_error, somewhere, zoo

from gradient_routes.bench.execution.references import error
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import DomainError, InputError, NotConverged
from gradient_routes.problems.problem import Array, Parameters, Problem, Reference
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.faulty_adjoint import faulty_adjoint
from gradient_routes.routes.finite_difference import fd_central, fd_one_sided
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Result, Route
from gradient_routes.routes.tally import Work
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

ZOO = zoo()
# the others: 1e-12; derivatives of stationary iterations converge more slowly than the iterates (k rho^k, not rho^k)
ACCURACY = {"fd-one-sided": 1e-5, "fd-central": 1e-8, "unrolled-ad": 1e-9}


ITERATIONS = ("cg", "richardson", "jacobi")  # of unrolled AD, which compile anew for every k
SIZES = ("bar", "bar[n=1]")


def pairs(routes: tuple[Route, ...] = ROUTES, iterated: tuple[str, ...] = SIZES) -> Iterator[tuple[str, Route, dict]]:
    """Every problem with every route and option, but for the iterations of unrolled AD: every one on the problems
    `iterated`, one on each of the others. They see K, f and J as numbers, whatever p and the data are."""
    for number, (name, problem) in enumerate(ZOO.items()):
        for route in routes:
            for options in options_of(route, problem):
                if (
                    options.get("inner") not in ITERATIONS
                    or name in iterated
                    or ITERATIONS[number % 3] == options["inner"]
                ):
                    yield name, route, options


def ids(value: object) -> str | None:
    if isinstance(value, Route):
        return value.name
    return ",".join(str(v) for v in value.values() if v is not None) or "-" if isinstance(value, dict) else None


TIGHT = Solver(rtol=1e-14)  # exact routes are exact to the forward tolerance, which is not what is tested here


def differentiate(
    route: Route, problem: Problem, p: Array, solver: Solver = TIGHT, **options
) -> tuple[Result, Work, Work]:
    """The result, the work counted and the work declared: on a linear problem wholly before the run, on a nonlinear
    one given the number of Newton steps it took; chord steps are estimated well before the run on the bar only."""
    model = Model(problem, solver)
    options = route.resolve(model, p, **route.defaults | options)
    gradient = route.prepare(model, p, **options)
    before = model.tally.work
    result = gradient(p)
    counted = model.tally.work - before
    state = Model(problem, solver).solve(p)
    estimated = options.get("start") == "chord" and not isinstance(problem, Bar)
    known = counted if estimated or not problem.linear else None
    forward = ForwardWork(state.work, problem.linear, model.solver.rtol, known, problem.matrix_free, model.newton)
    return result, counted, route.cost(len(p), forward, **options)


@cache
def somewhere_by(name: str, route: str, options: frozenset[tuple[str, Any]]) -> tuple[Result, Work, Work]:
    """The same at the p of `somewhere`, computed once for all tests that look at it."""
    (found,) = (one for one in ROUTES if one.name == route)
    return differentiate(found, ZOO[name], somewhere(ZOO[name]), **dict(options))


def reference(problem: Problem, p: Array) -> Reference:
    """The closed form, or dense algebra with derivatives of R by complex steps where there is none."""
    own = problem.reference(p)
    if own is not None:
        return own
    u, h = Model(problem, TIGHT).solve(p, polish=1).u, 1e-30
    n_u, n_p = len(u), len(p)
    R = problem.residual
    R_u = np.column_stack([R(u + 1j * h * e, p + 0j).imag / h for e in np.eye(n_u)])
    R_p = np.column_stack([R(u + 0j, p + 1j * h * e).imag / h for e in np.eye(n_p)])
    J_u = np.array([problem.objective(u + 1j * h * e, p).imag / h for e in np.eye(n_u)])
    J_p = np.array([np.imag(problem.objective(u, p + 1j * h * e)) / h for e in np.eye(n_p)])
    g = J_p - R_p.T @ np.linalg.solve(R_u.T, J_u)
    return Reference("dense algebra", g, float(np.linalg.norm(g)))


@pytest.mark.parametrize(("name", "route", "options"), list(pairs()), ids=ids)
def test_every_route_gives_the_gradient(name: str, route: Route, options: dict) -> None:
    problem = ZOO[name]
    p = somewhere(problem)
    result, counted, declared = somewhere_by(name, route.name, frozenset(options.items()))
    assert error(result.gradient, reference(problem, p))[0] < ACCURACY.get(route.name, 1e-12)
    J = Model(problem).value(p)
    assert result.J is None or result.J == pytest.approx(J, rel=1e-9)
    assert counted == declared


def without_iterations(name: str, options: dict) -> bool:
    """Whether a case has no iterations of unrolled AD, or has them on the bar."""
    return options.get("inner") not in ITERATIONS or name == "bar"


@pytest.mark.parametrize(
    ("name", "route", "options"), [case for case in pairs() if without_iterations(case[0], case[2])], ids=ids
)
def test_counted_work_is_the_declared_work(name: str, route: Route, options: dict) -> None:
    """At the start and to the tolerance users have, where the test above is anywhere and tight, on every case."""
    problem = ZOO[name]
    _, counted, declared = differentiate(route, problem, problem.parameters.start, Solver(), **options)
    assert counted == declared


@pytest.mark.parametrize("n", [1, 2, 3, 5, 33, 200])
@pytest.mark.parametrize("route", ROUTES, ids=ids)
def test_declared_work_holds_for_every_size(route: Route, n: int) -> None:
    every = OPTIONS.get(route.name, [{}])
    for options in [every[n % len(every)]] if route is unrolled_ad and n != 3 else every:  # compile anew for every n
        _, counted, declared = differentiate(route, Bar(n=n), np.zeros(n), Solver(), **options)
        assert counted == declared


@pytest.mark.parametrize("step", [None, 1e-2, 1e-4, 1e-8])
@pytest.mark.parametrize("at", [0.0, 5.0])
@pytest.mark.parametrize("start", ["warm", "chord"])
@pytest.mark.parametrize("route", [fd_one_sided, fd_central], ids=ids)
def test_declared_work_holds_for_every_step_given_the_steps_taken(route: Route, start: str, at: float, step) -> None:
    """How many chord steps a perturbation needs depends on p: the formula takes their number as it takes Newton's k."""
    bar = Bar(n=4)
    model, p = Model(bar), np.full(4, at)
    base = Model(bar).solve(p).work
    gradient = route.prepare(model, p, step=step, start=start)
    gradient(p)
    assert route.cost(4, ForwardWork(base, counted=model.tally.work), step=step, start=start) == model.tally.work


class BlackBox(Problem):
    """J(p) = sum sin p_i, and nothing else is known."""

    name = "black-box"
    parameters = Parameters(start=np.array([0.3, -0.7, 0.0]), scale=np.ones(3))

    def value(self, p: Array) -> float:
        return float(np.sin(p).sum())


def test_a_black_box_has_finite_differences_and_nothing_more() -> None:
    problem = BlackBox()
    p = problem.parameters.start
    able = [route for route in ROUTES if route.objection(problem, **OPTIONS.get(route.name, [{}])[0]) is None]
    assert able == [fd_one_sided, fd_central]
    assert "start=warm needs R(u, p)" in str(fd_central.objection(problem, start="warm"))
    for route, solves in ((fd_one_sided, 4), (fd_central, 6)):
        model = Model(problem)
        result = route.prepare(model, p)(p)
        assert relative_error(result.gradient, np.cos(p)) < ACCURACY[route.name]
        assert model.tally.work == route.cost(3, ForwardWork(Work(1)), **route.defaults) == Work(solves)


FAULTS = get_args(get_args(inspect.signature(faulty_adjoint.function, eval_str=True).parameters["fault"].annotation)[0])


FAULTY = ("bar", "block[n=2]", "block[follower]", "advection")
IMPOSSIBLE = {  # what the problem lacks for the fault
    ("block[n=2]", "functional"): "a J that stands for an integral",
    ("block[follower]", "functional"): "a J that stands for an integral",
    ("bar", "otd"): "an adjoint equation of its own",
    ("block[n=2]", "otd"): "an adjoint equation of its own",
    ("block[follower]", "otd"): "an adjoint equation of its own",
    ("block[follower]", "scale"): "parameters that are logarithms",
    **{
        (name, fault): "another discretization"
        for name in ("bar", "block[n=2]", "block[follower]")
        for fault in ("quadrature", "stabilization", "mesh")
    },
}


@pytest.mark.parametrize(("name", "fault"), [(n, f) for n in FAULTY for f in FAULTS if (n, f) not in IMPOSSIBLE])
def test_wrong_routes_declare_their_work_rightly(name: str, fault: str) -> None:
    problem = ZOO[name]
    assert faulty_adjoint.objection(problem, fault=fault) is None
    _, counted, declared = differentiate(faulty_adjoint, problem, problem.parameters.start, Solver(), fault=fault)
    assert counted == declared


@pytest.mark.parametrize(("name", "fault"), IMPOSSIBLE)
def test_wrong_routes_say_what_a_problem_lacks_for_their_fault(name: str, fault: str) -> None:
    lacking = f"faulty-adjoint[fault={fault}] needs {IMPOSSIBLE[name, fault]}, which {ZOO[name].name} does not have"
    assert faulty_adjoint.objection(ZOO[name], fault=fault) == lacking


def test_the_table_of_bills() -> None:
    """The formulas users choose by, literally."""
    one = Work(1, newton_iterations=1, residuals=2, assemblies=1, factorizations=1, solves=1)
    forward, n = ForwardWork(one), 10
    assert fd_one_sided.cost(n, forward, step=None, start="cold").forward_solves == n + 1
    assert fd_central.cost(n, forward, step=None, start="cold").forward_solves == 2 * n
    assert fd_central.cost(n, forward, step=None, start="chord").factorizations == 1
    assert complex_step.cost(n, forward).forward_solves == n
    assert tangent.cost(n, forward, factors="refined") == one + Work(solves=n)
    assert (
        adjoint.cost(n, forward, factors="refined")
        == implicit_ad.cost(n, forward, factors="refined")
        == one + Work(transposed_solves=1)
    )
    assert unrolled_ad.cost(n, forward, inner="cg", iterations=7, newton=1, checkpoint=None).matvecs == 14


@pytest.mark.parametrize("n", [8, 10_000])
@pytest.mark.parametrize("parametrization", ["log", "raw"])
@pytest.mark.parametrize("route", [tangent, adjoint, implicit_ad], ids=ids)
def test_the_blind_tail_is_exactly_zero(route: Route, parametrization: str, n: int) -> None:
    if route is tangent and n > 1000:
        n = 300
    bar = Bar(n=n, sensors=[2, 5], parametrization=parametrization)
    result, _, _ = differentiate(route, bar, somewhere(bar))
    assert not result.gradient[5:].any()
    assert result.gradient[:5].all()


@pytest.mark.parametrize("route", ROUTES, ids=ids)
def test_no_sensors_no_gradient(route: Route) -> None:
    bar = Bar(sensors=0)
    result, _, _ = differentiate(route, bar, somewhere(bar), **OPTIONS.get(route.name, [{}])[0])
    assert not result.gradient.any()
    assert "exactly 0" in bar.notes[0]


@pytest.mark.parametrize(("name", "route", "options"), list(pairs(EXACT)), ids=ids)
def test_taylor_remainders_fall_with_rate_two(name: str, route: Route, options: dict) -> None:
    """|J(p + h v) - J(p) - h g.v| = O(h^2), in a random direction."""
    problem = ZOO[name]
    p = somewhere(problem)
    v = np.random.default_rng(5).standard_normal(len(p))
    result, _, _ = somewhere_by(name, route.name, frozenset(options.items()))
    h = 0.02 / 2.0 ** np.arange(5)
    J = Model(problem).value
    remainders = np.array([abs(J(p + k * v) - J(p) - k * (result.gradient @ v)) for k in h])
    assert (np.log2(remainders[:-1] / remainders[1:]) > 1.9).all()


@pytest.mark.parametrize("name", ZOO)
def test_tangent_and_adjoint_give_one_number(name: str) -> None:
    """J_u.du for R_u du = -R_p v equals (R_p^T lam).v for R_u^T lam = -J_u."""
    problem = ZOO[name]
    model, p = Model(problem), somewhere(problem)
    state = model.solve(p)
    lin, factors = model.linearize(state), model.factors_at(state)
    v = np.random.default_rng(6).standard_normal(len(p))
    du = model.solve_linear(factors, -(lin.R_p @ v))
    lam = model.solve_transposed(factors, -lin.J_u)
    assert lin.J_u @ du == pytest.approx((lin.R_p.T @ lam) @ v, rel=1e-12, abs=1e-15)


def test_the_adjoint_gradient_is_a_product_of_strains() -> None:
    bar = Bar()
    p = somewhere(bar)
    result, _, _ = differentiate(adjoint, bar, p)
    view = bar.view(p, result.u, result.lam)
    np.testing.assert_allclose(view.columns["A L_e eps eps"] * np.exp(p), result.gradient, rtol=1e-14)
    assert view.blind.tolist() == [False] * 5 + [True] * 3


@pytest.mark.parametrize(("sensors", "tolerance"), [(5, 1e-12), (10**6, 10**6 * np.finfo(float).eps)])
def test_a_million_moduli_against_the_closed_form(sensors: int, tolerance: float) -> None:
    """Strains are differences of displacements: far from the clamp they keep eps N relative, whoever computes them."""
    bar = Bar(n=10**6, sensors=sensors, noise=1e-3)
    p = 0.3 * np.random.default_rng(0).standard_normal(10**6)
    result, counted, declared = differentiate(adjoint, bar, p)
    assert error(result.gradient, bar.reference(p))[0] < tolerance
    assert counted == declared


def test_stale_factors_would_be_seen() -> None:
    """The last Newton factors belong to the iterate before: used as they are, they corrupt the gradient."""
    problem = ZOO["duffing"]
    model, p = Model(problem, Solver(rtol=1e-6)), problem.parameters.start
    state = model.solve(p)
    lin = model.linearize(state)
    stale = lin.R_p.T @ model.solve_transposed(state.factors, -lin.J_u)
    fresh = lin.R_p.T @ model.solve_transposed(model.factors_at(state), -lin.J_u)
    right = reference(problem, p).gradient
    assert relative_error(stale, right) > 1e-6 > relative_error(fresh, right)


def test_steps_that_leave_the_domain_are_refused_with_the_bound() -> None:
    bar = Bar(parametrization="raw")
    p = np.where(np.arange(8) == 3, 1e-7, 1.0)
    with pytest.raises(DomainError, match=r"fd-central: the step .* from E_4 = 1e-07 passes its bound 0 - choose"):
        differentiate(fd_central, bar, p, step=None, start="cold")
    differentiate(fd_one_sided, bar, p, step=None, start="cold")  # forward is free
    log = Bar()
    with pytest.raises(DomainError, match="passes its bound 170"):
        differentiate(fd_one_sided, log, np.full(8, 169.9), step=1e-2, start="cold")
    with pytest.raises(DomainError, match="does not change"):
        differentiate(fd_one_sided, log, np.ones(8), step=1e-17, start="cold")


@pytest.mark.parametrize("step", [0.0, -1e-6, np.nan, np.inf])
def test_steps_that_are_none_are_wrong_usage(step: float) -> None:
    with pytest.raises(InputError, match="finite and > 0"):
        fd_central.check(step=step, start="cold")


def test_a_solve_that_does_not_converge_says_how_far_it_came() -> None:
    problem = ZOO["duffing"]
    with pytest.raises(NotConverged, match=r"duffing: not converged in 2 steps: ") as caught:
        Model(problem, Solver(max_steps=2)).solve(problem.parameters.start)
    assert len(caught.value.history) == 3


def test_a_route_without_what_it_needs_says_what_is_missing() -> None:
    assert "R and J written in jax.numpy, which duffing does not offer" in str(implicit_ad.objection(ZOO["duffing"]))
