"""An inversion that has converged has asked J: a gradient that is not that of J is named, a sound one is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.inversion.confirmation import directions
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.bench.inversion.variables import Variables
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.problem import Offers, Parameters, Problem
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route, Work, route

BAR, BLOCK = "bar[noise=0.01,alpha=0.01]", "block[n=2,data=twin,alpha=0.001]"
UNITS = 10.0 ** (3 * (np.arange(8) % 3 - 1))  # parameters in three units


def spoilt(spoil) -> Route:
    """The adjoint route with its gradient spoilt."""

    @route("spoilt", needs=Offers.LINEARIZE, cost=adjoint.cost)
    def wrong(model, p):
        found = adjoint.function(model, p)
        return found._replace(gradient=spoil(np.array(found.gradient)))

    return wrong


def without(i: int):
    return lambda g: np.where(np.arange(len(g)) == i, 0.0, g)


WRONG = {
    "zero": (lambda g: 0.0 * g, "at the end its slope along a random direction is 0,"),
    "first dropped": (without(0), "at the end its slope along a random direction"),
    "last dropped": (without(7), "at the end its slope along a random direction"),
    "sign": (lambda g: -g, "at the last step its slope along the steepest descent"),
    "doubled": (lambda g: 2.0 * g, "at the start its slope along the steepest descent"),
    "halved": (lambda g: 0.5 * g, "at the start its slope along the steepest descent"),
    "nano": (lambda g: 1e-9 * g, "at the end its slope along a random direction"),
    "giga": (lambda g: 1e9 * g, "at the last step its slope along the steepest descent"),
    "units": (lambda g: UNITS * g, "at the start its slope along the steepest descent"),
}


def inverted(problem: str, by: Route | str, solver: Solver | None = None, **engine) -> Inversion:
    (spec,) = case.problems([problem])
    (way,) = case.routes([by]) if isinstance(by, str) else [case.RouteSpec(by.name, by, {})]
    limits = engine.pop("limits", Limits(60, 1e-9))
    return invert(spec, way, Engine(limits=limits, solver=solver or Solver(), **engine))


@pytest.mark.parametrize(
    ("problem", "fault"),
    [*((BAR, fault) for fault in WRONG), (BLOCK, "first dropped"), (BLOCK, "sign"), (BLOCK, "halved")],
)
def test_a_gradient_that_is_not_that_of_J_is_named(problem: str, fault: str) -> None:
    spoil, where = WRONG[fault]
    found = inverted(problem, spoilt(spoil))
    assert found.misled
    assert found.end.startswith(f"gradient is not that of J: {where}")
    assert found.end.endswith(f" - see routes check --problem '{problem}' --route spoilt")


@pytest.mark.parametrize("optimizer", ["gauss-newton", "trust", "descent", "adam"])
def test_no_optimizer_believes_a_gradient_of_zero(optimizer: str) -> None:
    assert inverted(BAR, spoilt(lambda g: 0.0 * g), optimizer=optimizer).misled


SOUND = {
    "bar": "lbfgs",
    "bar[n=1]": "lbfgs",
    BAR: "trust",
    BLOCK: "lbfgs",
    "bar[stop=penalty,noise=0.01,alpha=0.01]": "gauss-newton",
    "bar[noise=0.01,alpha=0.001,phi=tv]": "lbfgs",
    "block[n=2,unknown=constants,data=twin]": "lbfgs",
    "plate[n=2,law=linear,unknown=constants,modulus=2e11,traction=1e8,data=twin,noise=1e-6]": "lbfgs",  # log E = 26
    "advection[n=4,data=twin,noise=0.01,alpha=0.0001]": "lbfgs",
    "advection[n=4,unknown=source,data=twin,noise=0.001,alpha=0.0001]": "gauss-newton",
}


@pytest.mark.parametrize("problem", SOUND)
def test_a_sound_gradient_stays_converged_for_four_forward_solves(problem: str) -> None:
    found = inverted(problem, "adjoint", optimizer=SOUND[problem], limits=Limits(200, 1e-8))
    against = "that at the start" if problem.startswith("advection") else "1/2 |d|^2"  # of moduli
    assert found.end == f"converged: |dJ/dp| is 1e-08 of {against}, confirmed by 4 forward solves"
    assert (found.misled, found.ending_solves) == (False, 4)


@pytest.mark.parametrize("by", ["fd-one-sided", "fd-central", "complex-step", "tangent", "implicit-ad", "unrolled-ad"])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-6])
def test_no_sound_route_is_doubted_at_any_tolerance(by: str, tolerance: float) -> None:
    """A coarse tolerance leaves a slope, which the gradient promises; nobody is told off for it."""
    found = inverted(BAR, by, limits=Limits(200, tolerance))
    assert found.end.startswith("converged")
    assert "confirmed by 4 forward solves" in found.end


@pytest.mark.parametrize("positive", ["none", "log", "softplus"])
def test_parameters_kept_positive_are_confirmed_in_their_own_variables(positive: str) -> None:
    found = inverted("bar[parametrization=raw,sensors=8,noise=0.02]", "adjoint", positive=positive)
    assert found.end.startswith("converged")
    assert ", confirmed by " in found.end


@pytest.mark.parametrize("rtol", [1e-2, 1e-8])
def test_loose_forward_solves_are_not_held_against_the_gradient(rtol: float) -> None:
    """J of a loose solve has another slope than the gradient says; that of a tight one has not."""
    found = inverted(BLOCK, "adjoint", Solver(rtol=rtol), limits=Limits(60, 1e-6))
    assert not found.misled
    wrong = inverted(BLOCK, spoilt(without(0)), Solver(rtol=rtol), limits=Limits(60, 1e-6))
    assert not wrong.end.startswith("converged")


def test_a_stall_of_loose_forward_solves_names_them() -> None:
    found = inverted("block[n=2,data=twin,alpha=0.001,noise=0.001]", "adjoint", Solver(rtol=1e-3))
    assert found.end.startswith("stopped: dJ/dp is less than the error that the solves leave in it, about ")
    assert found.end.endswith("(--rtol 0.001) - tighten them")


def test_all_forward_solves_of_the_confirmation_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a bar that counts how often it is solved; `doubt` solves once more and is not counted."""
    calls = []
    solve = Model.solve
    monkeypatch.setattr(
        Model, "solve", lambda self, p, *more, **named: calls.append(1) or solve(self, p, *more, **named)
    )
    for spoil in (lambda g: g, without(0), lambda g: -g):
        calls.clear()
        found = inverted("bar", spoilt(spoil))
        assert found.forward_solves == len(calls) - 1
        assert found.forward_solves == found.iterates[-1].forward_solves + found.ending_solves
        rows = found.tables["inversion"]
        assert [row["ending_solves"] for row in rows] == [None] * (len(rows) - 1) + [found.ending_solves]


