"""The size of a stiffness that measured data tell: in closed form, and the same from any start in any units."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.bench.cases.case import ProblemSpec, problems, routes
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.data.observation import Observation
from gradient_routes.problems.errors import NotOffered
from gradient_routes.problems.problem import Linearization, Offers, Parameters, Problem
from gradient_routes.routes.measured_start import NEAR, fitted_factor, with_measured_start
from gradient_routes.routes.model import Model

E = 2.1e11  # [Pa]
PULLED = "block[n=2,derivatives=hand,unknown=layers,layers=2,traction={traction},data={data}{modulus}]"


def bar_csv(folder, scale: float = 1.0) -> str:
    """u = F x / (E A), the bar's load and area being 1."""
    path = folder / "bar.csv"
    path.write_text("node,displacement\n" + "".join(f"{k},{scale * k / 4 / E!r}\n" for k in (1, 2, 4)))
    return str(path)


@pytest.mark.parametrize("parametrization", ["log", "raw"])
def test_a_homogeneous_bar_starts_at_its_modulus(tmp_path, parametrization: str) -> None:
    bare = Bar(n=4, data=bar_csv(tmp_path), parametrization=parametrization)
    bar = with_measured_start(bare)
    assert bar.modulus(bar.parameters.start) == pytest.approx(np.full(4, E), rel=1e-13)
    assert bar.parameters.scale == pytest.approx(np.full(4, 1.0 if parametrization == "log" else E), rel=1e-13)
    assert f"start: a modulus of {E:.4g} Pa everywhere, fitted to the data" in bar.notes
    assert np.array_equal(bar.sensors.d, bare.sensors.d)


def test_a_modulus_that_is_given_is_the_start(tmp_path) -> None:
    for options in ({"data": bar_csv(tmp_path)}, {}):
        bar = with_measured_start(Bar(n=4, modulus=5.0, **options))
        assert bar.modulus(bar.parameters.start) == pytest.approx(np.full(4, 5.0), rel=1e-15)


def test_data_against_the_load_tell_no_size(tmp_path) -> None:
    bar = with_measured_start(Bar(n=4, data=bar_csv(tmp_path, scale=-1.0)))
    assert bar.parameters.start.tolist() == [0.0] * 4
    assert any("do not point where the load does" in note for note in bar.notes)


def block_csv(folder, problem: Block, p: np.ndarray, length: float = 1.0) -> str:
    """Displacements of all nodes, in units of a length."""
    u, X, path = Model(problem).solve(p).u, problem.mesh.geometry.X, folder / "block.csv"
    U = problem.solid.displacements(u, problem.solid.setup(p), 0, np.arange(len(X)))
    lines = [",".join(repr(float(v / length)) for v in (*x, *d)) for x, d in zip(X, U, strict=True) if x[2] > 0.0]
    path.write_text("\n".join(["x,y,z,ux,uy,uz", *lines]))
    return str(path)


def test_a_homogeneous_block_starts_at_its_modulus_at_finite_strain(tmp_path) -> None:
    options = {"n": 2, "derivatives": "hand", "unknown": "constants", "traction": 0.3 * E}
    soft = Block(**options, modulus=E)
    data = block_csv(tmp_path, soft, soft.parameters.start)
    block = with_measured_start(Block(**options, data=data))
    assert block.parameters.start == pytest.approx(soft.parameters.start, rel=NEAR)
    assert block.regularization.origin == pytest.approx(block.parameters.start)


def test_any_start_and_any_units_give_the_same_answer_in_as_many_steps(tmp_path) -> None:
    """Starts off by up to 10^6 either way; lengths in m and mm with stresses in Pa and MPa."""
    truth, found = np.array([0.8, 1.9]), []
    for unit in (1e5, 0.1):  # [Pa] that 1e5 Pa are in Pa, and in MPa
        made = Block(n=2, derivatives="hand", unknown="layers", layers=2, traction=0.2 * unit, modulus=unit)
        data = block_csv(tmp_path, made, np.log(unit * truth))
        for off in ("", *(f",modulus={unit * 10.0**k!r}" for k in (-6, 6))):
            (spec,) = problems([PULLED.format(traction=0.2 * unit, data=data, modulus=off)])
            ended = invert(spec, routes(["adjoint"])[0], Engine())
            assert ended.end.startswith("converged")
            assert (off == "") == (ended.iterates[0].says is None)
            found.append((len(ended.iterates), *np.exp(ended.p) / unit / truth))
    steps, *moduli = np.transpose(found)
    assert np.ptp(steps) <= 2
    assert np.abs(np.array(moduli) - 1.0).max() < 1e-6


def test_what_has_no_stiffness_is_not_scaled() -> None:
    grip = Block(n=2, load="displacement")
    assert grip.scaled(grip.parameters.start, 2.0) is None
    assert fitted_factor(Model(grip), grip.parameters.start) is None
    with pytest.raises(NotOffered, match="no stiffness"):
        grip.stiffened(2.0)


def test_a_file_is_fitted_from_a_body_without_a_field(tmp_path) -> None:
    """A cube's own data once started from an invisible sinusoidal field."""
    made = Block(n=2, derivatives="hand", modulus=1.0)
    block = Block(n=2, derivatives="hand", data=block_csv(tmp_path, made, made.parameters.start))
    assert block.parameters.start.tolist() == [0.0] * 8
    assert Model(block).value(block.parameters.start) < 1e-28


def test_a_prior_stays_where_it_was_when_a_start_is_scaled(tmp_path) -> None:
    """Its centre is the start that was asked for, a thousandth of what the data tell; it wins."""
    made = Block(n=2, derivatives="hand", unknown="constants", traction=0.2, modulus=1.0)
    data = block_csv(tmp_path, made, made.parameters.start)
    options = f"n=2,derivatives=hand,unknown=constants,traction=0.2,data={data},modulus=1000.0"
    (spec,) = problems([f"block[{options},alpha=1e9,phi=amplitude]"])
    ended = invert(spec, routes(["adjoint"])[0], Engine())
    assert ended.iterates[0].says is not None
    assert ended.p == pytest.approx(spec().parameters.start, rel=1e-6)


class Warm(Problem):
    """u = c + exp(-p), data c + 1: c is a temperature in kelvin, and exp(-p) what p has to do with it."""

    name = "warm"
    offers = Offers.LINEARIZE
    n_state = 2
    linear = True

    def __init__(self, *, c: float, start: float = 1.0) -> None:
        self.c, self.parameters = c, Parameters(start=np.full(2, start), scale=np.ones(2))

    def residual(self, u, p):
        return u - self.c - np.exp(-p)

    def tangent(self, u, p):
        return np.eye(2)

    def objective(self, u, p):
        return 0.5 * ((u - self.c - 1.0) ** 2).sum()

    def linearize(self, u, p):
        return Linearization(np.diag(np.exp(-p)), u - self.c - 1.0, np.zeros(2))

    def observation(self, u, p):
        return Observation(u, np.full(2, self.c + 1.0), np.eye(2))


@pytest.mark.parametrize("c", [0.0, 300.0, 1e5])
def test_the_end_does_not_depend_on_where_temperatures_count_from(c: float) -> None:
    ended = invert(ProblemSpec("warm", {"c": c}, Warm), routes(["adjoint"])[0], Engine())
    assert ended.end.startswith("converged: |dJ/dp| is 1e-09 of that at the start")
    assert np.abs(ended.p).max() < 1e-8
