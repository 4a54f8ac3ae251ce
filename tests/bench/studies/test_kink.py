"""Kinks: events found by bisection, both sides exact, differences over them neither; rounded stops and their rates."""

from __future__ import annotations

import csv
import io
from itertools import pairwise

import numpy as np
import pytest
from conftest import EXACT, somewhere
from test_routes import ids

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.bench.execution.references import error
from gradient_routes.bench.render.terminal.panel import panel
from gradient_routes.bench.studies.kink.columns import KINK
from gradient_routes.bench.studies.kink.event import Kink
from gradient_routes.bench.studies.kink.measure import kink
from gradient_routes.bench.studies.kink.ray import Ray
from gradient_routes.bench.studies.kink.rounding import Trade, trade, yielding
from gradient_routes.bench.verification.check import check
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.registered import subject
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.problem import Reference
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route

COARSE = np.geomspace(0.25, 4.0, 5).tolist()
by_stop = pytest.mark.parametrize("stop", ["penalty", "multiplier"])
by_rounding = pytest.mark.parametrize("law", ["softplus", "quadratic"])


def spec(route: Route) -> RouteSpec:
    return RouteSpec(route.name, route, dict(route.defaults))


def ray(**options) -> Ray:
    bar = Bar(**options)
    return Ray(bar, somewhere(bar), Solver())


def event_of(ray: Ray) -> float:
    """C(s) F = gap with C(s) = C_hat / s."""
    bar = ray.problem
    C_hat = np.sum(bar.L_e / bar.modulus(ray.p_hat))
    return float(C_hat / bar.stop.gap)


def measured(stop: str, *routes: Route, **options) -> Kink:
    return kink(ray(stop=stop, **options), [spec(r) for r in routes], COARSE)


@by_stop
@pytest.mark.parametrize("parametrization", ["log", "raw"])
@pytest.mark.parametrize("n", [1, 8, 500])
def test_the_event_is_where_the_free_tip_reaches_the_stop(stop: str, parametrization: str, n: int) -> None:
    along = ray(stop=stop, parametrization=parametrization, n=n)
    found = kink(along, [], COARSE).event
    assert found.s == pytest.approx(event_of(along), rel=1e-12)
    assert (found.left.active_set, found.right.active_set) == ("closed", "open")
    assert found.left.tip == pytest.approx(0.8, rel=1e-11)
    assert 0 < found.right.s - found.left.s <= 1e-12 * found.s


@by_stop
@pytest.mark.parametrize("route", EXACT, ids=ids)
def test_exact_routes_give_the_derivative_of_their_own_branch(stop: str, route: Route) -> None:
    found = measured(stop, route, alpha=0.1)
    bar = found.ray.problem
    for side, visit in (("left", found.event.left), ("right", found.event.right)):
        (slope,) = found.on(side)
        reference = bar.reference(found.ray.p(visit.s)).gradient @ found.ray.by_s(visit.s)
        assert slope.slope == pytest.approx(reference, rel=1e-10, abs=1e-10 * slope.size)
        assert slope.error < 1e-10
        assert slope.reference == "closed form"
    assert abs(found.event.jump) > 1e-4
    assert found.event.left.backward == pytest.approx(found.event.slope_left, abs=1e-6)
    assert found.event.right.forward == pytest.approx(found.event.slope_right, abs=1e-6)


@by_stop
def test_a_stencil_over_the_event_tends_to_the_mean_of_both_slopes(stop: str) -> None:
    found = measured(stop)
    event, half = found.event, 0.5 * abs(found.event.jump)
    mean = 0.5 * (event.slope_left + event.slope_right)
    for one in found.stencils[3:]:  # s* is known to 1e-12, that is 1e-5 h
        assert one.quotient == pytest.approx(mean, abs=2.0 * one.step + 1e-4 * half)
        assert (one.off_left, one.off_right) == pytest.approx((half, half), abs=2.0 * one.step + 1e-4 * half)
    off = [abs(one.quotient - mean) for one in found.stencils[1:5]]
    assert all(after < 0.2 * before for before, after in pairwise(off)), "O(h)"


def test_the_steps_of_central_differences_reach_over_the_event() -> None:
    found = measured("multiplier", fd_central)
    for side in ("left", "right"):
        assert found.on(side)[0].error > 1e-2
    assert max(s.error for s in found.slopes if s.side is None and not 0.9 < s.s / found.event.s < 1.1) < 1e-7


