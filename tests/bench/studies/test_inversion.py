"""routes invert: from gradients to answers, and why there is none."""

from __future__ import annotations

import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from commands import PATIENCE

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.lcurve import Point, chosen, l_curve, minima
from gradient_routes.bench.inversion.minibatch import minibatched
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.one_shot import one_shot
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.bench.inversion.tradeoff import trade_off
from gradient_routes.bench.inversion.variables import Variables
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.invert import STUDY
from gradient_routes.bench.studies.invert.view import cells
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.problem import Linearization, Offers, Parameters, ParameterView, Problem
from gradient_routes.routes.newton import Solver

TIGHT = Limits(200, 1e-12)


def inverted(problem: str, route: str = "adjoint", **engine) -> Inversion:
    """One inversion of selectors."""
    (spec,), (by,) = case.problems([problem]), case.routes([route])
    return invert(spec, by, Engine(limits=engine.pop("limits", TIGHT), **engine))


@pytest.fixture(scope="module")
def bar() -> Inversion:
    return inverted("bar")


def test_seen_moduli_are_found_and_blind_ones_stay_where_they_were(bar: Inversion) -> None:
    """Five sensors, no noise, alpha = 0: five moduli to rounding; the tail has no gradient, so it has no step."""
    np.testing.assert_allclose(bar.p[:5], bar.truth[:5], atol=1e-9)
    assert (bar.p[5:] == bar.start[5:]).all()
    assert bar.end.startswith("converged")


@pytest.mark.parametrize(("optimizer", "iterations"), [("lbfgs", 0), ("lbfgs", 2), ("gauss-newton", 1)])
def test_rows_of_the_bar_show_the_strains_whose_product_is_the_gradient(optimizer: str, iterations: int) -> None:
    """Those of Gauss-Newton, too, whose own gradient is H^T r; without iterations those of the start."""
    found = inverted("bar[sensors=3,5]", optimizer=optimizer, limits=Limits(iterations))
    assert len(found.iterates) == 1 + iterations
    for row in found.tables["estimates"]:
        shown = row["view"]
        assert shown["E"] == pytest.approx(np.exp(row["estimate"]), rel=1e-14)
        assert shown["E"] * shown["eps[u]"] * shown["eps[lam]"] / 8 == pytest.approx(row["gradient"], rel=1e-9)
    assert found.end.startswith("not converged")


def test_finite_differences_take_the_same_steps_at_the_predicted_price(bar: Inversion) -> None:
    by_fd = inverted("bar", "fd-central")
    shared = min(len(bar.iterates), len(by_fd.iterates))
    for one, other in zip(bar.iterates[:shared], by_fd.iterates[:shared], strict=True):
        assert one.distance == pytest.approx(other.distance, abs=1e-6)
        assert other.forward_solves == 17 * one.forward_solves  # 2 n_p, and one for J
    np.testing.assert_allclose(by_fd.p, bar.p, atol=1e-6)


def test_a_route_without_a_state_shows_the_strains_of_the_solution(bar: Inversion) -> None:
    """Finite differences return no u: the strains shown are those at the estimate, not of the initial guess."""
    by_fd = inverted("bar", "fd-central")
    np.testing.assert_allclose(by_fd.view.columns["eps[u]"], bar.view.columns["eps[u]"], rtol=1e-6)
    assert (bar.view.columns["eps[u]"] > 0.0).all()
    closed = "bar[stop=penalty,gap=0.5]"
    one, other = (inverted(closed, route, limits=Limits(2, 0.0)) for route in ("adjoint", "fd-central"))
    assert one.view.blind.tolist() == other.view.blind.tolist() == [False] * 8, "all moduli act on a closed stop"


def test_a_trust_region_shows_steps_that_it_takes_only() -> None:
    found = inverted("bar[n=20,sensors=20,noise=1e-2]", optimizer="trust", limits=Limits(60, 1e-6))
    assert all(step.step_length > 0.0 for step in found.iterates[1:])
    assert (np.diff([step.objective for step in found.iterates]) < 0).all()


@pytest.mark.parametrize("optimizer", ["lbfgs", "gauss-newton", "levenberg-marquardt", "trust", "descent", "adam"])
def test_iterations_are_accepted_steps(optimizer: str) -> None:
    found = inverted("bar[n=3,sensors=3,noise=0.01,alpha=1e-3]", optimizer=optimizer, limits=Limits(2, 0.0, rate=0.01))
    assert len(found.iterates) == 3
    assert "not converged after 2 iterations" in found.end


