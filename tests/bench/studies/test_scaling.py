"""How bills grow: fits against closed forms, exact counts, routes that end at caps, and where routes break even."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import asdict, replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console
from scipy.optimize import minimize_scalar

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.registry import study_tables
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution import sweep as runner
from gradient_routes.bench.execution import timing
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.scaling import break_even_view as break_even
from gradient_routes.bench.studies.scaling import race
from gradient_routes.bench.studies.scaling.checkpoints import checkpoints, every_kind
from gradient_routes.bench.studies.scaling.climbing import extrapolated
from gradient_routes.bench.studies.scaling.crossing import cheaper, crossing, exact, line
from gradient_routes.bench.studies.scaling.measure import Scaling, abscissas, scaling
from gradient_routes.bench.studies.scaling.power_law import fit
from gradient_routes.bench.studies.scaling.race import doublings
from gradient_routes.bench.studies.scaling.sizes import Sizes, sizes
from gradient_routes.routes.tally import Tally, Work

QUICK = Settings(min_time=0.0)
QUICK_BUDGET = 0.3
FORWARD = 7  # counts of a solve of the bar: itself, a step, two residuals, assembly, factorization, substitution
EIGHTS = 8.0 * 8.0 ** np.arange(6)


def sizes_of(selector: str, first: int | None = None, growth: float = 2.0, levels: int = 3) -> Sizes:
    return sizes(case.problems([selector]), first, growth, levels)


def study(selector: str, *routes: str, settings: Settings = QUICK, **options) -> Scaling:
    return scaling(sizes_of(selector, **options), case.routes(routes), settings)


class Clock:
    """Tells the time of a machine on which a look at it and everything that is counted take TICK: equal work takes
    equal seconds, whoever else is at work.
    """

    TICK = 1e-4

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.ticks = 0
        count = Tally.count

        def counted(tally: Tally, kind: str, times: int = 1) -> None:
            self.ticks += times
            count(tally, kind, times)

        patch.setattr(Tally, "count", counted)
        for module in (timing, race):
            patch.setattr(module, "time", self)

    def perf_counter(self) -> float:
        self.ticks += 1
        return self.ticks * self.TICK

    process_time = perf_counter


# fits


@pytest.mark.parametrize("noise", [0.01, 0.05])
@pytest.mark.parametrize("overhead", [0.0, 30.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_the_exponent_is_within_its_interval_as_often_as_promised(
    exponent: float, overhead: float, noise: float
) -> None:
    """95 % of 100 seeds, less 4.5 standard deviations of that count. Overhead is in units of y at n = 8."""
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(100):
        y = (overhead * EIGHTS[0] ** exponent + EIGHTS**exponent) * np.exp(noise * rng.standard_normal(len(EIGHTS)))
        found = fit(EIGHTS, y)
        assert found.law == "power"
        hits += found.exponent_low <= exponent <= found.exponent_high
        assert abs(found.exponent - exponent) < 10 * noise
    assert hits >= 85


def test_sizes_that_show_the_overhead_are_left_out() -> None:
    found = fit(EIGHTS, 100.0 + EIGHTS)
    assert found.constant == pytest.approx(100.0, rel=1e-3)
    assert (found.points, found.fitted_from, found.fitted_to) == (3, EIGHTS[3], EIGHTS[-1])
    assert found.exponent == pytest.approx(1.0, abs=1e-3)
    assert found.fit_residual < 1e-3
    plain = fit(EIGHTS[::-1], 3.0 * EIGHTS[::-1] ** 2)
    assert (plain.points, plain.constant) == (6, 0.0)
    assert (plain.exponent, plain.prefactor) == (pytest.approx(2.0), pytest.approx(3.0))


@pytest.mark.parametrize(
    ("x", "y", "why"),
    [
        ([1, 2], [1.0, 2.0], "2 sizes, 3 are needed"),
        ([1], [1.0], "1 size, 3 are needed"),
        ([], [], "0 sizes, 3 are needed"),
        ([1, 2, 4], [1.0, 1.1, 1.3], "grows x 1.3 only over 3 sizes"),
        (EIGHTS, 1e5 + EIGHTS, "overhead is more than 10 % at 6 of 6 sizes"),
    ],
)
def test_what_shows_no_growth_has_no_exponent(x, y, why: str) -> None:
    found = fit(x, y)
    assert (found.law, found.exponent, found.no_law) == (None, None, why)


def test_counts_are_lines_exactly_or_fitted() -> None:
    n = [8, 64, 512]
    assert (fit(n, [9, 65, 513], True).exponent, fit(n, [9, 65, 513], True).constant) == (1.0, 1.0)
    constant = fit(n, [2, 2, 2], True)
    assert (constant.law, constant.exponent, constant.exponent_high, constant.constant) == ("affine", 0.0, 0.0, 2.0)
    bent = fit(n, [16, 128, 1026], True)
    assert bent.law == "power"
    assert bent.exponent_low < 1.0 < bent.exponent_high
    assert fit(n, [2, 3, 3], True).no_law == "grows x 1.5 only over 3 sizes"


@pytest.mark.parametrize("known", [(1.0, 0.2, 2.0, 0.001), (1.0, 1.0, 2.0, 0.0)])
def test_known_lines_cross_where_they_do(known: tuple[float, ...]) -> None:
    """Fieller's interval of independent fits is a little wide: 95 % or more of 200 seeds, less 4.4 deviations."""
    a, b, c, d = known
    m, truth = 2.0 ** np.arange(6), (c - a) / (b - d)
    assert crossing(exact(a, b), exact(c, d)).at == pytest.approx(truth)
    rng = np.random.default_rng(0)
    hits = 0
    for _ in range(200):
        noise = np.exp(0.02 * rng.standard_normal((2, len(m))))
        met = crossing(line(m, (a + b * m) * noise[0]), line(m, (c + d * m) * noise[1]))
        hits += met.low <= truth <= met.high
    assert hits >= 176


