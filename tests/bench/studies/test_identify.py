"""What the data can say of p: H against steps and routes, ranks, blind spots, posteriors, experiments and sensors."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from conftest import relative_error, somewhere, zoo

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.registry import study_tables
from gradient_routes.bench.inversion import posterior
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.identify import identifiability
from gradient_routes.bench.studies.identify.identifiability import Identified, identify, varied
from gradient_routes.bench.studies.identify.placement import greedy, place
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import Sensitivity
from gradient_routes.routes.singular_values import randomized, whole
from gradient_routes.routes.tangent import tangent

TABLES = ("spectrum", "identified", "experiments", "placement")
STEP = 1e-30
SUMS = {name: problem for name, problem in zoo().items() if Offers.OBSERVATION in problem.offers}
PROBLEMS = {name: (lambda problem=problem: problem) for name, problem in SUMS.items()} | {
    "block[grip]": lambda: Block(nx=1, ny=1, nz=2, unknown="load", load="displacement", alpha=0.1),
    "block[cases]": lambda: Block(nx=2, ny=1, nz=1, cases=2, derivatives="hand", alpha=0.1),
}


def one(selector: str, **options) -> Identified:
    (spec,) = case.problems([selector])
    return identify(spec, **options)


@pytest.fixture(scope="module", params=PROBLEMS)
def found(request: pytest.FixtureRequest) -> Sensitivity:
    problem = PROBLEMS[request.param]()
    model = Model(problem, Solver(polish=1))
    return Sensitivity(model, model.solve(somewhere(problem)))


def test_products_are_derivatives_of_what_is_predicted(found: Sensitivity) -> None:
    """H v = Im S u(p + i h v) / h."""
    model, p = found.R_u.model, found.R_u.state.p
    v = np.random.default_rng(0).standard_normal(len(p))
    q = p + 1j * STEP * v
    predicted = model.problem.observation(model.solve(q).u, q).predicted
    assert relative_error(found @ v, predicted.imag / STEP) < 1e-10  # 1e4 eps times the condition of R_u


def test_gradient_is_its_transpose_on_the_residual(found: Sensitivity) -> None:
    """g = H^T r + alpha dPhi, by the tangent route and by H^T."""
    model, p, seen = found.R_u.model, found.R_u.state.p, found.seen
    Phi, theta, by_p = model.problem.prior(p)
    g = found.T @ (seen.predicted - seen.data) + Phi.gradient(theta) * by_p
    assert relative_error(g, tangent.prepare(model, p)(p).gradient) < 1e-11


def test_transpose_and_columns_and_rows(found: Sensitivity) -> None:
    """<w, H v> = <H^T w, v>; columns by tangents are rows by adjoints, whichever are fewer."""
    rng = np.random.default_rng(1)
    w, v = (rng.standard_normal(n) for n in found.shape)
    by_columns, by_rows = found.by_columns(), found.by_rows()
    assert w @ (found @ v) == pytest.approx((found.T @ w) @ v, rel=1e-10, abs=1e-13)
    np.testing.assert_allclose(by_columns, by_rows, atol=1e-12 * np.abs(by_rows).max())
    np.testing.assert_array_equal(found.dense(), by_columns if found.shape[1] <= found.shape[0] else by_rows)


def test_solves_are_counted_and_as_few_as_can_be() -> None:
    bar = Bar(n=8, sensors=3)
    model = Model(bar)
    H = Sensitivity(model, model.solve(bar.parameters.start))
    before = model.tally.work
    H.dense()
    done = model.tally.work - before
    assert (done.transposed_solves, done.solves, done.forward_solves) == (3, 0, 0)


# --- blind, weak, seen


@pytest.mark.parametrize("way", ["by_columns", "by_rows"])
def test_nothing_sees_what_lies_behind_the_last_sensor(way: str) -> None:
    bar = Bar()
    model = Model(bar)
    H = getattr(Sensitivity(model, model.solve(somewhere(bar))), way)()
    assert (H[:, 5:] == 0.0).all(), "exactly"
    assert (np.abs(H[:, :5]).max(axis=0) > 0.05).all()
    np.testing.assert_array_equal(whole(H).blind, np.arange(8) >= 5)


def test_five_sensors_identify_five_of_eight() -> None:
    done = one("bar", noise=0.01)
    assert (done.data, done.rank) == (5, 5)
    assert [*done.kinds] == ["seen"] * 5 + ["blind"] * 3
    np.testing.assert_allclose(done.null_share, np.arange(8) >= 5, atol=1e-14)
    np.testing.assert_array_equal(np.isnan(done.posterior_sd), np.arange(8) >= 5)


def test_a_vanishing_gradient_does_not_fool_it() -> None:
    """At the truth the residual, hence g, is rounding in every parameter; H still sees five of them."""
    done = one("bar", at="true", noise=0.01)
    g = tangent.prepare(Model(done.problem), done.state.p)(done.state.p).gradient
    assert np.abs(g).max() < 1e-14
    assert done.rank == 5


def test_weak_is_below_the_noise_and_blind_is_nothing() -> None:
    done = one("bar", noise=0.2)
    assert [*done.kinds] == ["seen"] * 3 + ["weak"] * 2 + ["blind"] * 3
    assert done.rank < 5


def test_contact_makes_the_tail_visible() -> None:
    closed, never = (one(f"bar[stop=multiplier,gap={gap}]", noise=0.01) for gap in (0.8, 2))
    assert closed.problem.active_set(closed.state.u, closed.state.p) == "closed"
    assert [*closed.kinds] == ["seen"] * 8
    assert [*never.kinds] == ["seen"] * 5 + ["blind"] * 3
    tail = closed.null_share[5:]
    assert (tail > 0.1).all(), "they compensate one another: five data are five directions"


def test_more_sensors_never_identify_less() -> None:
    (spec,) = case.problems(["bar"])
    specs = varied(spec, [("sensors", f"1..{m}") for m in range(1, 9)])
    assert len(specs) == 9
    ranks = [identify(spec, noise=0.05).rank for spec in specs[1:]]
    assert ranks == sorted(ranks)
    assert ranks[-1] > ranks[0]


# --- posterior


@pytest.mark.parametrize(
    "selector",
    [
        "bar[alpha=0.1]",
        "bar[alpha=0.1,parametrization=raw,phi=tv]",
        "block[nx=1,ny=1,nz=2,alpha=0.01,phi=amplitude]",
        "advection[n=3,alpha=0.1]",
    ],
)
def test_standard_deviations_are_the_inverse_of_the_precision(selector: str) -> None:
    """sigma^2 (H^T H + alpha D^T W D)^{-1}, formed and inverted as it stands, in p itself."""
    done = one(selector, noise=0.03)
    p, problem = done.state.p, done.problem
    H = Sensitivity(Model(problem), done.state).dense()
    prior, theta, by_p = problem.prior(p)
    D = prior.differences(len(p)).toarray() * by_p
    L = prior.alpha * D.T @ (prior.weights(theta)[:, None] * D)
    sd = np.sqrt(np.diag(np.linalg.inv(H.T @ H + L))) * done.sigma
    np.testing.assert_allclose(done.posterior_sd, sd, rtol=1e-8)
    assert done.prior_sd is not None
    if prior.kind == "amplitude":
        np.testing.assert_allclose(done.prior_sd, np.sqrt(np.diag(np.linalg.inv(L))) * done.sigma, rtol=1e-12)
        assert (done.posterior_sd < done.prior_sd).all()
    else:
        assert np.isnan(done.prior_sd).all(), "differences know no level"


def test_standard_deviations_are_those_of_many_inversions() -> None:
    """Of a linear problem: data and prior drawn anew, p fitted by least squares to forward solves alone."""
    sigma, alpha, draws = 0.02, 1e-3, 20_000
    done = one(f"advection[n=4,unknown=source,sensors=everywhere,alpha={alpha}]", noise=sigma)
    problem, n_p = done.problem, len(done.state.p)
    predicted = [
        problem.observation(Model(problem).solve(p).u, p).predicted for p in (np.zeros(n_p), *np.eye(n_p))
    ]  # affine in p
    S = np.stack(predicted[1:], axis=1) - predicted[0][:, None]
    D = np.sqrt(alpha) * problem.prior(done.state.p)[0].differences(n_p).toarray()
    noise = done.sigma * np.random.default_rng(0).standard_normal((len(S) + len(D), draws))
    estimates = np.linalg.lstsq(np.concatenate([S, D]), noise, rcond=None)[0]
    np.testing.assert_allclose(done.posterior_sd, estimates.std(axis=1), rtol=0.03)  # 6 / sqrt(2 draws)


def test_what_is_not_bounded_is_not_given() -> None:
    assert np.isnan(posterior.deviations(np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 0.0]]))).all()
    np.testing.assert_allclose(posterior.deviations(np.diag([2.0, 0.0])), [0.5, np.nan])
    silent = one("bar")
    assert np.isnan(silent.posterior_sd).all()
    assert any("no noise is known" in note for note in silent.notes)


# --- products only


def test_random_products_find_the_singular_values() -> None:
    rng = np.random.default_rng(2)
    U, V = (np.linalg.qr(rng.standard_normal((n, 40)))[0] for n in (50, 60))
    H = (U * 0.7 ** np.arange(40)) @ V.T
    H[:, 7] = 0.0
    exact, some = whole(H), randomized(H, H.shape, 12)
    np.testing.assert_allclose(some.s, exact.s[:12], rtol=1e-6)
    assert exact.s[12] <= some.beyond <= 4 * exact.s[12]
    np.testing.assert_array_equal(some.blind, exact.blind)
    assert (exact.norms - some.beyond <= some.norms).all()
    assert (some.norms <= exact.norms * (1 + 1e-12)).all()
    every = randomized(H, H.shape, 50)
    np.testing.assert_allclose(every.s, exact.s, atol=1e-14)
    assert every.beyond == 0.0


def test_large_problems_go_by_products_down_to_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = one("advection[n=6]", noise=0.05)
    monkeypatch.setattr(identifiability, "WHOLE", 4)
    monkeypatch.setattr(identifiability, "MODES", 1)
    done = one("advection[n=6]", noise=0.05)
    assert done.H is None
    assert done.complete
    assert done.rank == exact.rank > 1
    np.testing.assert_allclose(done.svd.s[: done.rank], exact.svd.s[: done.rank], rtol=1e-6)
    assert np.abs(done.null_share - exact.null_share).max() < 1e-4
    blind = one("bar[n=40]", noise=0.01, modes=2)
    assert (blind.kinds == "blind").sum() == 35
    assert not blind.complete


# --- sensors


@pytest.mark.parametrize("criterion", ["D", "A"])
def test_greedy_is_the_best_of_all_sensors_at_every_step(criterion: str) -> None:
    rng = np.random.default_rng(3)
    G, root = rng.standard_normal((12, 5)), rng.standard_normal((5, 5))
    C = root @ root.T + np.eye(5)

    def reached(rows: list[int]) -> float:
        after = np.linalg.inv(np.linalg.inv(C) + G[rows].T @ G[rows])
        if criterion == "D":
            return float(np.linalg.slogdet(np.eye(len(rows)) + G[rows] @ C @ G[rows].T)[1])
        return float(C.trace() - after.trace())

    chosen, gains = greedy(G, C, 3, criterion)
    for k in range(3):
        best = max((j for j in range(12) if j not in chosen[:k]), key=lambda j: reached([*chosen[:k], j]))
        assert chosen[k] == best
        assert sum(gains[: k + 1]) == pytest.approx(reached(chosen[: k + 1]), rel=1e-10)


@pytest.mark.parametrize("criterion", ["D", "A"])
def test_proposed_sensors_do_what_is_said(criterion: str) -> None:
    """The criterion and the rank of the bar that has them."""
    sigma, done = 0.01, one("bar[sensors=2]", noise=0.01)
    proposal = place(done, 2, criterion)
    nodes = [1, 2, *(int(choice.sensor.removeprefix("u_")) for choice in proposal.choices)]
    with_them = one(f"bar[sensors={'+'.join(map(str, nodes))}]", noise=sigma)
    precision = np.eye(8) + with_them.H.T @ with_them.H / sigma**2
    value = np.linalg.slogdet(precision)[1] if criterion == "D" else np.linalg.inv(precision).trace()
    assert proposal.choices[-1].value == pytest.approx(value, rel=1e-9)
    assert proposal.choices[-1].rank == with_them.rank == 4
    assert proposal.candidates == 6
    assert proposal.choices[-1].position == pytest.approx([nodes[-1] / 8])


def test_afresh_forgets_the_sensors_there_are() -> None:
    proposal = place(one("bar[alpha=1e-3]", noise=0.01), 8, afresh=True)
    assert sorted(choice.sensor for choice in proposal.choices) == [f"u_{k}" for k in range(1, 9)]
    assert proposal.before == 0.0
    assert any("knows no level" in note for note in proposal.notes)


def test_candidates_of_a_block_are_free_components() -> None:
    done = one("block[nx=1,ny=1,nz=2,cases=2,derivatives=hand]", noise=1e-3)
    names = {done.problem.candidates().label(j) for j in range(done.problem.n_state)}
    assert len(names) == done.problem.n_state == 48
    proposal = place(done, 1)
    assert proposal.candidates == 48 - 24, "the top is measured already"
    assert "0.5), case" in proposal.choices[0].sensor


def test_too_many_candidates_are_drawn_from(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gradient_routes.bench.studies.identify.placement.LARGEST", 8 * 8 * 2)
    proposal = place(one("bar", noise=0.01), 2)
    assert proposal.candidates == 2
    assert "2 of 3 candidates, at random" in proposal.notes[0]


# --- the command


def test_the_command_prints_rows_and_keeps_them(cli) -> None:
    asked = "--problem bar --noise 0.01 --sensors 8 --stop multiplier --vary alpha=0.1 --place 1 --json"
    ran = cli("identify", *asked.split())
    assert (ran.code, ran.err) == (0, "")
    for row in ran.rows:
        assert row.keys() - {"table"} == {c.name for c in study_tables()[row["table"]].columns}
    for name in TABLES:
        _, kept = Store(Path("results/routes.sqlite")).table(name)
        assert len(kept) == sum(row["table"] == name for row in ran.rows) > 0
    compared = [row for row in ran.rows if row["table"] == "experiments"]
    assert [row["gained"] for row in compared] == [0, 3, 0, 0]
    assert [row["blind"] for row in compared] == [3, 0, 0, 3]
    tail = [row for row in ran.rows if row["table"] == "identified" and row["kind"] == "blind"]
    assert {row["posterior_sd"] for row in tail if row["experiment"] == "bar"} == {None}
    assert all(row["posterior_sd"] > 0 for row in tail if row["experiment"] == "bar[alpha=0.1]")


def test_the_screen_shows_the_spectrum_and_what_changes_buy(cli) -> None:
    out = cli("identify", *"--problem bar --noise 0.01 --sensors 8 --stop multiplier --place 2 --no-store".split()).out
    for words in (
        "singular values of H",
        "- noise 0.01",
        "5 of 8 directions identifiable from 5 data",
        "elements #####ooo",
        "+3",
        "bar[sensors=8] buys most: 3 more identifiable directions",
        "bar[stop=multiplier] leaves 3 fewer blind",
        "2 of 3 sensors, D-optimal",
    ):
        assert words in out
    long = cli("identify", "--problem", "bar[n=300]", "--no-store", "--no-plot").out
    assert "1..5 seen, 6..300 blind" in long
    assert "... 236 more" in long


def test_fields_are_written_cell_by_cell(cli) -> None:
    assert cli("identify", *"--problem block[n=2] --noise 1e-3 --vtu f.vtu --no-store --no-plot".split()).code == 0
    cells = meshio.read("f.vtu").cell_data
    assert set(cells) == {"E", "null_share", "column_norm", "posterior_sd"}
    assert len(cells["null_share"][0]) == 8


WRONG = {
    "--problem bar[sensors=0]": "no sensors, and m = 0",
    "--problem duffing/problem.py:Duffing": "has no observation S u",
    "--problem black.py:Black": "needs the partial derivatives",
    "--noise 0": "--noise 0",
    "--noise nan": "--noise nan",
    "--modes 0": "--modes 0",
    "--cases 2": "no option 'cases'",
    "--sensors 9": "there are 8",
    "--vary alpha": "write KEY=VALUE",
    "--place 1": "give --noise SIGMA",
    "--place 0 --noise 0.1": "give a whole number from 1",
    "--place 4 --noise 0.1": "there are 3 candidates",
    "--criterion A": "--criterion",
    "--vtu f.vtu": "has no mesh",
    "--problem block[n=2,unknown=layers,layers=2] --vtu f.vtu": "2 parameters on 8 cells",
    "--problem bar[n=1e6]": "1000000 parameters",
    "--problem bar[n=4000] --noise 0.1 --place 1": "take at most 3000",
}
BLACK = """
import numpy as np
from gradient_routes.problems.problem import Parameters, Problem

class Black(Problem):
    name, parameters = "black", Parameters(np.ones(1), np.ones(1))
"""


@pytest.mark.parametrize("arguments", WRONG)
def test_wrong_usage_is_one_line(cli, arguments: str) -> None:
    Path("black.py").write_text(BLACK)
    Path("duffing").mkdir()
    Path("duffing/problem.py").write_text("from duffing.problem import Duffing")
    given = arguments.split()
    ran = cli("identify", *([] if "--problem" in given else ["--problem", "bar"]), "--no-store", *given)
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert WRONG[arguments] in ran.err