@pytest.mark.parametrize("optimizer", ["gauss-newton", "levenberg-marquardt", "trust", "descent", "adam"])
def test_every_optimizer_goes_to_the_same_minimum(optimizer: str) -> None:
    problem = "bar[n=3,sensors=3,noise=0.01,alpha=1e-3]"
    limits = Limits(400, 1e-7, rate=0.03)
    found, reference = inverted(problem, optimizer=optimizer, limits=limits), inverted(problem)
    assert found.iterates[-1].objective == pytest.approx(reference.iterates[-1].objective, rel=1e-8)
    # descent and adam end where the slope is 1e-7: p then is off by that over the least curvature of J
    np.testing.assert_allclose(found.p, reference.p, atol=1e-4)


@pytest.mark.parametrize("positive", ["none", "log", "softplus"])
def test_raw_moduli_are_found_from_far_away(positive: str) -> None:
    found = inverted("bar[parametrization=raw]", positive=positive)
    np.testing.assert_allclose(found.p[:5], found.truth[:5], rtol=1e-8)


def test_a_step_out_of_the_domain_comes_back_and_is_said(tmp_path: Path) -> None:
    """From moduli far too high the first steps of raw parameters overshoot below zero."""
    (tmp_path / "p.csv").write_text("E\n" + "9\n" * 8)
    (spec,), (route,) = case.problems(["bar[parametrization=raw]"]), case.routes(["adjoint"])
    found = invert(spec, route, Engine(limits=TIGHT), at=str(tmp_path / "p.csv"))
    said = [step.says for step in found.iterates if step.says]
    assert said
    assert all("a step was shortened" in each and "is outside" in each for each in said)
    np.testing.assert_allclose(found.p[:5], found.truth[:5], rtol=1e-8)


@pytest.mark.parametrize("route", ["faulty-adjoint[fault=transpose]", "faulty-adjoint[fault=otd]"])
def test_a_gradient_that_is_not_that_of_J_is_named(route: str) -> None:
    problem = "advection[n=4,data=twin,noise=1e-2,alpha=1e-4]"  # data met exactly leave no gradient, right or wrong
    found = inverted(problem, route)
    assert found.end.startswith("gradient is not that of J: at the last step")
    checked = "routes check --problem 'advection[n=4,data=twin,noise=0.01,alpha=0.0001]'"
    assert found.end.endswith(f" - see {checked} --route '{route}'")
    right = inverted(problem, limits=Limits(100, 1e-8))
    assert right.iterates[-1].objective < found.iterates[-1].objective
    assert not right.misled


def test_one_sided_differences_stall_where_their_error_is_all_there_is() -> None:
    found = inverted("bar", "fd-one-sided")
    assert "the error of fd-one-sided hides the slope of J" in found.end
    assert not found.misled
    assert np.abs(found.p[:5] - found.truth[:5]).max() > 1e-10


class Bowl(Problem):
    """u = p, J = a curved valley through the eyes of `seen`; R_u = 1."""

    name, offers, structure, linear, n_state = "bowl", Offers.LINEARIZE, "spd", True, 2

    def __init__(self, seen=lambda J, p: J) -> None:
        self.seen = seen
        self.parameters = Parameters(start=np.array([-1.2, 1.0]), scale=np.ones(2))

    def residual(self, u, p):
        return u - p

    def tangent(self, u, p):
        return np.eye(2)

    def objective(self, u, p):
        return self.seen(100.0 * (u[1] - u[0] ** 2) ** 2 + (1.0 - u[0]) ** 2, u)

    def linearize(self, u, p):
        r = u[1] - u[0] ** 2
        J_u = np.array([-400.0 * r * u[0] - 2.0 * (1.0 - u[0]), 200.0 * r])
        return Linearization(-np.eye(2), J_u, np.zeros(2))