def test_no_parameter_costs_less_than_nothing() -> None:
    """Of 200 fits to a cost that has no slope half are clipped to 0, and what is clipped keeps its uncertainty."""
    m, rng = 2.0 ** np.arange(4), np.random.default_rng(0)
    fits = [line(m, np.exp(0.1 * rng.standard_normal(4))) for _ in range(200)]
    clipped = [found for found in fits if found.each == 0.0]
    assert min(found.each for found in fits) == 0.0
    assert 60 < len(clipped) < 140
    assert all(found.covariance[1, 1] > 0.0 for found in clipped)
    falling = line([1, 2, 4, 8], [20.0, 22.0, 18.0, 14.0])
    assert falling.each == 0.0
    best = minimize_scalar(lambda t: sum((t / s - 1) ** 2 for s in (20.0, 22.0, 18.0, 14.0)))
    assert falling.fixed == pytest.approx(best.x)


def test_a_cost_that_noise_makes_negative_is_not_resolved_on_the_screen(bars: Scaling) -> None:
    noisy = {"other_each_s": 0.0, "break_even": -0.969, "break_even_low": -12.9, "break_even_high": 1.04}
    found = bars.break_evens[0] | noisy
    screen = StringIO()
    console = Console(file=screen, width=120)
    console.print(break_even.table([found]), break_even.lines([found]))
    assert "below 0 (up to 1.04)" in screen.getvalue()
    assert screen.getvalue().splitlines()[-1].endswith("not resolved")
    assert "-0.969" not in screen.getvalue()


def test_lines_that_do_not_cross_are_said_not_to() -> None:
    names = ("tangent", "adjoint")
    assert cheaper(names, (exact(1, 0.5), exact(3, 0.1)), 8) == "adjoint is cheaper from n_p = 6 on"
    assert cheaper(names, (exact(3, 0.1), exact(1, 0.5)), 8) == "tangent is cheaper from n_p = 6 on"
    assert cheaper(names, (exact(2, 0.5), exact(1, 0.1)), 8) == "adjoint is cheaper from the first parameter on"
    assert cheaper(names, (exact(1, 0.5), exact(1.2, 0.1)), 8) == "adjoint is cheaper from the first parameter on"
    parallel = cheaper(names, (exact(1, 0.5), exact(2, 0.5)), 8)
    assert parallel == "not told apart by what a parameter costs; at n_p = 8 tangent is cheaper"
    assert crossing(exact(1, 0.5), exact(2, 0.5)).at is None
    assert crossing(exact(2, 0.5), exact(1, 0.1)).at == pytest.approx(-2.5), "nowhere that parameters are"
    noisy = line([1, 2, 4, 8], [1.0, 1.3, 0.8, 1.2]), line([1, 2, 4, 8], [1.1, 0.9, 1.3, 1.0])
    assert crossing(*noisy).at is None
    assert cheaper(names, noisy, 8).startswith("not told apart")