def test_without_a_closed_form_another_exact_route_judges() -> None:
    class Unsolved(Bar):
        def reference(self, p: np.ndarray) -> Reference | None:
            return None

    bar = Unsolved(stop="penalty")
    found = kink(Ray(bar, bar.parameters.start, Solver()), [spec(adjoint)], COARSE)
    assert found.event.judge == "adjoint"
    assert all(s.error < 1e-10 and s.reference == "complex-step" for s in found.slopes)


def traded(law: str, **options) -> Trade:
    along = ray(stop=law, **options)
    return trade(along, yielding(along.problem), spec(adjoint), 0.25, 4.0)


@by_rounding
def test_at_the_kink_rounding_costs_its_width_and_buys_curvature(law: str) -> None:
    found = traded(law)
    assert found.event == pytest.approx(event_of(found.ray), rel=1e-12)
    rows = [row for row in found.rows if row.s == found.event][2:]
    for before, after in pairwise(rows):
        assert after.off_objective / before.off_objective == pytest.approx(0.1, rel=0.15)
        assert after.penetration / before.penetration == pytest.approx(0.1, rel=0.01)
    assert rows[-1].curvature / rows[-2].curvature == pytest.approx(10.0, rel=0.05)


@by_rounding
def test_pressed_against_the_stop_only_its_yielding_is_left(law: str) -> None:
    """Rounded laws tend to the penalty as the width goes to 0, and that to exact contact as 1 / k_c, data aside."""
    left = [[row for row in traded(law, k_c=k_c).rows if row.s == 1.0][-1] for k_c in (1e3, 1e4, 1e5)]
    for before, after in pairwise(left):
        assert after.off_objective / before.off_objective == pytest.approx(0.1, rel=0.2)
        assert after.off_slope / before.off_slope == pytest.approx(0.1, rel=0.2)
    penalty = [row for row in traded("penalty").rows if row.s == 1.0]
    for before, after in pairwise(penalty[1:]):
        assert after.off_objective / before.off_objective == pytest.approx(0.1, rel=0.15)
        assert after.curvature is None
    same = next(row for row in traded("penalty", k_c=1e3).rows if row.s == 1.0 and row.stop.law.k_c == 1e3)
    assert left[0].penetration == pytest.approx(same.penetration, rel=1e-9)


@by_stop
@pytest.mark.parametrize(("factor", "verdict"), [(0.9, "agrees"), (1.0, "non-smooth"), (1.1, "agrees")])
def test_check_tells_the_kink_from_its_sides(stop: str, factor: float, verdict: str) -> None:
    along = ray(stop=stop)
    p = along.p(factor * event_of(along))
    found = check(subject(along.problem, adjoint, {}, p, Solver()), Plan(everywhere=True))
    assert found.verdict == verdict
    assert (found.deciding.inside >= 1) == (factor == 1.0)
    if factor != 1.0:
        assert error(adjoint.prepare(along.model, p)(p).gradient, along.problem.reference(p))[0] < 1e-10


def run(cli, problem: str, *arguments: str, route: str = "adjoint"):
    return cli("kink", "--problem", problem, "--route", route, *arguments)


def test_the_sentence_comes_first_and_the_jump_is_drawn(cli) -> None:
    ran = run(cli, "bar[stop=multiplier]", route="all")
    first, *rest = ran.out.splitlines()
    assert (ran.code, ran.err) == (0, "")
    assert first.startswith("bar[stop=multiplier]: at s = 1.25 (E = s E_hat), the tip at 0.8 m, closed becomes open")
    assert "dJ/ds = 0 from the left, -0.00453836 from the right" in first
    assert any(line.startswith("exact on either branch, to 1e-10 against the closed form: complex") for line in rest)
    assert any(line.startswith("not exact beside the event, worst error: fd-one-sided") for line in rest)
    assert "tend to the mean of the two slopes, -0.00226918" in ran.out
    assert "dJ/ds by complex-step" in ran.out
    assert "dJ/ds by complex-step" not in run(cli, "bar[stop=multiplier]", "--no-plot", route="complex-step").out