NOISE = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("seen", "says"),
    [
        (lambda J, p: J, "converged"),
        (lambda J, p: round(J, 4), "noise of J, about"),
        (lambda J, p: J + 1e-3 * NOISE.standard_normal(), "noise of J, about"),
        (lambda J, p: J + 1e10, "J cannot be told apart from its minimum"),
        (lambda J, p: J if p[0] < 0.5 else float("nan"), "is not defined"),
        (lambda J, p: J + 50.0 * max(0.0, p[0] - 0.3), "J has a kink here"),
        (lambda J, p: J + 3.0 * p[0], "gradient is not that of J"),
    ],
    ids="smooth rounded noisy offset edge kink forgotten".split(),
)
def test_the_reason_of_a_failed_line_search_is_named(seen, says: str) -> None:
    """The gradient is that of the smooth J in all of these: it is another one only where J is another smooth one."""
    spec = case.ProblemSpec("bowl", {}, lambda: Bowl(seen))
    (route,) = case.routes(["adjoint"])
    found = invert(spec, route, Engine(limits=Limits(300, 1e-9)))
    assert says in found.end


@pytest.mark.parametrize("size", [1e300, 1e-200])
def test_sizes_at_the_ends_of_the_floating_point_numbers_are_no_minimum(size: float) -> None:
    class Scaled(Bowl):
        def linearize(self, u, p):
            lin = super().linearize(u, p)
            return Linearization(lin.R_p, size * lin.J_u, lin.J_p)

    spec = case.ProblemSpec("scaled", {}, lambda: Scaled(lambda J, p: size * J))
    (route,) = case.routes(["adjoint"])
    found = invert(spec, route, Engine(limits=Limits(200, 1e-8)))
    np.testing.assert_allclose(found.p, 1.0, atol=1e-5)


def test_what_falls_without_bound_is_said_to() -> None:
    class Hill(Bowl):
        def linearize(self, u, p):
            lin = super().linearize(u, p)
            return Linearization(lin.R_p, -lin.J_u, lin.J_p)

    spec = case.ProblemSpec("hill", {}, lambda: Hill(lambda J, p: -J))
    (route,) = case.routes(["adjoint"])
    assert "falls without bound" in invert(spec, route, Engine()).end


def test_a_route_with_another_J_is_found_out_at_the_start() -> None:
    found = inverted("advection[n=4,data=twin,alpha=1e-4]", "faulty-adjoint[fault=functional]", limits=Limits(3, 1e-8))
    assert "is not that of the problem" in found.iterates[0].says
    assert inverted("bar", limits=Limits(3, 1e-8)).iterates[0].says is None


def test_parameters_that_no_datum_sees_are_told_where_the_problem_does_not_know() -> None:
    """Read off H, by weights of all its rows, and not off a gradient, which is 0 at the minimum anyway."""

    class Half(Bowl):
        def observation(self, u, p):
            return Observation(u[:1], np.zeros(1), np.eye(2)[:1])

    spec = case.ProblemSpec("half", {}, Half)
    (route,) = case.routes(["adjoint"])
    found = invert(spec, route, Engine(limits=Limits(5, 1e-8)))
    assert found.view.blind.tolist() == [False, True]
    assert [row["blind"] for row in found.tables["estimates"]] == [0, 1]


def test_a_slice_masks_what_is_blind_and_shows_no_picture_of_what_is_no_grid() -> None:
    found = inverted("block[n=4,data=twin,alpha=1e-3]", limits=Limits(1, 1e-8))
    assert "/" not in str(cells(found))
    blind = np.arange(64) < 32
    masked = str(cells(replace(found, view=ParameterView(blind=blind))))
    assert ", / blind" in masked
    middle = np.isclose(found.made.parameters.position[:, 1], 0.625)
    assert masked.count("/") == 1 + 2 * (blind & middle).sum()  # the legend, and two characters a cell
    assert not cells(inverted("block[n=4,unknown=traction,data=twin,alpha=1e-3]", limits=Limits(1, 1e-8)))


def test_a_zero_gradient_at_the_start_is_the_end() -> None:
    (spec,), (route,) = case.problems(["bar"]), case.routes(["adjoint"])
    for optimizer in ("lbfgs", "trust", "descent"):
        found = invert(spec, route, Engine(optimizer), at="true")
        assert len(found.iterates) == 1 or found.iterates[-1].objective <= found.iterates[0].objective
        assert np.isfinite(found.p).all()