# sizes and caps


def test_sizes_grow_by_unknowns() -> None:
    assert [spec.options["n"] for spec in sizes_of("bar", growth=8, levels=4).specs] == [8, 64, 512, 4096]
    assert [spec.options["n"] for spec in sizes_of("advection", first=4, growth=4).specs] == [4, 8, 16]
    assert [spec.options["n"] for spec in sizes_of("bar[n=3]", growth=1.01).specs] == [3, 4, 5]
    given = sizes_of("block[nx=1,ny=2|1,nz=3|1]")
    assert [given.label(spec) for spec in given.specs] == ["ny=1,nz=1", "ny=2,nz=1", "ny=1,nz=3", "ny=2,nz=3"]
    assert "ny" not in given.family
    assert given.family["nx"] == 1
    assert doublings(8) == [1, 2, 4, 8]
    assert doublings(3) == [1, 2, 3]
    assert doublings(1) == [1]


def pretended(statuses: dict[int, str]):
    """A measure whose seconds are n^2 ms, with other statuses than ok at some n, and its calls."""
    calls: list[tuple[int, list[str]]] = []

    def measure(problems, routes, settings) -> Iterator[Outcome]:
        (spec,) = problems
        n = spec.options["n"]
        calls.append((n, [route.route.name for route in routes]))
        for route in reversed(routes):  # in whatever order
            name = route.route.name
            row = empty_row() | {"problem": "bar", "problem_options": spec.options, "route": name, "n_state": n}
            row |= {"route_options": route.options, "n_param": n, "at": "start", "reason": "because"}
            status = statuses.get(n, "ok") if name == "adjoint" else "ok"
            times = {"seconds": 1e-3 * n**2, "seconds_min": 1e-3 * n**2, "forward_s": 1e-3, "forward_ratio": 1.0}
            timed = times if status == "ok" else {}
            yield Outcome(row | timed | {"status": status})

    return measure, calls


@pytest.mark.parametrize("cap", ["skipped", "pruned", "timeout", "out-of-memory"])
def test_a_route_ends_at_a_cap_and_the_others_go_on(cap: str) -> None:
    measure, calls = pretended({16: cap})
    done = scaling(sizes_of("bar"), case.routes(["adjoint", "complex-step"]), QUICK, measure=measure)
    assert calls == [(8, ["adjoint", "complex-step"]), (16, ["adjoint", "complex-step"]), (32, ["complex-step"])]
    ended, other = done.series
    assert ended.stopped_by == f"{cap}: because"
    assert other.stopped_by == "no larger size asked for"
    (found,) = [g for g in done.growths if (g.route, g.quantity) == ("adjoint", "seconds")]
    assert (found.largest, found.stopped_by) == (8, f"{cap}: because")
    (found,) = [g for g in done.growths if (g.route, g.quantity) == ("complex-step", "seconds")]
    assert found.fit.exponent == pytest.approx(2.0)


def test_an_error_is_no_cap() -> None:
    measure, calls = pretended({16: "failed"})
    done = scaling(sizes_of("bar"), case.routes(["adjoint"]), QUICK, measure=measure)
    assert [n for n, _ in calls] == [8, 16, 32]
    assert [row["n_state"] for row in done.series[0].rows] == [8, 32]


def test_what_extrapolates_beyond_the_budget_is_not_tried() -> None:
    measure, calls = pretended({})
    routes = case.routes(["adjoint"])
    done = scaling(sizes_of("bar", levels=6), routes, replace(QUICK, budget=2.0), measure=measure)
    assert [n for n, _ in calls] == [8, 16, 32], "64^2 ms are 4.1 s"
    assert done.series[0].stopped_by == "pruned: n=64 extrapolates to 4.1 s > --budget 2 s"
    assert extrapolated((8, 1.0), (8, 2.0), 64) == 2.0


