"""The minimum by one linear least-squares solve, where u is affine in p: what an iteration has to reach.

Where p is a load and R nonlinear, u is affine in p at small strains: the solve then is that of linear elasticity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gradient_routes.bench.cases.case import RouteSpec, point
from gradient_routes.bench.inversion.invert import Engine
from gradient_routes.bench.inversion.least_squares import Residuals
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.bench.inversion.variables import Variables
from gradient_routes.problems.problem import Array, Problem

ROUNDING = 1e-14  # LSMR's tolerances


@dataclass(frozen=True)
class OneShot:
    """p minimizes 1/2 |H (p - p_0) + r_0|^2 + alpha Phi(p); J there, products with H and H^T, forward solves.

    exact  whether this is the minimum of J, u being affine in p
    """

    p: Array
    J: float
    products: int
    forward_solves: int
    exact: bool = True

    def __str__(self) -> str:
        where, todo = ("u is affine in p", "reach") if self.exact else ("u is affine in p at small strains", "go below")
        return (
            f"{where}: one linear least-squares solve gives J = {self.J:.6g}, for {self.forward_solves}"
            f" forward solves and {self.products} products with H; an iteration should {todo} that"
        )


def of_problem(problem: Problem, route: RouteSpec, engine: Engine, at: str) -> OneShot:
    """From a point of the problem, or from p = 0 where u is affine there only. Raises what its evaluations raise."""
    p = point(problem, at) if problem.affine else np.zeros(len(problem.parameters))
    variables = Variables.of(problem.parameters, p, "none", problem.name)
    objective = Objective(problem, route.route, route.options, engine.solver, variables)
    objective.start(p)
    return one_shot(objective)


def one_shot(objective: Objective) -> OneShot:
    """By LSMR (Fong & Saunders 2011), SciPy's, from the start of the objective; exact where Phi is quadratic."""
    from scipy.sparse.linalg import lsmr

    x, before = objective.accepted.x, objective.forward_solves
    residuals = Residuals(objective)
    r, A = residuals(x), residuals.derivative(x)
    step, _, iterations, *_ = lsmr(A, -r, atol=ROUNDING, btol=ROUNDING, conlim=0.0, maxiter=10 * len(x))
    J = 0.5 * float(np.sum(residuals(x + step) ** 2))
    p, solves = objective.variables.p(x + step), objective.forward_solves - before
    return OneShot(p, J, 2 * int(iterations), solves, objective.problem.affine)