@pytest.mark.parametrize("problem", ["bar[noise=1e-2,alpha=1e-2]", "bar[n=3,sensors=3,noise=0.01,alpha=1e-3]"])
def test_a_minimum_reached_to_rounding_is_one(problem: str) -> None:
    """In the second J is 1e-6: over the tiny steps that show noise, its curvature exceeds its rounding."""
    found = inverted(problem, limits=Limits(300, 0.0))
    assert found.end.startswith("converged to rounding")


def test_a_diverging_run_stops_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("log_E\n" + "3\n" * 8)
    (spec,), (route,) = case.problems(["bar"]), case.routes(["adjoint"])
    found = invert(spec, route, Engine("adam", Limits(200, 1e-8, rate=8.0)), at=str(tmp_path / "p.csv"))
    assert found.end.startswith("diverging: J = ")
    assert len(found.iterates) < 50


@pytest.mark.parametrize(
    "problem",
    [
        "advection[n=4,unknown=source,data=twin,noise=1e-3,alpha=1e-4]",
        "block[n=2,law=linear,unknown=traction,data=twin,alpha=1e-4]",
    ],
)
def test_where_u_is_affine_in_p_one_solve_is_the_answer(problem: str) -> None:
    """The loop ends where the linear least-squares solve does, and not below."""
    loop = inverted(problem, limits=Limits(300, 1e-9))
    made = loop.made
    assert made.affine
    (route,) = case.routes(["adjoint"])
    objective = Objective(
        made, route.route, route.options, Solver(), Variables.of(made.parameters, loop.start, "none", "test")
    )
    objective.start(loop.start)
    at_once = one_shot(objective)
    assert loop.iterates[-1].objective == pytest.approx(at_once.J, rel=1e-6)
    assert at_once.J <= loop.iterates[-1].objective * (1.0 + 1e-9)
    exact, gradient, *_ = route.route.prepare(objective.model, at_once.p)(at_once.p)
    assert exact == pytest.approx(at_once.J, rel=1e-9)
    assert np.linalg.norm(gradient) < 1e-7 * np.linalg.norm(objective.accepted.gradient)


def test_the_discrepancy_principle_takes_the_largest_alpha_that_meets_the_noise() -> None:
    (spec,), (route,) = case.problems(["bar[n=6,sensors=6,noise=0.003,seed=3]"]), case.routes(["adjoint"])
    points = l_curve(list(minima(spec, route, Engine(limits=Limits(200, 1e-8)), np.geomspace(1e-7, 1.0, 8))))
    alphas, misfits, phis = (np.array([p.row[name] for p in points]) for name in ("alpha", "misfit", "phi"))
    assert (np.diff(alphas) < 0).all()
    assert (np.diff(misfits) < 0).all()
    assert (np.diff(phis) > 0).all()
    met = [p for p in points if "discrepancy" in (p.chosen or "")]
    assert len(met) == 1
    assert met[0].discrepancy <= 1.0
    assert points[points.index(met[0]) - 1].discrepancy > 1.0


@dataclass(frozen=True)
class At:
    """As much of an inversion as a point of an L-curve takes."""

    alpha: float
    end: str = "converged"


def bent(ends: Sequence[str] = ()) -> list[Point]:
    """log misfit = max(a, 0), log Phi = max(-a, 0), rounded: an L in log alpha = a, its corner at a = 0."""
    a = np.linspace(3.0, -3.0, 13)
    misfit, phi = (np.exp(np.logaddexp(0.0, 4.0 * side * a) / 4.0) for side in (1.0, -1.0))
    ends = ends or ["converged"] * len(a)
    points = zip(a, misfit, phi, ends, strict=True)
    return [Point(At(np.exp(t), end), m, f, None, None) for t, m, f, end in points]


def test_the_corner_is_where_an_l_bends_and_a_curve_bent_the_other_way_has_none() -> None:
    marked = chosen(bent())
    (corner,) = [k for k, point in enumerate(marked) if point.chosen == "corner"]
    assert corner == 6
    outward = [replace(point, misfit=1 / point.phi, phi=1 / point.misfit) for point in bent()]
    assert not any(point.chosen for point in chosen(outward))


def test_what_has_not_converged_is_no_point_of_the_curve() -> None:
    ends = ["converged"] * 6 + ["not converged after 1 iterations"] + ["converged"] * 6
    assert [k for k, point in enumerate(chosen(bent(ends))) if point.chosen] != [6]