def test_an_interrupt_keeps_what_is_measured() -> None:
    def measure(problems, routes, settings) -> Iterator[Outcome]:
        if problems[0].options["n"] == 16:
            raise KeyboardInterrupt
        return runner.run(problems, routes, settings)

    done = scaling(sizes_of("bar"), case.routes(["adjoint"]), QUICK, measure=measure)
    assert done.interrupted
    assert [row["n_state"] for row in done.rows] == [8]
    assert done.series[0].stopped_by == "interrupted: at n=16"
    with pytest.raises(KeyboardInterrupt):
        scaling(sizes_of("bar", first=16), case.routes(["adjoint"]), QUICK, measure=measure)


def test_an_interrupt_between_cases_is_no_end_of_the_sizes() -> None:
    measure, _ = pretended({})

    def taken(outcome: Outcome) -> None:
        if outcome.row["n_state"] == 16:
            signal.raise_signal(signal.SIGINT)
        kept.append(outcome.row["n_state"])

    kept: list[int] = []
    done = scaling(sizes_of("bar"), case.routes(["adjoint"]), QUICK, taken, measure)
    assert (done.interrupted, kept) == (True, [8, 16])
    assert done.series[0].stopped_by == "interrupted: at n=16"


# real routes


@pytest.fixture(scope="module")
def bars() -> Iterator[Scaling]:
    with pytest.MonkeyPatch.context() as patch:
        Clock(patch)
        yield study("bar[n=8|16|32|64]", "adjoint", "tangent", "fd-one-sided", "fd-central")


def test_work_on_the_bar_grows_as_the_textbook_says(bars: Scaling) -> None:
    """One forward and one transposed solve; a substitution a parameter; n_p + 1 and 2 n_p forward solves."""
    laws = {(g.route, g.quantity): g.fit for g in bars.growths if g.fit.law == "affine"}
    lines = {key: (law.exponent, law.prefactor, law.constant) for key, law in laws.items()}
    assert lines["adjoint", "forward_solves"] == (0.0, 0.0, 1.0)
    assert lines["adjoint", "substitutions"] == (0.0, 0.0, 2.0)
    assert lines["tangent", "forward_solves"] == (0.0, 0.0, 1.0)
    assert lines["tangent", "substitutions"] == (1.0, 1.0, 1.0)
    assert lines["fd-one-sided", "forward_solves"] == (1.0, 1.0, 1.0)
    assert lines["fd-central", "factorizations"] == (1.0, 2.0, 0.0)
    assert {g.against for g in bars.growths} == {"n_state"}, "n_u = n_p: one law for both"


def test_routes_race_on_the_largest_bar(bars: Scaling) -> None:
    assert bars.no_break_even is None
    pairs = {(b["route"], b["other"]): b for b in bars.break_evens}
    assert ("fd-central", "tangent") in pairs
    found = pairs["tangent", "adjoint"]
    assert [found[name] for name in ("n_state", "n_param", "m_largest", "points")] == [64, 64, 64, 7]
    assert found["predicted"] == pytest.approx(1.0), "m substitutions against one"
    assert pairs["fd-central", "adjoint"]["predicted"] < 1.0
    differences = pairs["fd-central", "adjoint"]
    assert differences["each_s"] == pytest.approx(2 * FORWARD * Clock.TICK)
    assert differences["other_each_s"] == pytest.approx(0.0, abs=1e-6 * Clock.TICK)
    assert pairs["tangent", "adjoint"]["each_s"] == pytest.approx(Clock.TICK), "a substitution each"
    assert differences["break_even"] == pytest.approx(
        differences["other_fixed_s"] / differences["each_s"] - 1 / 2 / FORWARD
    )


def test_iterations_are_an_abscissa_too() -> None:
    done = study("bar[n=2]", "unrolled-ad[inner=jacobi,iterations=10|20|40]", levels=1)
    laws = {g.quantity: g.fit for g in done.growths}
    assert {g.against for g in done.growths} == {"iterations"}
    assert (laws["products"].law, laws["products"].prefactor) == ("affine", 2.0)
    assert laws["tape_bytes"].law == "affine"
    assert done.no_break_even.startswith("takes two of")


def test_n_u_and_n_p_are_told_apart_where_they_can_be() -> None:
    def rows(*pairs):
        return [{"n_state": n_u, "n_param": n_p} for n_u, n_p in pairs]

    bar = sizes_of("bar")
    assert abscissas(bar, rows((8, 8), (16, 16))) == ("n_state",)
    assert abscissas(bar, rows((8, 4), (16, 8))) == ("n_state",)
    assert abscissas(bar, rows((8, 2), (16, 2))) == ("n_state",)
    assert abscissas(bar, rows((8, 2), (8, 4))) == ("n_param",)
    assert abscissas(bar, rows((54, 8), (144, 27))) == ("n_state", "n_param")


