"""routes invert --linear: readings to parameters by one map, and whether that is enough."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.frames import estimated, read_frames
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.linear_map import LinearMap, linear_map
from gradient_routes.bench.inversion.linear_regime import LinearRegime
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.bench.inversion.variables import Variables
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

TRACTION = "block[nx=2,ny=1,nz=1,law=linear,unknown=traction,sensors=everywhere]"
SOURCE = "advection[n=4,unknown=source,data=twin,noise=1e-3,alpha=1e-4]"


def mapped(problem: Problem) -> LinearMap:
    q = problem.parameters
    objective = Objective(problem, adjoint, {}, Solver(), Variables.of(q, q.start, "none", "test"))
    objective.start(q.start)
    return linear_map(objective, problem.name)


def readings(problem: Problem, p: Array) -> Array:
    return problem.observation(Model(problem).solve(p).u, p).predicted


def inverted(problem: str, optimizer: str, iterations: int = 50) -> Inversion:
    (spec,), (route,) = case.problems([problem]), case.routes(["adjoint"])
    return invert(spec, route, Engine(optimizer, Limits(iterations, 1e-12)))


def test_tractions_on_a_linear_body_come_back_exactly() -> None:
    """u is affine in p, so that any p is found from its readings, however far from the start; to rounding."""
    (spec,) = case.problems([TRACTION])
    problem = spec()
    by, rng = mapped(problem), np.random.default_rng(0)
    p = rng.uniform(-5.0, 5.0, (3, 6))
    d = np.array([readings(problem, each) for each in p])
    np.testing.assert_allclose(by(d), p, atol=1e-10)
    found = estimated(replace(by, sigma=np.array(1e-3)), d)
    assert found.over_noise.max() < 1e-9
    assert not found.unexplained


def test_where_u_is_affine_the_map_is_the_minimum_that_gauss_newton_goes_to() -> None:
    at_once, loop = (inverted(SOURCE, optimizer) for optimizer in ("linear", "gauss-newton"))
    assert len(at_once.iterates) == 2
    assert at_once.end.startswith("converged")
    np.testing.assert_allclose(at_once.p, loop.p, atol=1e-7 * np.abs(loop.p).max())


def test_elsewhere_it_is_one_step_with_phi_from_the_start() -> None:
    """Against the normal equations of complex steps: (H^T H + alpha D^T D) dp = H^T (d - y_0) at a log E of 0.1 k."""
    bar = Bar(n=6, sensors=6, noise=0.01, alpha=1e-3)
    bar.parameters = replace(bar.parameters, start=0.1 * np.arange(6.0))
    p_0 = bar.parameters.start
    H = np.array([readings(bar, p_0 + 1e-30j * e).imag / 1e-30 for e in np.eye(6)]).T
    D = np.diff(np.eye(6), axis=0) * np.sqrt(bar.alpha)
    r = bar.sensors.d - readings(bar, p_0)
    dp = np.linalg.solve(H.T @ H + D.T @ D, H.T @ r - D.T @ (D @ p_0))
    by = mapped(bar)
    np.testing.assert_allclose(by(bar.sensors.d), p_0 + dp, rtol=1e-9)
    np.testing.assert_allclose(by.residual(bar.sensors.d[None], (p_0 + dp)[None])[0], H @ dp - r, atol=1e-12)
    assert by.rank == 6


class Seen(Bar):
    """Data of unequal accuracy, and two shapes of a motion that is none of the body's."""

    w, Q = np.linspace(0.5, 2.0, 5), np.linalg.qr(np.vander(np.arange(5.0), 2))[0]

    def observation(self, u, p):
        seen = super().observation(u, p).weighted(self.w)
        P = np.eye(5) - self.Q @ self.Q.T
        return replace(
            seen, predicted=P @ seen.predicted, data=P @ seen.data, S_u=P @ seen.S_u.toarray(), modes=self.Q, sigma=1e-3
        )