def test_json_rows_are_complete_and_kept(cli) -> None:
    ran = run(cli, "bar[stop=penalty]", "--json", "--points", "5", route="adjoint")
    rows = ran.rows
    assert ran.code == 0
    assert all(list(row) == ["table", *(c.name for c in KINK)] for row in rows)
    kinds = [row["kind"] for row in rows]
    assert kinds[0] == "event"
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        "event": 1, "side": 2, "point": 5 + 24, "stencil": 7, "trade": 7
    }  # fmt: skip
    assert {row["status"] for row in rows} == {"ok"}
    event = rows[0]
    assert event["s"] == pytest.approx(1.25, rel=1e-12)
    assert event["jump"] == event["slope_right"] - event["slope"]
    table = list(csv.DictReader(io.StringIO(cli("export", "--table", "kink").out)))
    assert [row["kind"] for row in table] == kinds
    assert float(table[0]["s"]) == event["s"]
    assert not run(cli, "bar[stop=penalty]", "--no-store", "--store", "other.sqlite").out.count("kept in")


def test_routes_that_cannot_run_are_skipped_with_their_reason(cli) -> None:
    ran = cli("kink", "--problem", "bar[stop=penalty,n=300]", "--route", "all", "--budget", "0.5", "--points", "2")
    assert ran.code == 0
    assert "skipped: fd-central: 28 gradients: predicted bill" in ran.out
    ran = run(cli, "bar[stop=penalty]", "--json", "--points", "2", route="unrolled-ad[inner=jacobi]")
    (skipped,) = [row for row in ran.rows if row["status"] == "skipped"]
    assert ran.code == 0
    assert "linear" in skipped["reason"]


def test_no_event_is_one_line(cli) -> None:
    for problem, low, says in (
        ("bar[stop=penalty]", "2", "stays open"),
        ("bar[stop=multiplier,gap=-0.1]", "1", "stays closed"),
    ):
        ran = run(cli, problem, "--range", low, "4", "--no-store")
        assert (ran.code, ran.err, ran.out.count("\n")) == (0, "", 1)
        assert f"{problem}: no event: " in ran.out
        assert says in ran.out
        assert "widen --range" in ran.out
    event, *points = run(cli, "bar[stop=penalty]", "--range", "2", "4", "--json").rows
    assert (event["kind"], event["status"], event["s"]) == ("event", "none", None)
    assert {row["active_set"] for row in points} == {"open"}


@pytest.mark.parametrize("points", ["2", "9"])
def test_solves_that_fail_are_rows_with_a_reason(cli, points: str) -> None:
    """One Newton step finds the open bar, and no other."""
    ran = run(cli, "bar[stop=penalty]", "--max-steps", "1", "--json", "--points", points, "--range", "0.5", "2")
    failed = [row for row in ran.rows if row["status"] == "failed"]
    assert failed
    assert all("not converged" in row["reason"] for row in failed)
    ran = run(cli, "bar[stop=penalty]", "--max-steps", "1", "--range", "0.5", "1", "--points", points)
    assert ran.code == 1
    assert "could be solved" in ran.out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["bar"], "kink: bar has no active set that could change: its R is smooth - choose a problem that has"),
        (["block[n=1]"], "kink: block has no active set"),
        (["bar[stop=penalty|multiplier]"], "names 2 problems"),
        (["bar[stop=penalty]", "--range", "4", "2"], "--range 4 2 - give two factors"),
        (["bar[stop=penalty]", "--range", "0", "2"], "--range 0 - give a number > 0"),
        (["bar[stop=penalty]", "--range", "1", "nan"], "--range nan - give a number > 0"),
        (["bar[stop=penalty]", "--points", "1"], "--points 1 - give a whole number from 2"),
        (["bar[stop=penalty]", "--budget", "0"], "--budget 0 - give seconds > 0"),
        (["bar[stop=softplus]", "--route", "unrolled-ad[inner=cg,iterations=0]"], "iterations"),
    ],
)
def test_wrong_usage_is_one_line(cli, arguments: list[str], says: str) -> None:
    ran = cli("kink", "--problem", *arguments)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


