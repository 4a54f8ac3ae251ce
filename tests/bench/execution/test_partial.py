"""A part of a gradient is V^T of the whole, at the declared price; judges in random directions are not fooled."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from conftest import ROUTES, somewhere
from duffing.problem import Duffing
from test_routes import ACCURACY, ZOO, differentiate, ids, pairs, reference, without_iterations

from gradient_routes.bench.cases.case import Case, ProblemSpec, RouteSpec
from gradient_routes.bench.cases.partial import Partial
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution import references
from gradient_routes.bench.execution.case_context import CaseContext
from gradient_routes.bench.execution.executors.in_process import InProcess
from gradient_routes.bench.execution.executors.running import alone
from gradient_routes.bench.execution.references import Judge, Judges, error
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import DomainError, InputError
from gradient_routes.problems.problem import Array, Linearization, Offers, Parameters, Problem, Reference
from gradient_routes.problems.subspace import Subspace, components, directions
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Result, Route
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

PARTS: dict[str, Callable[[Problem, Array], Subspace]] = {
    "components": lambda problem, p: components(problem, p, np.arange(0, len(p), 2)),
    "directions": lambda problem, p: directions(problem, p, 3, seed=1),
}
TRACED = (implicit_ad, unrolled_ad)
SMALL = ("bar[n=1]", "bar[raw,alpha]", "duffing", "block[n=2]")


def parts() -> Iterator[tuple[str, str, Route, dict]]:
    """Directions by one set of options of every route: those know neither kind of part. On the block, which compiles
    long, what is traced has them alone.
    """
    cases = [case for case in pairs(iterated=()) if case[0] in SMALL]
    yield from (("components", *case) for case in cases if case[0] != "block[n=2]" or case[1] not in TRACED)
    yield from (
        ("directions", *case) for case in {(name, route.name): (name, route, o) for name, route, o in cases}.values()
    )


def whole(problem: Problem, few: Subspace, p: Array) -> Reference:
    """V^T of the gradient of the whole, with the size of its terms."""
    full, V = reference(problem, p), np.column_stack([few.V @ e for e in np.eye(len(few.parameters))])
    return Reference("whole", V.T @ full.gradient, float(np.linalg.norm(V)) * full.size)


@pytest.mark.parametrize(("part", "name", "route", "options"), list(parts()), ids=ids)
def test_every_route_gives_that_part_of_the_whole(part: str, name: str, route: Route, options: dict) -> None:
    problem = ZOO[name]
    p = somewhere(problem)
    few = PARTS[part](problem, p)
    result, counted, declared = differentiate(route, few, few.parameters.start, **options)
    assert error(result.gradient, whole(problem, few, p))[0] < ACCURACY.get(route.name, 1e-11)
    assert result.J is None or result.J == pytest.approx(Model(problem).value(p), rel=1e-9)
    assert counted == declared


@pytest.mark.parametrize(
    ("part", "name", "route", "options"),
    [case for case in parts() if case[1] != "block[n=2]" and without_iterations(case[1], case[3])],
    ids=ids,
)
def test_the_part_has_its_declared_price(part: str, name: str, route: Route, options: dict) -> None:
    """To the tolerance users have, where the test above is tight."""
    problem = ZOO[name]
    few = PARTS[part](problem, problem.parameters.start)
    _, counted, declared = differentiate(route, few, few.parameters.start, Solver(), **options)
    assert counted == declared


@pytest.mark.parametrize("name", SMALL)
@pytest.mark.parametrize("part", PARTS)
def test_a_part_promises_what_the_whole_does(part: str, name: str) -> None:
    problem = ZOO[name]
    p = somewhere(problem)
    few = PARTS[part](problem, p)
    c, u = few.parameters.start, 0.01 * np.random.default_rng(0).standard_normal(problem.n_state)
    for attribute in "name offers structure linear offset matrix_free n_state notes".split():
        assert getattr(few, attribute) == getattr(problem, attribute)
    np.testing.assert_array_equal(few.p(c), p)
    np.testing.assert_array_equal(few.residual(u, c), problem.residual(u, p))
    assert few.condition(c) == problem.condition(p)
    R_p, lam = few.linearize(u, c).R_p, np.random.default_rng(1).standard_normal(problem.n_state)
    v = np.random.default_rng(2).standard_normal(len(c))
    assert lam @ (R_p @ v) == pytest.approx((R_p.T @ lam) @ v, rel=1e-12, abs=1e-12)
    assert R_p.T.T @ v == pytest.approx(R_p @ v)
    own = few.reference(c)
    assert (own is None) == (problem.reference(p) is None)
    assert own is None or own.size >= np.linalg.norm(own.gradient) * (1 - 1e-12)


def test_components_are_the_parameters_themselves() -> None:
    """Same step, same perturbed p: the finite differences of a component are those of the whole, bit by bit."""
    bar = Bar(parametrization="raw")
    p = somewhere(bar)
    few, index = components(bar, p, np.array([1, 6])), [1, 6]
    of, inner = few.parameters, bar.parameters
    assert [of.label(j) for j in (0, 1)] == ["E_2", "E_7"]
    assert [of.unit_of(j) for j in (0, 1)] == ["Pa", "Pa"]
    assert [of.bounds(j) for j in (0, 1)] == [inner.bounds(i) for i in index]
    np.testing.assert_array_equal(of.position, inner.position[index])
    every = fd_central.prepare(Model(bar), p)(p).gradient
    np.testing.assert_array_equal(fd_central.prepare(Model(few), p[index])(p[index]).gradient, every[index])
    with pytest.raises(DomainError, match=r"E_7 = -1 is outside 0 < E_7"):
        of.check(np.array([1.0, -1.0]), "test")


def test_directions_stay_in_the_domain_of_the_whole() -> None:
    bar = Bar(parametrization="raw")
    few = directions(bar, bar.parameters.start, 2, seed=0)
    assert few.parameters.label(0) == "direction 1"
    for j in (0, 1):
        lower, upper = few.parameters.bounds(j)
        e = np.eye(2)[j]
        for c, inside in ((0.99 * lower, True), (1.01 * lower, False), (0.99 * upper, True), (1.01 * upper, False)):
            p = few.p(c * e)
            assert ((p > 0.0) & (p < bar.parameters.bounds(0)[1])).all() == inside
    many = directions(bar, bar.parameters.start, 20, seed=0).parameters
    together = 0.99 * np.broadcast_to(many.upper, 20)
    with pytest.raises(DomainError, match=r"E_\d = .* is outside 0 < E_"):
        many.check(together, "test")


def test_directions_are_seeded() -> None:
    bar = Bar()
    V = [directions(bar, bar.parameters.start, 2, seed).V for seed in (0, 0, 1)]
    np.testing.assert_array_equal(V[0], V[1])
    assert not np.allclose(V[0], V[2])


def test_positions_have_a_shape() -> None:
    with pytest.raises(InputError, match=r"positions \(2, 4\) of 3 parameters - give \(3, d\), d <= 3"):
        Parameters(start=np.zeros(3), scale=np.ones(3), position=np.zeros((2, 4)))


class Long(Bar):
    """A bar that keeps its closed form to itself."""

    def reference(self, p: Array) -> None:
        return None


class RealBar(Long):
    """That cannot take complex numbers, either."""

    offers = Offers.LINEARIZE


LONG = Long(n=500, sensors=500)


def judged(problem: Problem, route: Route, p: Array | None = None, bill: str | None = None) -> Judge | str:
    p = problem.parameters.start if p is None else p
    return Judges(Model(problem), p, lambda route, n: bill).judge(route)


@pytest.mark.parametrize(
    ("problem", "route", "name"),
    [
        (LONG, adjoint, "complex-step in 3 random directions"),
        (LONG, complex_step, "tangent in 3 random directions"),
        (RealBar(n=500), adjoint, "tangent in 3 random directions"),
        (Bar(n=500), adjoint, "closed form"),
        (Long(n=200), adjoint, "complex-step"),
        (Long(n=200), complex_step, "tangent"),
        (RealBar(n=200), adjoint, "tangent"),
    ],
    ids=ids,
)
def test_who_judges(problem: Problem, route: Route, name: str) -> None:
    judge = judged(problem, route)
    assert isinstance(judge, Judge)
    p = problem.parameters.start
    relative, against = judge.error(route.prepare(Model(problem), p)(p).gradient)
    assert against == name
    assert relative < 1e-12
    assert (judge.whole is None) == ("directions" in name)


@pytest.mark.parametrize("component", [0, 250, 498])
@pytest.mark.parametrize("wrong", [0.3, 1e-4, 1e-9])
@pytest.mark.parametrize("route", [adjoint, complex_step], ids=ids)
def test_one_wrong_component_of_500_is_seen(route: Route, wrong: float, component: int) -> None:
    """|V^T d| of a d in one component is within a factor two of sqrt(3) |d|, whichever it is."""
    p = somewhere(LONG)
    judge = judged(LONG, route, p)
    assert isinstance(judge, Judge)
    g = LONG.linearize(np.zeros(500), p).J_p + Bar(n=500, sensors=500).reference(p).gradient
    assert judge.error(g)[0] < 1e-11
    g[component] += wrong * np.linalg.norm(g)
    assert 0.2 * wrong < judge.error(g)[0] < 5.0 * wrong


@pytest.mark.parametrize("name", ["duffing", "block[n=2]", "block[follower]"])
@pytest.mark.parametrize("route", [adjoint, complex_step], ids=ids)
def test_slopes_are_those_of_the_gradient(name: str, route: Route, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(references, "WHOLE", 0)
    problem = ZOO[name]
    p = somewhere(problem)
    judge = judged(problem, route, p)
    assert isinstance(judge, Judge)
    assert "in 3 random directions" in judge.reference.name
    assert judge.error(reference(problem, p).gradient)[0] < 1e-12


class WrongTangent(Duffing):
    """Newton converges all the same, more slowly; adjoint and tangent are wrong alike."""

    def tangent(self, u: Array, p: Array) -> Array:
        return 1.03 * super().tangent(u, p)


class WrongRp(Duffing):
    def linearize(self, u: Array, p: Array) -> Linearization:
        lin = super().linearize(u, p)
        return Linearization(1.03 * np.asarray(lin.R_p), lin.J_u, lin.J_p)


@pytest.mark.parametrize("problem", [WrongTangent(), WrongRp()], ids=["R_u", "R_p"])
def test_wrong_partial_derivatives_do_not_judge_themselves(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(references, "WHOLE", 0)
    p = problem.parameters.start
    judge = judged(problem, adjoint)
    assert isinstance(judge, Judge)
    assert judge.error(reference(Duffing(), p).gradient)[0] < 1e-9
    assert judge.error(adjoint.prepare(Model(problem), p)(p).gradient)[0] == pytest.approx(0.03, rel=0.1)


class NoComplex(Long):
    def residual(self, u: Array, p: Array, xp=np) -> Array:
        if np.iscomplexobj(p):
            raise TypeError("only real numbers\nhere")
        return super().residual(u, p, xp)


def test_a_judge_that_fails_leaves_it_to_the_next() -> None:
    judge = judged(NoComplex(n=300), adjoint)
    assert isinstance(judge, Judge)
    assert judge.reference.name == "tangent in 3 random directions"
    says = "bar: complex step lost: residual raises TypeError for complex u: only real numbers here"
    assert says in str(judge.instead)
    assert says in str(judged(NoComplex(n=300), tangent))


class RealObjective(Long):
    """Its complex steps would convict every route of the same error."""

    def objective(self, u: Array, p: Array, xp=np) -> Array:
        return super().objective(u, p, xp).real


class RealResidual(Long):
    def residual(self, u: Array, p: Array, xp=np) -> Array:
        return super().residual(u, p, xp).real


@pytest.mark.parametrize("n", [8, 300])
@pytest.mark.parametrize(("kind", "name"), [(RealObjective, "objective"), (RealResidual, "residual")])
@pytest.mark.parametrize("route", [adjoint, fd_central, implicit_ad], ids=ids)
def test_a_complex_step_that_is_lost_convicts_nobody(kind: type[Bar], name: str, n: int, route: Route) -> None:
    problem = kind(n=n)
    judge = judged(problem, route)
    assert isinstance(judge, Judge)
    assert judge.reference.name == ("tangent" if n == 8 else "tangent in 3 random directions")
    says = f"bar: complex step lost: {name} drops Im u, off a difference by 1 - use no abs, conj, real, float"
    assert judge.instead == says
    p = problem.parameters.start
    assert judge.error(route.prepare(Model(problem), p)(p).gradient)[0] < 1e-8
    assert judged(Long(n=n), route).instead is None


class BlackBox(Problem):
    """J(p) = sum sin p_i, and nothing else is known."""

    name = "black-box"

    def __init__(self, n: int = 300) -> None:
        self.parameters = Parameters(start=np.linspace(0.0, 1.0, n), scale=np.ones(n))

    def value(self, p: Array) -> float:
        return float(np.sin(p).sum())


def outcome(bench: CaseContext, route: Route):
    spec = RouteSpec(route.name, route, route.defaults)
    case = InProcess(bench, Case(bench.spec, spec, bench.settings, {"route": route.name}))
    return case.prepared() or alone(case)


def test_an_unknown_error_says_why() -> None:
    row = outcome(CaseContext(ProblemSpec("box", {}, BlackBox), Settings(min_time=0.0)), fd_central).row
    assert (row["status"], row["gradient_error"], row["reference"]) == ("ok", None, None)
    assert "fd-central: error unknown, no reference: complex-step needs" in row["note"]
    assert "tangent needs" in row["note"]


def test_a_judge_too_dear_says_so() -> None:
    said = judged(LONG, adjoint, bill="predicted bill 3 h > --budget 60 s; --budget inf forces it")
    assert said == (
        "complex-step: predicted bill 3 h > --budget 60 s, --budget inf forces it, "
        "tangent: predicted bill 3 h > --budget 60 s, --budget inf forces it"
    )


BUILDS = {"box": BlackBox, "bar": Long, "duffing": Duffing, "block": lambda: Block(n=1, nz=2, law="linear")}
ROWS = [(name, kind) for name in BUILDS for kind in PARTS if (name, kind) != ("block", "directions")]  # compiles long


@pytest.mark.parametrize(("name", "kind"), ROWS)
def test_partial_rows_of_every_kind(name: str, kind: str) -> None:
    part = Partial(kind, 1, seed=3)
    bench = CaseContext(ProblemSpec("test", {}, BUILDS[name]), Settings(min_time=0.0, partial=part))
    problem, n_p = bench.problem, bench.n_p
    for route in ROUTES:
        if route.objection(problem) is not None:
            continue
        row = outcome(bench, route).row
        assert (row["status"], row["n_param"], row["partial"]) == ("ok", n_p, part.of(n_p))
        assert row["work"] == row["predicted_work"]
        assert len(row["gradient"]) == 1
        assert f"{route.name}: whole gradient: predicted " in row["note"]
        assert problem.name == "black-box" or row["gradient_error"] < 1e-4


@pytest.mark.parametrize(
    ("part", "n", "of"),
    [("--components", 2 * 10**5, "3 of 200000 components"), ("--directions", 10**5, "3 random directions of 100000 p")],
)
def test_a_few_of_very_many(cli, part: str, n: int, of: str) -> None:
    command = f"run --json --no-store --min-time 0 --problem bar[n={n}] --route tangent --route fd-central"
    for row in cli(*command.split(), part, "3").rows:
        assert (row["status"], row["n_param"]) == ("ok", n)
        assert row["partial"].startswith(of)
        assert row["work"]["forward_solves"] == {"tangent": 1, "fd-central": 6}[row["route"]]
        assert f"{2 * n:g} fwd)" in row["note"] or f"{n:g} lin)" in row["note"]


def test_the_seed_is_the_users_and_the_table_says_which_part(cli) -> None:
    command = "run --no-store --min-time 0 --problem bar --route adjoint --route complex-step"

    def gradients(*arguments: str) -> list:
        return [row["gradient"] for row in cli(*command.split(), "--json", *arguments).rows]

    for part in ("--components", "--directions"):
        same = gradients(part, "2"), gradients(part, "2", "--seed", "0")
        assert same[0] == same[1] != gradients(part, "2", "--seed", "5")
    out = cli(*command.split(), "--components", "2", "--gradient").out
    assert "bar, 2 of 8 components: n_u = 8" in out
    assert "bar, 2 of 8 components by adjoint" in out
    assert "note: bar: complex-step: whole gradient: predicted " in out
    assert "(8 fwd)" in out
    assert sum(line.startswith("log E_") for line in out.splitlines()) == 4


def test_a_part_too_dear_tells_the_bill_of_the_whole_too(cli) -> None:
    command = "run --json --no-store --budget 1e-9 --problem bar --route fd-central --components 2"
    (row,) = cli(*command.split()).rows
    assert (row["status"], row["partial"]) == ("skipped", "2 of 8 components")
    assert "(4 fwd) > --budget" in row["reason"]
    assert "(16 fwd)" in row["note"]


WHOLE = "run --json --no-store --min-time 0 --problem bar --route adjoint --components"


@pytest.mark.parametrize("count", ["9", "1000"])
def test_more_components_than_there_are_are_refused(cli, count: str) -> None:
    ran = cli(*WHOLE.split(), count)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert f"--components {count}" in ran.err
    assert "8" in ran.err


def test_all_components_are_the_whole(cli) -> None:
    (row,) = cli(*WHOLE.split(), "8").rows
    assert (row["partial"], len(row["gradient"])) == (None, 8)
    assert "whole gradient" not in row["note"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("--components 0", "--components 0 - give a whole number from 1"),
        ("--components -3", "--components -3 - give a whole number from 1"),
        ("--components x", "--components x - give a whole number"),
        ("--directions 0", "--directions 0 - give a whole number from 1"),
        ("--directions 1.5", "--directions 1.5 - give a whole number"),
        ("--components 2 --directions 2", "give one of them"),
        ("--directions 2 --seed -1", "--seed -1"),
        ("--directions 1000000000", "of memory at hand - take fewer"),
    ],
)
def test_wrong_parts_are_one_line(cli, arguments: str, says: str) -> None:
    ran = cli("run", "--problem", "bar", "--route", "adjoint", *arguments.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


def test_an_implicit_derivative_is_traced_through_a_part() -> None:
    """V c is written for JAX, too, components without a matrix."""
    few = components(LONG, LONG.parameters.start, np.array([3, 400]))
    c = few.parameters.start
    result: Result = implicit_ad.prepare(Model(few), c)(c)
    right = Bar(n=500, sensors=500).reference(LONG.parameters.start).gradient[[3, 400]]
    np.testing.assert_allclose(result.gradient, right, rtol=1e-11)
