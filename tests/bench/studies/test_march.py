"""Without regularization an iteration marches into the noise; the discrepancy principle ends it where that begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.objective import noise_level
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.problems.bar import Bar

NOISY = "bar[n=20,sensors=20,noise=0.005]"


def inverted(problem: str = NOISY, **limits) -> Inversion:
    (spec,), (route,) = case.problems([problem]), case.routes(["adjoint"])
    return invert(spec, route, Engine(limits=Limits(**limits)))


@pytest.fixture(scope="module")
def whole() -> Inversion:
    return inverted()


def test_the_first_step_within_the_noise_is_marked_and_the_error_grows_after_it(whole: Inversion) -> None:
    (met,) = [k for k, step in enumerate(whole.iterates) if step.chosen == "discrepancy"]
    seen = whole.made.observation(np.zeros(20), whole.p)
    over_noise = [np.sqrt(2.0 * step.misfit / len(seen.data)) / 0.005 for step in whole.iterates]
    np.testing.assert_allclose([step.discrepancy for step in whole.iterates], over_noise, rtol=1e-12)
    assert over_noise[met - 1] > 1.0 >= over_noise[met]
    off = [step.distance for step in whole.iterates]
    assert off[-1] > 1.5 * off[met]
    assert off[met] < 0.4 * off[0]


def test_stopping_at_the_noise_takes_the_same_steps_until_there(whole: Inversion) -> None:
    found = inverted(at_noise=True)
    steps = len(found.iterates)
    assert [step.objective for step in found.iterates] == [step.objective for step in whole.iterates[:steps]]
    assert [bool(step.chosen) for step in found.iterates] == [False] * (steps - 1) + [True]
    assert found.end.startswith("stopped at the noise: the data are met to 0.7")
    assert not found.misled


def test_what_is_eliminated_takes_its_share_of_the_noise() -> None:
    class Moved(Bar):
        def observation(self, u, p):
            return replace(super().observation(u, p), modes=np.eye(5)[:, :2])

    bar = Moved(noise=1e-3)
    assert noise_level(bar, bar.parameters.start) == pytest.approx(0.5e-6 * (5 - 2), rel=1e-12)


def test_the_screen_shows_misfit_against_noise_instead_of_a_phi_of_zero(cli) -> None:
    ran = cli("invert", "--problem", NOISY, "--no-store")
    assert ran.code == 0
    assert "/ noise" in ran.out
    assert "alpha Phi" not in ran.out
    assert "\n     discrepancy: the data are met to their noise\n" in ran.out
    assert "the data are met to their noise after 9 of " in ran.out
    assert "into the noise" in ran.out, "the plot"
    weighed = cli("invert", "--problem", f"{NOISY[:-1]},alpha=1e-3]", "--no-store")
    assert ("alpha Phi" in weighed.out, "into the noise" in weighed.out) == (True, False)


def test_rows_and_reports_mark_the_step(cli) -> None:
    rows = cli("invert", "--problem", NOISY, "--json", "--stop-at-noise").rows
    steps = [row for row in rows if row["table"] == "inversion"]
    assert [row["chosen"] for row in steps] == [None] * (len(steps) - 1) + ["discrepancy"]
    assert steps[-1]["discrepancy"] <= 1.0 < steps[-2]["discrepancy"]
    ran = cli("report", "-o", "report.html")
    assert ran.code == 0
    with open("report.html") as page:
        text = page.read()
    assert "misfit against noise" in text
    assert "adjoint, lbfgs meets the data to their noise at iteration 9." in text


@pytest.mark.parametrize(
    ("problem", "more", "says"),
    [
        ("bar", (), "bar: --stop-at-noise, but the noise of its data is not known"),
        (NOISY, ("--alpha-sweep", "1e-3", "1", "3"), "--stop-at-noise: is of a single inversion"),
    ],
)
def test_a_noise_that_cannot_stop_is_one_line(cli, problem: str, more: tuple[str, ...], says: str) -> None:
    ran = cli("invert", "--problem", problem, "--stop-at-noise", "--no-store", *more)
    assert (ran.code, says in ran.err, ran.err.count("\n"), ran.out) == (2, True, 1, ""), ran.err