def test_the_trade_is_shown_with_its_rates(cli) -> None:
    ran = run(cli, "bar[stop=quadratic]")
    assert ran.code == 0
    assert ran.out.startswith("bar[stop=quadratic]: no event: the law of the stop is rounded over a width")
    assert "|J - J_exact| ~ width^1.00, paid by d2J/ds2 ~ width^-1.00" in ran.out
    assert "what no width removes" in ran.out
    assert "p |u_N - gap| [m]   c |d2J/ds2|" in ran.out
    assert "p |u_N" not in run(cli, "bar[stop=quadratic]", "--no-plot").out
    assert "widen --range" in run(cli, "bar[stop=quadratic]", "--range", "0.5", "1").out


@by_rounding
def test_rounded_stops_are_swept_by_every_route(cli, law: str) -> None:
    """Exact ones are the closed form's derivative at every s, and what differences on either side tend to."""
    arguments = ("kink", "--problem", f"bar[stop={law}]", "--route", "tangent", "--route", "fd-central")
    ran = cli(*arguments, "--route", "unrolled-ad[inner=jacobi]", "--points", "7", "--json")
    assert (ran.code, ran.err) == (0, "")
    event, *rows = ran.rows
    assert (event["kind"], event["status"], event["s"]) == ("event", "none", None)
    skipped, *points = [row for row in rows if row["kind"] == "point"]
    assert skipped["status"] == "skipped"
    assert skipped["reason"].startswith("unrolled-ad[inner=jacobi]")
    assert [row["route"] for row in points] == ["tangent", "fd-central"] * 7
    for row in points:
        assert row["active_set"] is None
        assert row["gradient_error"] < (1e-8 if row["route"] == "fd-central" else 1e-12)
        for side in ("forward", "backward"):
            assert row[f"quotient_{side}"] == pytest.approx(row["slope"], abs=1e-6)
    tips = [row["tip"] for row in points]
    assert tips == sorted(tips, reverse=True)
    assert {row["route"] for row in rows if row["kind"] == "trade"} == {"tangent"}
    out = cli(*arguments, "--route", "unrolled-ad[inner=jacobi]", "--points", "7", "--no-plot").out
    assert "dJ/ds at s = 0.25 dJ/ds at s = 4 worst in the sweep" in out
    assert "skipped: unrolled-ad[inner=jacobi]: " in out


def test_a_rounded_stop_that_no_route_runs_on_is_swept_without_its_trade(cli) -> None:
    ran = run(cli, "bar[stop=softplus]", "--points", "2", route="unrolled-ad[inner=jacobi]")
    assert (ran.code, ran.err.count("\n")) == (0, 1)
    assert "the cost of the width is left out" in ran.err


@pytest.mark.parametrize("law", ["penalty", "softplus"])
def test_a_bar_that_cannot_be_solved_is_exit_code_1(cli, law: str) -> None:
    ran = run(cli, f"bar[stop={law},k_c=1e20]", "--max-steps", "1", "--range", "0.25", "1", "--points", "3")
    assert (ran.code, ran.err) == (1, "")
    assert ran.out.startswith(f"bar[stop={law},k_c=1e20]: no s from 0.25 to 1")
    assert "not converged in 1 steps" in ran.out


def test_exact_contact_that_cannot_be_solved_leaves_the_sweep(cli) -> None:
    """One step finds the open bar, and no other: at s = 1 it would be closed."""
    ran = run(cli, "bar[stop=quadratic]", "--max-steps", "1", "--points", "3", "--range", "2", "4", "--json")
    assert (ran.code, ran.err.count("\n")) == (1, 1)
    assert ran.err.startswith("routes: kink: the cost of the contact law is not known: bar: not converged in 1 steps")
    assert [(row["kind"], row["status"]) for row in ran.rows] == [("event", "none")] + 3 * [("point", "ok")]


def test_a_jump_is_seen_beside_its_wall() -> None:
    points = [(1.0, -1.0, "a"), (2.0, -1.0, "a"), (3.0, 1.0, "b"), (4.0, 1.0, "b")]
    lines = panel(points, "y", "x", 40, 5, wall=2.5).plain.splitlines()
    assert all(len(line) <= 40 for line in lines)
    assert [line[:4] for line in lines[1:6]] == [" 1 +", "   |", " 0 +", "   |", "-1 +"]
    top, bottom = lines[1], lines[5]
    assert top.index(":") < top.index("b") < top.rindex("b")
    assert bottom.index("a") < bottom.rindex("a") < bottom.index(":")
    assert lines[-1].split() == ["1", "2.5", "x", "=", "4"]