def test_bias_falls_and_variance_rises_as_regularization_goes() -> None:
    """Their sum is the mean square distance of the draws to the truth, each inverted by itself."""
    (spec,), (route,) = case.problems(["bar[n=6,sensors=6,noise=0.003]"]), case.routes(["adjoint"])
    engine = Engine(limits=Limits(200, 1e-8))
    trades = list(trade_off(spec, route, engine, [1e-1, 1e-3, 1e-5], 6))
    bias, variance, total = ([trade.row[name] for trade in trades] for name in ("bias", "variance", "total"))
    assert bias[0] > 3 * bias[1]
    assert variance[0] < variance[1] < variance[2]
    alone = [
        inverted(f"bar[n=6,sensors=6,noise=0.003,seed={k},alpha=1e-3]", limits=Limits(200, 1e-8)) for k in range(6)
    ]
    apart = np.mean([np.mean((found.p - found.truth) ** 2) for found in alone])
    assert total[1] == pytest.approx(apart, rel=1e-5)
    p = np.array([found.p for found in alone])
    np.testing.assert_allclose(trades[1].row["mean"], p.mean(axis=0), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(trades[1].row["sd"], p.std(axis=0), rtol=1e-3)


def test_minibatches_of_load_cases_are_unbiased() -> None:
    """Steps of Adam by all three cases are those by the whole of J; one case at a time comes down, too."""
    problem = "block[n=2,cases=3,alpha=1e-3,data=twin]"
    (spec,), (route,) = case.problems([problem]), case.routes(["adjoint"])
    made = spec()

    def run(count: int | None, steps: int) -> Inversion:
        engine = Engine("adam", Limits(steps, 1e-8, rate=0.05))
        batches = None if count is None else minibatched(made, route, engine, count, seed=1)
        return invert(spec, route, engine, made=made, run=batches)

    whole, all_three, one = run(None, 3), run(3, 3), run(1, 15)
    np.testing.assert_allclose(all_three.p, whole.p, rtol=1e-6, atol=1e-9)
    assert one.iterates[-1].objective < 0.7 * one.iterates[0].objective
    assert [step.iteration for step in one.iterates] == [*range(6)], "the whole is looked at once an epoch"


def test_rows_are_kept_and_resumed(cli) -> None:
    first = cli("invert", "--problem", "bar", "--iterations", "5", "--no-plot")
    assert first.code == 0
    assert "not converged after 5 iterations" in first.out
    assert "adjoint" in first.out
    again = cli("invert", "--problem", "bar", "--resume", "--json", "--tolerance", "1e-12")
    steps = [row for row in again.rows if row["table"] == "inversion"]
    assert steps[0]["iteration"] == 5
    names, kept = Store("results/routes.sqlite").table("inversion")
    assert steps[0]["objective"] == pytest.approx(kept[5][names.index("objective")], rel=1e-12)
    last = [row for row in again.rows if row["table"] == "estimates"]
    assert [row["blind"] for row in last] == [0] * 5 + [1] * 3
    assert max(abs(row["estimate"] - row["truth"]) for row in last[:5]) < 1e-6
    other = cli("invert", "--problem", "bar", "--resume", "--route", "tangent")
    assert (other.code, "holds no run of bar by tangent" in other.err) == (2, True), "another question"


def test_the_screen_tells_what_a_misfit_costs(cli) -> None:
    out = cli("invert", "--problem", "bar", "--route", "adjoint", "--route", "fd-central", "--no-store").out
    for words in (
        "to reach a misfit of",
        "7 fwd + 7 adj",
        "119 fwd",
        " blind",
        "forward solves",
    ):
        assert words in out
    out = cli("invert", "--problem", "bar[noise=0.01]", "--alpha-sweep", "1e-5", "1e-1", "4", "--no-store").out
    assert "L-curve" in out
    assert "misfit / noise" in out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--iterations", "-1"), "--iterations -1"),
        (("--alpha-sweep", "1", "0.1", "3"), "0 < LEAST < MOST"),
        (("--draws", "5"), "and --alpha-sweep"),
        (("--draws", "5", "--alpha-sweep", "1e-3", "1", "3"), "without noise"),
        (("--minibatch", "1"), "--optimizer adam"),
        (("--rate", "0.5"), "is of --optimizer adam"),
        (("--seed", "1"), "is of --minibatch"),
        (("--minibatch", "1", "--optimizer", "adam"), "has no load cases"),
        (("--positive", "log"), "a log field is positive already"),
        (("--optimizer", "levenberg-marquardt"), "5 data for 8 parameters"),
        (("--resume",), "no such file"),
        (("--alpha-sweep", "1", "1.0000001", "3"), "the same to six digits"),
        (("--resume", "--alpha-sweep", "1e-3", "1", "3"), "is of a single inversion"),
        (("--resume", "--no-store"), "there is none"),
        (("--route", "adjoint", "--route", "tangent", "--alpha-sweep", "1e-3", "1", "3"), "name one"),
    ],
)
def test_wrong_usage_is_one_line(cli, arguments: tuple[str, ...], says: str) -> None:
    ran = cli("invert", "--problem", "bar", *arguments)
    assert (ran.code, says in ran.err) == (2, True), ran.err
    assert ran.err.count("\n") == 1


