"""Problems that offer COMPLEX and drop imaginary parts: which of R and J does, and what complex steps say then."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import somewhere, zoo
from duffing.problem import Duffing

from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import LostImaginaryPart
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.imaginary import losses
from gradient_routes.routes.model import Model

LOWER = 0.9999  # nearer to 1 than the longest step
COMPLEX = {name: problem for name, problem in zoo().items() if Offers.COMPLEX in problem.offers}


class Conjugated(Duffing):
    def objective(self, u: Array, p: Array) -> Array:
        return 0.5 * np.vdot(u - self.d, u - self.d)


class Absolute(Duffing):
    def objective(self, u: Array, p: Array) -> Array:
        return 0.5 * np.sum(np.abs(u - self.d) ** 2)


class RealJ(Duffing):
    def objective(self, u: Array, p: Array) -> Array:
        return super().objective(u, p).real


class CastJ(Duffing):
    def objective(self, u: Array, p: Array) -> Array:
        return np.float64(super().objective(u, p))


class FloatJ(Duffing):
    def objective(self, u: Array, p: Array) -> float:
        return 0.5 * math.fsum(((u - self.d) ** 2).tolist())


class RealStiffness(Duffing):
    def residual(self, u: Array, p: Array) -> Array:
        return super().residual(u, np.array([p[0].real, p[1]]))


class RealCubic(Duffing):
    """The springs are soft: they are a thousandth of R."""

    def residual(self, u: Array, p: Array) -> Array:
        return p[0] * (self.laplacian @ u) + 1e-3 * p[1] * u.real**3 - self.f

    def tangent(self, u: Array, p: Array) -> Array:
        return super().tangent(u, p * [1.0, 1e-3])


class Preallocated(Duffing):
    def residual(self, u: Array, p: Array) -> Array:
        R = np.empty(self.n_state)
        R[:] = super().residual(u, p)
        return R


LOSING = {
    Conjugated: ("objective", "drops Im u"),
    Absolute: ("objective", "drops Im u"),
    RealJ: ("objective", "drops Im u"),
    CastJ: ("objective", "drops Im u"),
    FloatJ: ("objective", "raises TypeError for complex u: "),
    RealStiffness: ("residual", "drops Im p"),
    RealCubic: ("residual", "drops Im u"),
    Preallocated: ("residual", "drops Im u"),
}


def lost(problem: Problem, p: Array, seed: int = 0) -> dict[str, str]:
    return losses(problem, Model(problem).solve(p).u, p, seed)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", LOSING, ids=lambda kind: kind.__name__)
def test_it_is_told_which_function_drops_them_and_of_what(kind: type[Duffing], seed: int) -> None:
    name, says = LOSING[kind]
    found = lost(kind(), somewhere(Duffing()), seed)
    assert [*found] == [name]
    assert found[name].startswith(says)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", COMPLEX)
def test_no_sound_problem_is_suspected(name: str, seed: int) -> None:
    problem = COMPLEX[name]
    for p in (problem.parameters.start, somewhere(problem, seed)):
        assert lost(problem, p, seed) == {}


@pytest.mark.parametrize("exponent", [-9, 0, 11])
def test_units_do_not_matter(exponent: int) -> None:
    """A stiffness of 1e11 beside a cubic one of 1e-9: u stays of the size of 1."""

    class Scaled(Duffing):
        def __init__(self) -> None:
            super().__init__()
            self.unit = np.array([10.0**exponent, 10.0**-exponent])

        def residual(self, u: Array, p: Array) -> Array:
            return super().residual(u, p / self.unit)

        def tangent(self, u: Array, p: Array) -> Array:
            return super().tangent(u, p / self.unit)

    class Lossy(Scaled):
        def residual(self, u: Array, p: Array) -> Array:
            return super().residual(u, np.array([p[0], p[1].real]))

    p = Scaled().unit * [0.8, 1.2]
    assert lost(Scaled(), p) == {}
    assert lost(Lossy(), p)["residual"].startswith("drops Im p")


def test_a_kink_is_no_loss() -> None:
    """Where J has a corner a complex step takes one side, and a difference the mean of both."""

    class Corner(Duffing):
        def objective(self, u: Array, p: Array) -> Array:
            return super().objective(u, p) + (1.0 + np.where(p.real > 1.0, 1.0, 3.0) * (p - 1.0)).sum()

    assert lost(Corner(), np.ones(2)) == {}


def test_nothing_outside_the_domain_is_asked_for() -> None:
    class Bounded(Duffing):
        def residual(self, u: Array, p: Array) -> Array:
            assert (p.real > LOWER).all()
            return super().residual(u, p)

    problem = Bounded()
    problem.parameters = replace(problem.parameters, lower=LOWER)
    assert lost(problem, np.ones(2)) == {}


def test_a_problem_that_does_not_offer_complex_arrays_has_nothing_to_lose() -> None:
    class Real(Absolute):
        offers = Offers.LINEARIZE

    assert lost(Real(), np.ones(2)) == {}


@pytest.mark.parametrize("kind", LOSING, ids=lambda kind: kind.__name__)
def test_the_complex_step_refuses(kind: type[Duffing]) -> None:
    name, says = LOSING[kind]
    problem = kind()
    with pytest.raises(LostImaginaryPart, match=rf"^duffing: complex step lost: {name} {says}.* - use no abs") as told:
        complex_step.prepare(Model(problem), problem.parameters.start)
    assert "\n" not in str(told.value)


def softplus(x: Array) -> Array:
    """By np.logaddexp, which takes no complex numbers."""
    return np.logaddexp(0.0, x.real)


FAINT = {
    "softplus": lambda p: softplus(10.0 * (p - 1.0)).sum(),
    "absolute": lambda p: np.abs(p) @ np.abs(p),
    "cast": lambda p: float(p[-1].real),
    "conjugating": lambda p: np.vdot(p[-1], p[-1]).real,
}


class Faint(Duffing):
    """A third parameter, which J sees only through a small term; it has an offset, beside which this is nothing."""

    def __init__(self, term) -> None:
        super().__init__()
        base = self.parameters
        self.parameters = replace(
            base, start=np.append(base.start, 0.7), scale=np.append(base.scale, 1.0), label=lambda i: f"p_{i + 1}"
        )
        self.term = term

    def residual(self, u: Array, p: Array) -> Array:
        return super().residual(u, p[:2])

    def tangent(self, u: Array, p: Array) -> Array:
        return super().tangent(u, p[:2])

    def objective(self, u: Array, p: Array) -> Array:
        return super().objective(u, p[:2]) + 1e3 * p[0] + 2e-4 * self.term(p[2:])


@pytest.mark.parametrize("term", FAINT)
def test_a_slope_that_is_exactly_zero_where_J_varies_is_refused_once(term: str) -> None:
    """Too faint beside other slopes for a random direction through all parameters to show it."""
    problem = Faint(FAINT[term])
    p = problem.parameters.start
    assert lost(problem, p) == {}
    gradient = complex_step.prepare(Model(problem), p)
    said = r"^duffing: complex step lost: Im J is exactly 0 for p_3, a difference is .* - use no"
    with pytest.raises(LostImaginaryPart, match=said):
        gradient(p)


def test_parameters_that_J_does_not_depend_on_are_no_loss() -> None:
    for problem in (Faint(lambda p: 0.0), Bar(), Bar(stop="penalty", gap=2.0)):
        p, model = problem.parameters.start, Model(problem)
        gradient = complex_step.prepare(model, p)
        g = gradient(p).gradient
        assert (g == 0.0).any()
        work = model.tally.work.forward_solves
        np.testing.assert_array_equal(gradient(p).gradient, g)
        assert model.tally.work.forward_solves == 2 * work == 2 * len(p)


def test_a_component_of_R_that_drops_them_beside_large_ones_is_found() -> None:
    class Beside(Duffing):
        """The third row of R is in other units, and its cubic spring is cast."""

        def residual(self, u: Array, p: Array) -> Array:
            R = super().residual(u, p) * 1e7
            R[2] = super().residual(u.real, p.real)[2]
            return R

        def tangent(self, u: Array, p: Array) -> Array:
            return super().tangent(u, p) * np.where(np.arange(len(u)) == 2, 1.0, 1e7)[:, None]

    found = lost(Beside(), somewhere(Duffing()))
    assert found["residual"].endswith("of 1 of its 4 components")


@pytest.mark.parametrize("problem", [Bar(), Block(n=2)], ids=lambda problem: problem.name)
def test_the_test_is_not_counted(problem: Problem) -> None:
    p = problem.parameters.start
    model = Model(problem)
    gradient = complex_step.prepare(model, p)
    assert model.tally.work.forward_solves == 0
    gradient(p)
    assert model.tally.work.forward_solves == len(p)