class Edged(Problem):
    """u = p, J = 1/2 |p - (0, 0.5)|^2 on p_1 > -1e-13, where p_1 alone is near its bound at the minimum."""

    name, offers, structure, linear, n_state = "edged", Offers.VALUE, "spd", True, 0

    def __init__(self) -> None:
        self.parameters = Parameters(start=np.ones(2), scale=np.ones(2), lower=np.array([-1e-13, -np.inf]))

    def value(self, p):
        assert p[0] > -1e-13
        return 0.5 * float(p[0] ** 2 + (p[1] - 0.5) ** 2)


def edged(gradient) -> Inversion:
    @route("by-hand", needs=Offers.VALUE, cost=lambda n_p, forward: Work(forward_solves=1))
    def by_hand(model, p):
        return model.value(p), gradient(p)

    return invert(case.ProblemSpec("edged", {}, Edged), case.RouteSpec("by-hand", by_hand, {}), Engine())


def test_a_bound_close_by_is_not_crossed_and_other_parameters_are_varied_all_the_same() -> None:
    assert edged(lambda p: np.array([p[0], p[1] - 0.5])).end.endswith("confirmed by 4 forward solves")
    assert "at the end its slope along a random direction" in edged(lambda p: np.array([p[0], 0.0])).end


def test_the_minimum_of_another_J_is_not_confirmed() -> None:
    """The route's own J and gradient agree, and dJ/dp of the problem is not 0 where they end."""
    functional = "faulty-adjoint[fault=functional]"
    found = inverted("advection[n=4,data=twin,noise=0.01,alpha=0.001]", functional, limits=Limits(200, 1e-6))
    assert "is not that of the problem" in found.iterates[0].says
    assert found.end.startswith("gradient is not that of J: at the end its slope along a random direction")


def test_directions_vary_every_parameter_by_its_natural_change() -> None:
    """Or by a hundredth of itself, if that is more: a logarithm of 26 changes by one."""
    problem = Bar(n=50, parametrization="raw")
    variables = Variables.of(problem.parameters, problem.parameters.start, "none", "test")
    objective = Objective(problem, adjoint, {}, Solver(), variables)
    p = np.geomspace(0.5, 4000.0, 50)
    objective.start(p)
    one, other = directions(objective)
    assert not np.allclose(np.abs(one), np.abs(other))
    for v in (one, other):
        steps = np.abs(v) * np.abs(p).max() / np.maximum(1.0, p / 100.0)
        assert ((0.5 <= steps) & (steps <= 1.0)).all()
        assert set(np.sign(v)) == {-1.0, 1.0}


FILE = """
import numpy as np
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.route import route

@route("zero", needs=Offers.LINEARIZE, cost=adjoint.cost)
def zero(model, p):
    return adjoint.function(model, p)._replace(gradient=np.zeros_like(p))
"""
END = "gradient is not that of J"


def test_the_command_ends_with_1_and_names_the_command_that_judges(cli) -> None:
    Path("mine.py").write_text(FILE)
    ran = cli("invert", "--problem", "bar", "--route", "mine.py:zero", "--route", "adjoint", "--no-plot")
    assert (ran.code, ran.err) == (1, "")
    assert END in ran.out
    assert "routes check --problem bar --route mine.py:zero" in ran.out
    rows = Store(Path("results/routes.sqlite")).records("inversion")
    (wrong,) = [row for row in rows if row["route"] == "mine.py:zero"]
    assert wrong["says"].startswith(END)
    assert wrong["ending_solves"] > 2
    checked = cli("check", "--problem", "bar", "--route", "mine.py:zero", "--no-store", "--no-plot")
    assert checked.code == 1
    assert cli("invert", "--problem", "bar", "--no-store", "--no-plot").code == 0


@pytest.mark.parametrize("draws", [(), ("--draws", "2")])
def test_a_sweep_with_a_wrong_gradient_ends_with_1(cli, draws: tuple[str, ...]) -> None:
    Path("mine.py").write_text(FILE)
    swept = ("--problem", "bar[noise=0.01]", "--alpha-sweep", "1e-3", "1", "3", "--no-store", "--no-plot", *draws)
    ran = cli("invert", "--route", "mine.py:zero", *swept)
    assert (ran.code, END in ran.err, ran.err.count("\n")) == (1, True, 1), ran.err
    assert cli("invert", *swept).code == 0