def test_frames_are_raw_readings_whatever_j_weighs_and_eliminates() -> None:
    seen = Seen(n=5)
    by = mapped(seen)
    assert (by.gain.shape, by.rank) == ((5, 5), 3)
    d = np.random.default_rng(1).normal(0.0, 1.0, (4, 5))
    moved = d + np.random.default_rng(2).normal(0.0, 1.0, (4, 2)) @ (seen.Q / seen.w[:, None]).T
    np.testing.assert_allclose(by(moved), by(d), atol=1e-10)
    p = seen.parameters.start
    np.testing.assert_allclose(by(readings(Bar(n=5), p)), p, atol=1e-12)
    assert np.abs(by.residual(moved, by(moved)) - by.residual(d, by(d))).max() < 1e-10


def test_what_nothing_determines_stays_at_the_start() -> None:
    by = mapped(Bar())
    assert (by.rank, by(np.ones(5))[5:].tolist()) == (5, [0.0] * 3)
    assert "3 of 8 directions are determined by nothing" in by.described


def test_a_saved_map_gives_the_same_to_the_last_bit(tmp_path: Path) -> None:
    by, frames = mapped(Bar(noise=0.01)), np.random.default_rng(0).normal(0.5, 0.1, (50, 5))
    with (tmp_path / "map.npz").open("wb") as file:
        by.save(file)
    again = LinearMap.load(tmp_path / "map.npz")
    assert (again(frames) == by(frames)).all()
    assert again.names.tolist() == [f"log E_{k + 1}" for k in range(8)]


def frames_csv(columns: str, rows: Array, path: str = "frames.csv") -> None:
    np.savetxt(path, rows, delimiter=",", header=columns, comments="", fmt="%.17g")


def test_a_map_is_made_once_and_applied_to_files(cli) -> None:
    """The bar's own data as the first frame give what --linear prints; columns are found by their names."""
    first = cli("invert", "--problem", "bar[noise=0.01,alpha=0.01]", "--linear", "-o", "map.npz", "--json")
    assert first.code == 1, "its answer does not suffice for noise of 0.01"
    p = [row["estimate"] for row in first.rows if row["table"] == "estimates"]
    d = np.array([Bar(noise=0.01).sensors.d, np.full(5, 0.5), np.full(5, 3.0)])
    frames_csv("u_5,u_1,u_4,u_2,u_3", d[:, [4, 0, 3, 1, 2]])
    ran = cli("invert", "--linear", "--map", "map.npz", "--frames", "frames.csv", "-o", "p.csv")
    assert ran.code == 1, "noise does not explain two of three"
    assert "misfit exceeds noise in 2, first in frame 2" in ran.out
    with open("p.csv") as file:
        rows = list(csv.DictReader(file))
    assert [row["frame"] for row in rows] == ["1", "2", "3"]
    np.testing.assert_allclose([float(rows[0][f"log E_{k}"]) for k in range(1, 9)], p, rtol=1e-12)
    np.savez("frames.npz", d)
    again = cli("invert", "--linear", "--map", "map.npz", "--frames", "frames.npz", "-o", "q.csv")
    assert Path("q.csv").read_text() == Path("p.csv").read_text(), again.err
    assert "--frames frames.npz names no columns: taken in the order of the readings, u_1 to u_5" in again.err