def test_the_command_prints_rows_and_keeps_them(cli) -> None:
    options = ("--min-time", "0", "--json")
    ran = cli("scaling", "--problem", "bar[n=2|4|8]", "--route", "adjoint", "--route", "tangent", *options)
    assert (ran.code, ran.err) == (0, "")
    tables = {name: [row for row in ran.rows if row["table"] == name] for name in ("cases", *study_tables())}
    assert len(tables["cases"]) == 6
    for name in ("scaling_fits", "break_even"):
        assert tables[name]
        assert all(row.keys() - {"table"} == {c.name for c in study_tables()[name].columns} for row in tables[name])
        _, kept = Store(Path("results/routes.sqlite")).table(name)
        assert len(kept) == len(tables[name])
    assert len(Store(Path("results/routes.sqlite")).rows()) == 6


def test_the_screen_tells_how_it_grows(cli) -> None:
    routes = ("--route", "adjoint", "--route", "fd-one-sided", "--min-time", "0", "--no-store")
    out = cli("scaling", "--problem", "bar", "--levels", "3", *routes).out
    for words in (
        "A adjoint",
        "bar: what a gradient costs",
        "n=128",
        "n + 1 fwd",
        "1 fwd, 1 fac, 2 sub",
        "n = n_u = n_p",
        "the largest size under the caps",
        "no larger size asked for",
        "break-even on bar[n=128]",
        "fd-one-sided, adjoint",
    ):
        assert words in out
    out = cli(
        "scaling", "--problem", "block[n=1|2|3,derivatives=hand]", "--route", "tangent", *routes[4:], "--no-plot"
    ).out
    assert "n_u and n_p grow together" in out
    assert "2 n_p + 4 sub" in out
    assert "T tangent" not in out


def test_nothing_measured_is_exit_code_1(cli) -> None:
    ran = cli("scaling", "--problem", "bar", "--route", "adjoint", "--budget", "1e-9", "--no-store")
    assert ran.code == 1
    assert "none" in ran.out
    assert "skipped: predicted bill" in ran.out


def test_along_steps_the_least_memory_over_k_is_found() -> None:
    """The fewest states are at k = 8 = sqrt(T); steps marched again by formula."""
    asked = "vibrating-bar[n=2,steps=16|32|64]"
    done = study(asked, *every_kind(sizes_of(asked)))
    last = {row["route_options"]["checkpoint"]: row for row in done.checkpoints if row["steps"] == 64}
    k = {name: row["interval"] for name, row in last.items()}
    assert k == {"all": 64, "every=4": 4, "sqrt": 8, "revolve=10": None, "none": None}
    again = {name: row["recomputed"] for name, row in last.items()}
    assert again == {"all": 0, "every=4": 3 * 15, "sqrt": 7 * 7, "revolve=10": 2 * 64 - 12 - 64 + 1, "none": 63 * 31}
    assert {row["interval"] for row in done.checkpoints if row["least"] and row["steps"] == 64} == {8}
    laws = {(g.quantity, g.route_options["checkpoint"]): g for g in done.growths}
    law = laws["recomputed", "every=4"]
    assert (law.against, law.fit.law, law.fit.prefactor, law.fit.constant) == ("steps", "affine", 0.75, -3.0)


def march(k: int, T: int, peak: float | None) -> dict:
    """A row of a march of `T` steps, kept after every k."""
    work = asdict(Work(forward_solves=1, steps=T))
    of = {"problem": "bar", "problem_options": {"steps": T}, "route": "adjoint", "n_state": 4 * T, "peak_bytes": peak}
    return empty_row() | of | {"route_options": {"checkpoint": f"every={k}"}, "status": "ok", "work": work}


