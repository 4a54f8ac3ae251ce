"""All parameters times a common factor s: the line p(s) along which a bar is softened or stiffened."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gradient_routes.bench.cases.case import RouteSpec
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.route import Gradient


@dataclass(frozen=True)
class Ray:
    """p(s) from p_hat = p(1), (n_p,): p_hat + log s where p is a logarithm, s p_hat elsewhere.

    Which of them are logarithms, the units of the problem's parameters tell.
    """

    problem: Problem
    p_hat: Array
    solver: Solver

    @cached_property
    def log(self) -> Array:
        """(n_p,) bool."""
        parameters = self.problem.parameters
        return np.array([parameters.unit_of(i).startswith("log") for i in range(len(parameters))])

    @cached_property
    def model(self) -> Model:
        return Model(self.problem, self.solver)

    def p(self, s: float) -> Array:
        """(n_p,). Raises DomainError where it leaves the domain."""
        p = np.where(self.log, self.p_hat + np.log(s), s * self.p_hat)
        return self.problem.parameters.check(p, f"{self.problem.name} at s = {s:g}")

    def by_s(self, s: float) -> Array:
        """dp/ds (n_p,)."""
        return np.where(self.log, 1.0 / s, self.p_hat)

    def solve(self, s: float) -> State:
        """The state at p(s), from scratch. Raises DomainError, NotConverged, SingularMatrix."""
        return self.model.solve(self.p(s))

    def objective(self, s: float) -> float:
        return float(self.solve(s).J)

    def active_set(self, s: float) -> Hashable | None:
        return self.problem.active_set(self.solve(s).u, self.p(s))

    def tip(self, u: Array) -> float | None:
        """The displacement [m] that a stop limits."""
        return self.problem.tip(u)


class Gradients:
    """dJ/dp by one route along a ray, prepared (compiled, say) once for all s that resolve its options alike."""

    def __init__(self, ray: Ray, route: RouteSpec) -> None:
        self.ray, self.route = ray, route
        self._prepared: dict[str, Gradient] = {}

    def __call__(self, s: float) -> Array:
        """(n_p,) at p(s)."""
        p, route = self.ray.p(s), self.route.route
        options = route.resolve(self.ray.model, p, **(route.defaults | self.route.options))
        key = repr(options)
        if key not in self._prepared:
            self._prepared[key] = route.prepare(self.ray.model, p, **options)
        return np.asarray(self._prepared[key](p).gradient)

    def slope(self, s: float) -> float:
        """dJ/ds."""
        return float(self(s) @ self.ray.by_s(s))


def bisect(ray: Ray, below: float, above: float, resolution: float = 1e-12) -> tuple[float, float]:
    """Two s, `resolution` apart relative to s, between which the active set of `below` is left."""
    before = ray.active_set(below)
    while above - below > resolution * above:
        middle = 0.5 * (below + above)
        if ray.active_set(middle) == before:
            below = middle
        else:
            above = middle
    return below, above