@pytest.mark.parametrize(
    ("frames", "says"),
    [
        ("u_1,u_2,u_3,u_4\n1,2,3,4\n", "reading 5 of 5 is u_5, 0 columns have it - give one column a reading"),
        ("a,b,c,d,e\n1,2,3,4,5\n", "reading 1 of 5 is u_1, the first of other names is a - give"),
        ("u_1,u_2,u_2,u_4,u_3,u_5\n1,2,3,4,5,6\n", "reading 2 of 5 is u_2, 2 columns have it - give"),
        ("u_1,u_2,u_3,u_4,u_5\n1,2,3,4,5\n1,2,nan,4,5\n", "line 3, column u_3: nan is not finite"),
        ("u_1,u_2,u_3,u_4,u_5\n", "an array (0, 5)"),
        (np.ones((2, 4)), "an array (2, 4) - give (frames, 5 readings)"),
        (np.where(np.eye(3, 5) > 0, np.nan, 1.0)[1:], "frame 1, reading u_2 is not finite"),
        (np.array([[None]]), "holds no array of numbers"),
        (np.ones((2, 5)) * 1j, "holds no array of numbers"),
    ],
    ids="few others twice nan none few-npz nan-npz objects complex".split(),
)
def test_frames_that_are_none_are_one_line(cli, frames, says: str) -> None:
    with open("map.npz", "wb") as file:
        mapped(Bar()).save(file)
    name = "frames.csv" if isinstance(frames, str) else "frames.npz"
    Path(name).write_text(frames) if isinstance(frames, str) else np.savez(name, frames)
    ran = cli("invert", "--linear", "--map", "map.npz", "--frames", name, "-o", "p.csv", "--no-store")
    assert (ran.code, says in ran.err, ran.err.count("\n")) == (2, True, 1), ran.err
    assert not Path("p.csv").exists()


def test_columns_named_as_readings_that_share_a_name_are_taken_in_their_order_only(tmp_path: Path) -> None:
    by = mapped(Bar())
    by = replace(by, readings=np.array(["u", "u", *by.readings[2:]]))
    frames_csv("u,u,u_3,u_4,u_5", np.arange(5.0)[None], str(tmp_path / "d.csv"))
    frames, remark = read_frames(tmp_path / "d.csv", by)
    assert (frames.tolist(), remark) == ([[0.0, 1.0, 2.0, 3.0, 4.0]], None)
    frames_csv("u,u,u_4,u_3,u_5", np.arange(5.0)[None], str(tmp_path / "d.csv"))
    with pytest.raises(InputError, match="several readings are u, and columns are not theirs in order"):
        read_frames(tmp_path / "d.csv", by)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--linear",), "takes --problem, or a --map"),
        ((), "--problem is missing"),
        (("--linear", "--map", "no.npz"), "cannot be read"),
        (("--linear", "--map", "text.npz"), "is no map"),
        (("--problem", "bar", "--map", "text.npz"), "--map: is of --linear"),
        (("--problem", "bar", "--linear", "--optimizer", "trust"), "--optimizer: is of an iteration"),
        (("--problem", "bar", "--linear", "--frames", "text.npz"), "one needs the other"),
        (("--problem", "bar", "--linear", "-o", "map.txt"), "name one FILE.npz"),
        (("--problem", "bar[alpha=1,phi=tv]", "--linear"), "total variation is not quadratic"),
    ],
)
def test_wrong_usage_is_one_line(cli, arguments: tuple[str, ...], says: str) -> None:
    Path("text.npz").write_text("no map")
    ran = cli("invert", *arguments, "--no-store")
    assert (ran.code, says in ran.err, ran.err.count("\n")) == (2, True, 1), ran.err


@pytest.mark.parametrize(("k_c", "enough"), [(1.0, False), (0.01, True)])
def test_readings_without_the_nonlinearity_are_held_against_the_noise(k_c: float, enough: bool) -> None:
    """A stop that the tip just touches, of which the bar linearized at rest knows nothing."""
    with_stop, without = Bar(noise=0.01, stop="penalty", gap=0.85, k_c=k_c), Bar(noise=0.01)
    (route,) = case.routes(["adjoint"])
    found = invert(case.ProblemSpec("bar", {}, lambda: with_stop), route, Engine(limits=Limits(3)))
    off = (readings(without, found.p) - readings(with_stop, found.p)) / 0.01
    assert found.regime.rms == pytest.approx(np.sqrt(np.mean(off**2)), rel=1e-9)
    assert found.regime.most == pytest.approx(np.abs(off).max(), rel=1e-9)
    assert found.regime.enough == enough
    assert "linearized at u = 0" in found.tables["inversion"][-1]["says"]