@pytest.mark.parametrize(
    ("peaks", "least"),
    [
        ((9e6, 4e6, 3e6, 5e6), (40, "measured")),
        ((9e6, 4e6, 1e6, 5e6), (40, "measured")),  # one is below the resolution, hence the least
        ((9e6, 9e5, 8e5, 5e6), (10, "counted")),
        ((9e6, 9e5, None, 5e6), (10, "counted")),
        ((9e6, 4e6), None),
    ],
)
def test_what_is_not_resolved_is_not_the_least(peaks: tuple, least: tuple | None) -> None:
    rows = checkpoints([march(k, 100, peak) for k, peak in zip((2, 10, 40, 100), peaks, strict=False)])
    assert [(row["interval"], row["least"]) for row in rows if row["least"]] == ([least] if least else [])
    assert [row["states_kept"] for row in rows] == [49 + 3, 9 + 11, 2 + 40, 101][: len(peaks)]


def test_the_screen_marks_the_least_memory(cli) -> None:
    words = (
        "--axis",
        "steps",
        "--from",
        "16",
        "--growth",
        "2",
        "--levels",
        "2",
        "--min-time",
        "0",
        "--no-store",
        "--no-isolate",
    )
    ran = cli("scaling", "--problem", "vibrating-bar[n=2]", "--route", "adjoint[checkpoint=every=1|sqrt|all]", *words)
    assert (ran.code, ran.err) == (0, "")
    for said in (
        "steps=32",
        "vibrating-bar[n=2,steps=32]: what checkpoints keep and march again",
        "adjoint: fewest states 11 at k = 6, sqrt(T) = 5.66; peaks below 1 MiB are not told apart",
        "T = 32: memory [byte]",
    ):
        assert said in ran.out


WRONG = {
    "--problem bar --axis steps": "bar: has no whole number steps to climb by",
    "--problem vibrating-bar --axis mesh": "vibrating-bar: has no whole number mesh to climb by",
    "--problem vibrating-bar --axis dt": "vibrating-bar: has no whole number dt to climb by",
    "--problem vibrating-bar[n=4|8] --axis steps": "--axis steps: the grid is one over n",
    "--problem vibrating-bar --axis steps --route adjoint[checkpoint=sqrt|every=99]": "every=99 of 60 steps - choose 1",
    "--problem all": "name one problem",
    "--problem bar --growth 1": "--growth 1 - give a number > 1",
    "--problem bar --levels 0": "--levels 0 - give a whole number from 1",
    "--problem bar --from 0": "--from 0 - give a whole number from 1",
    "--problem bar --min-time -1": "--min-time",
    "--problem bar --budget nan": "--budget",
    "--problem bar[n=8|16] --levels 3": "the sizes are those of the grid",
    "--problem bar[n=8|16] --from 3": "the sizes are those of the grid",
    "--problem bar[stop=none|penalty]": "stop=none is no size",
    "--problem bar[n=8|16,alpha=0|1]": "alpha=0.0 is no size",
    "--problem block[nx=1,ny=1,nz=1]": "give a grid of sizes",
}


@pytest.mark.parametrize("arguments", WRONG)
def test_wrong_usage_is_one_line(cli, arguments: str) -> None:
    ran = cli("scaling", "--no-store", "--route", "adjoint", *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert WRONG[arguments] in ran.err


def test_a_problem_without_n_needs_a_grid(cli) -> None:
    Path("spring.py").write_text(SPRING)
    ran = cli("scaling", "--no-store", "--problem", "spring.py:Spring", "--route", "adjoint")
    assert (ran.code, ran.err.count("\n")) == (2, 1)
    assert "has no whole number n to climb by - give a grid" in ran.err


SPRING = """
from gradient_routes.problems.bar import Bar


class Spring(Bar):
    def __init__(self, *, stiff: bool = True) -> None:
        super().__init__(n=1)
"""


def test_routes_too_dear_as_a_whole_race_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """3001 forward solves are over the budget, the 285 of a race are not."""
    Clock(monkeypatch)
    assert 285 < QUICK_BUDGET / (FORWARD * Clock.TICK) < 3001
    done = study("bar[n=3000|4000]", "adjoint", "fd-one-sided", settings=replace(QUICK, budget=QUICK_BUDGET))
    assert [row["status"] for row in done.rows if row["route"] == "fd-one-sided"] == ["skipped"]
    (found,) = done.break_evens
    assert (found["route"], found["other"]) == ("fd-one-sided", "adjoint")
    assert found["each_s"] == pytest.approx(FORWARD * Clock.TICK)
    assert found["other_each_s"] == pytest.approx(0.0, abs=1e-6 * Clock.TICK)
