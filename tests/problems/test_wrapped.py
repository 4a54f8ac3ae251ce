"""A wrapper of a problem forwards everything that it does not change: no method of Problem is lost silently."""

from __future__ import annotations

from inspect import isfunction, signature
from typing import Any

import numpy as np
import pytest

from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.problem import OPTIONAL, Array, Linearization, Offers, Parameters, Problem
from gradient_routes.problems.subspace import Subspace, components, directions
from gradient_routes.problems.wrapped import Wrapped
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.model import Model
from gradient_routes.routes.synthetic_data import with_synthetic_data

PUBLIC = sorted(
    name for name in {*vars(Problem), *Problem.__annotations__} if not name.startswith("_") and name != "parameters"
)
METHODS = [name for name in PUBLIC if isfunction(vars(Problem).get(name))]
# what has an axis of length n_p, or gives a problem: a subspace changes it
CHANGED = {
    *(
        "parameters",
        "typical",
        "case",
        "linearize",
        "traced",
        "reference",
        "observation",
        "continuous_adjoint",
        "inconsistent_adjoint",
        "view",
        "truth",
    ),
    *("twin", "observed", "weighted", "with_stop", "load_cases", "prior", "refined", "fields"),
}


class Doubled(Wrapped):
    """p = 2 c, and nothing else overridden."""

    def p(self, c: Any) -> Any:
        return 2.0 * c


class Spy(Problem):
    """Every attribute is its own, every method returns its name and the p it was called with."""

    name = "spy"


for _name in METHODS:

    def _method(self: Spy, *args: Any, _name: str = _name, **options: Any) -> Any:
        given = signature(getattr(Problem, _name)).bind(self, *args, **options).arguments
        return _name, given.get("p")

    setattr(Spy, _name, _method)


def called(problem: Problem, name: str) -> Any:
    arguments = [q for q in signature(getattr(Problem, name)).parameters if q != "self"]
    return getattr(problem, name)(*(3.0 if q == "p" else q for q in arguments))


@pytest.mark.parametrize("name", PUBLIC)
def test_every_public_name_of_a_problem_is_forwarded(name: str) -> None:
    if name in METHODS:
        takes_p = "p" in signature(getattr(Problem, name)).parameters
        assert called(Doubled(Spy()), name) == (name, 6.0 if takes_p else None)
        return
    marked = type("Marked", (Spy,), {name: Offers.TRACE if name == "offers" else "marked"})()
    assert getattr(Doubled(marked), name) == getattr(marked, name) != getattr(Problem, name, None)


def test_a_subspace_overrides_what_it_changes_and_nothing_else() -> None:
    assert {name for name in (*PUBLIC, "parameters") if name in vars(Subspace)} | {"parameters"} == CHANGED


def test_offers_tell_which_methods_are_overridden() -> None:
    class Plain(Problem):
        name = "plain"

    class Smooth(Plain):
        offers = Offers.SOLVE

        def active_set(self, u: Array, p: Array) -> str:
            return "one"

        def fields(self, *args: Any) -> None:
            return None

    assert Plain.offers == Offers.VALUE
    assert Smooth.offers == Offers.SOLVE | Offers.ACTIVE_SET | Offers.FIELDS
    assert all(callable(getattr(Problem, str(offer.name).lower())) for offer in OPTIONAL)


def few(problem: Problem, kind: str) -> Subspace:
    p = problem.parameters.start
    return components(problem, p, np.array([1, 3])) if kind == "components" else directions(problem, p, 2, seed=0)


@pytest.mark.parametrize("kind", ["components", "directions"])
def test_parts_of_a_problem_with_a_prior_and_an_observation_have_the_right_gradient(kind: str) -> None:
    for problem in (Bar(alpha=0.3), Advection(n=3, alpha=0.3)):
        part = few(problem.weighted(0.7), kind)
        c = part.parameters.start + 0.1
        g, reference = (route.prepare(Model(part), c)(c).gradient for route in (adjoint, complex_step))
        np.testing.assert_allclose(g, reference, rtol=1e-10)
        seen, u = part.observation(np.ones(part.n_state), c), np.ones(part.n_state)
        np.testing.assert_array_equal(seen.predicted, problem.observation(u, part.p(c)).predicted)


class Moving(Problem):
    """S(u, p) u = p_0 u + p_1: sensors that p moves; an adjoint equation of its own; two load cases."""

    name = "moving"
    parameters = Parameters(start=np.array([1.0, 2.0, 3.0]), scale=np.ones(3))
    n_state = 1

    def linearize(self, u: Array, p: Array) -> Linearization:
        return Linearization(np.array([[1.0, 2.0, 3.0]]), u, p)

    def observation(self, u: Array, p: Array) -> Any:
        from gradient_routes.problems.data.observation import Observation

        return Observation(p[:1] * u, np.zeros(1), p[:1, None], np.array([[u[0], 1.0, 0.0]]))

    def continuous_adjoint(self, u: Array, p: Array) -> Any:
        return np.eye(1), np.array([[4.0, 5.0, 6.0]])

    def inconsistent_adjoint(self, u: Array, p: Array, other: str) -> Any:
        return np.eye(1), np.array([[7.0, 8.0, 9.0]]), u

    def load_cases(self) -> list[Problem]:
        return [self, self]

    def truth(self) -> Array:
        return np.array([1.0, 5.0, 3.0])


def test_derivatives_by_p_become_those_by_c() -> None:
    problem, u = Moving(), np.ones(1)
    part = components(problem, problem.parameters.start, np.array([1, 2]))
    c, v = part.parameters.start, np.array([1.0, 10.0])
    assert part.observation(u, c).S_p @ v == pytest.approx([1.0])
    assert part.observation(u, c).S_p.T @ np.ones(1) == pytest.approx([1.0, 0.0])
    assert part.continuous_adjoint(u, c)[1] @ v == pytest.approx([65.0])
    assert part.inconsistent_adjoint(u, c, "mesh")[1] @ v == pytest.approx([98.0])
    assert part.linearize(u, c).R_p @ v == pytest.approx([32.0])
    assert [one.p(c).tolist() for one in part.load_cases()] == [[1.0, 2.0, 3.0]] * 2
    assert part.truth().tolist() == [5.0, 3.0]
    assert components(problem, problem.parameters.start, np.array([2])).truth() is None
    along = directions(problem, problem.truth(), 2, seed=0)
    np.testing.assert_allclose(along.p(along.truth()), problem.truth())


def test_synthetic_data_of_a_part_are_those_of_the_whole() -> None:
    problem = Advection(n=3, data="twin")
    p = problem.truth()
    part = with_synthetic_data(components(problem, p, np.array([0])))
    whole, u = with_synthetic_data(problem), np.zeros(problem.n_state)
    assert part.twin() is None is whole.twin()
    assert part.objective(u, part.parameters.start) == whole.objective(u, p) > 0.0