def test_a_linear_answer_is_called_enough_by_its_readings() -> None:
    far, near = (inverted(f"bar[noise={noise},alpha=10]", "linear") for noise in (1e-3, 0.02))
    assert far.end.startswith("the linear answer does not suffice: its readings differ")
    assert near.end.startswith("the linear answer suffices")
    assert inverted("bar", "linear").end.startswith("the linear answer: its readings differ")
    assert far.regime is None, "R is linear in u"
    assert LinearRegime.of(np.array([3.0, -4.0]), 10.0).described("it").endswith("0.35 sigma, 0.4 at most")


@pytest.mark.parametrize(("noise", "code"), [(1e-3, 1), (0.02, 0)])
def test_a_linear_answer_that_does_not_suffice_is_no_success(cli, noise: float, code: int) -> None:
    assert cli("invert", "--problem", f"bar[noise={noise},alpha=10]", "--linear", "--no-store").code == code


@pytest.mark.parametrize(
    "spoil",
    [
        {"gain": np.full((8, 5), np.nan)},
        {"gain": np.ones((8, 4))},
        {"gain": np.full((8, 5), "x")},
        {"names": np.array([None] * 8)},
        {"H": np.ones((5, 8)) * 1j},
    ],
    ids="nan shape words pickled complex".split(),
)
def test_what_is_no_map_is_refused(tmp_path: Path, spoil: dict[str, Array]) -> None:
    by = mapped(Bar())
    with (tmp_path / "map.npz").open("wb") as file:
        replace(by, **spoil).save(file)
    with pytest.raises(InputError, match="is no map - write one by"):
        LinearMap.load(tmp_path / "map.npz")


CUBIC = """
import numpy as np
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.problem import Linearization, Offers, Parameters, Problem

class Cubic(Problem):
    name, offers, n_state, structure, affine_at_rest = "cubic", Offers.LINEARIZE, 2, "spd", True
    d = np.array([0.1, -0.2])

    def __init__(self):
        self.parameters = Parameters(start=np.full(2, 0.05), scale=np.ones(2))

    def residual(self, u, p):
        return u + u**3 - p

    def tangent(self, u, p):
        return np.diag(1.0 + 3.0 * u**2)

    def objective(self, u, p):
        return 0.5 * np.sum((u - self.d) ** 2)

    def linearize(self, u, p):
        return Linearization(-np.eye(2), u - self.d, np.zeros(2))

    def observation(self, u, p):
        return Observation(u, self.d, np.eye(2), sigma=1e-3)
"""


def test_the_small_strain_answer_to_a_load_comes_before_the_loop(cli) -> None:
    """u + u^3 = p. At small strains p = d, where u solves u + u^3 = d. At the answer, p = d + d^3, u = p is linear."""
    Path("cubic.py").write_text(CUBIC)
    ran = cli("invert", "--problem", "cubic.py:Cubic", "--no-plot", "--no-store")
    assert ran.code == 0, ran.err
    d = [0.1, -0.2]
    u = [np.roots([1.0, 0.0, 1.0, -each]) for each in d]
    u = np.array([root.real for roots in u for root in roots if abs(root.imag) < 1e-12])
    J = 0.5 * np.sum((u - d) ** 2)
    assert f"u is affine in p at small strains: one linear least-squares solve gives J = {J:.6g}," in ran.out
    assert "the loop goes below the one-shot answer" in ran.out
    off = np.abs(d) ** 3 / 1e-3
    says = f"{np.sqrt(np.mean(off**2)):.2g} sigma, {off.max():.2g} at most"
    assert f"u = 0 does not suffice: its readings differ from those of the problem by {says}" in ran.out