ENDING = """
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.route import Work, route

@route("ending", needs=Offers.LINEARIZE, cost=lambda n_p, forward, **options: Work())
def ending(model, p):
    raise {}

class Ending(Bar):
    gradients = 0

    def linearize(self, u, p):
        Ending.gradients += 1
        if Ending.gradients == {}:
            raise {}
        return super().linearize(u, p)
"""
ENDINGS = {"KeyboardInterrupt()": (130, "interrupted"), "ValueError('mine')": (1, "invert: ValueError: mine")}


@pytest.mark.parametrize("failure", ENDINGS)
def test_what_ends_a_route_ends_nothing_of_those_before(cli, failure: str) -> None:
    Path("ending.py").write_text(ENDING.format(failure, 0, failure))
    ran = cli("invert", "--problem", "bar", "--route", "adjoint", "--route", "ending.py:ending", "--no-plot")
    code, says = ENDINGS[failure]
    assert (ran.code, says in ran.err, ran.err.count("\n")) == (code, True, 1), ran.err
    rows = Store(Path("results/routes.sqlite")).records("inversion")
    assert {row["route"] for row in rows} == {"adjoint"}
    assert rows[-1]["says"].startswith("converged")
    assert "to reach a misfit of" in ran.out


@pytest.mark.parametrize("failure", ENDINGS)
@pytest.mark.parametrize(("draws", "table"), [((), "lcurve"), (("--draws", "2"), "tradeoff")])
def test_what_ends_a_sweep_ends_nothing_of_what_was_swept(
    cli, failure: str, draws: tuple[str, ...], table: str
) -> None:
    Path("ending.py").write_text(ENDING.format(failure, 60, failure))
    swept = ("--alpha-sweep", "1e-4", "1", "8", "--tolerance", "1e-6", *draws)
    ran = cli("invert", "--problem", "ending.py:Ending[n=6,sensors=6,noise=0.003]", *swept)
    code, says = ENDINGS[failure]
    assert (ran.code, says in ran.err, ran.err.count("\n")) == (code, True, 1), ran.err
    assert 0 < len(Store(Path("results/routes.sqlite")).records(table)) < 8


def test_an_interrupt_keeps_what_was_found(tmp_path: Path) -> None:
    command = [str(Path(sys.executable).with_name("routes")), "invert", "--problem", "bar[n=2000,sensors=2000]"]
    child = subprocess.Popen(
        [*command, "--optimizer", "descent", "--iterations", "1000000", "--tolerance", "0"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "COLUMNS": "100"},
    )  # fmt: skip
    for line in child.stdout:
        if line.startswith("  20 "):
            break
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 130
    assert "Traceback" not in err
    assert "to reach a misfit of" in out
    names, rows = Store(tmp_path / "results" / "routes.sqlite").table("inversion")
    assert len(rows) >= 20
    assert rows[-1][names.index("says")].endswith("interrupted")


def test_the_examples_of_the_help_run(cli) -> None:
    lines = [line.strip() for line in STUDY.help.splitlines() if line.strip().startswith("routes invert --problem")]
    assert len(lines) == 4
    for line in lines:
        arguments = shlex.split(re.split(r" {2,}", line)[0])[1:]
        briefly = () if "--linear" in arguments else ("--iterations", "3")
        assert cli(*arguments, "--no-store", "--no-plot", *briefly).code == 0
