"""One Newton step and one adjoint correction more: a gradient of second order in the solves, and so an error bar.

With e the error of u, an adjoint gradient at u is off by O(e): R(u) = 0 does not hold. From u and lam at hand

    du = -R_u(u)^{-1} R(u),   v = u + du,   lam' = lam + R_u(u)^{-T} (-J_u(v) - R_u(v)^T lam),
    g' = J_p(v) + R_p(v)^T lam'

leave O(e^2) where R is smooth and the two solves are accurate. |g - g'| is then the error of g, to first order; compare
the super-efficiency of implicit gradients of Ablin, Peyre & Moreau 2020, for functions that are defined as minima.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.problems.problem import Array
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.linearized_solve import LinearizedSolver
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.tally import Work

RTOL = 1e-2  # of the solves of an error bar, relative to the residuals they start from: two digits of the error


@dataclass(frozen=True)
class Corrected:
    """J, g' (n_p,), v (n_u,) and lam' (n_u,); terms: |J_p|_2 + |R_p^T lam'|_2, whose sum g' is."""

    J: float
    gradient: Array
    v: Array
    lam: Array
    terms: float


def corrected(model: Model, state: State, R_u: LinearizedSolver, lam: Array) -> Corrected:
    """A residual, a linearization, a product and one solve each way, beside what R_u takes; see above."""
    v = state.u + R_u.solve(-model.residual(state.u, state.p))
    there = replace(state, u=v)
    lin = model.linearize(there)
    R_u_there = model.tangent_operator(there)
    lam = lam + R_u.solve_transposed(-lin.J_u - model.matvec(R_u_there.T, lam))
    implicit = lin.R_p.T @ lam
    terms = float(np.linalg.norm(lin.J_p) + np.linalg.norm(implicit))
    return Corrected(model.problem.objective(v, state.p), lin.J_p + implicit, v, lam, terms)


def correction(forward: ForwardWork, factors: str) -> Work:
    """Declared: the work of `corrected` beside that of one transposed solve, and of the residual at v."""
    extra = Work(residuals=2, assemblies=0 if forward.matrix_free else 1, solves=1)
    if forward.linear or factors != "refined":
        return extra + Work(matvecs=1, transposed_solves=1)
    if forward.counted is None:
        return extra + Work(matvecs=3, solves=1, transposed_solves=2)
    # one transposed solve with all products was declared: those of the solve with R_u move over
    sweeps = forward.counted.solves - forward.cold.solves - 1
    return extra + Work(solves=sweeps, transposed_solves=-sweeps)


def adjoint_at(model: Model, state: State, u: Array) -> tuple[Array, Array]:
    """dJ/dp (n_p,) and lam (n_u,) of an exact adjoint at the state u (n_u,), by the factors of the solved `state`."""
    at = replace(state, u=u)
    lin = model.linearize(at)
    lam = LinearizedSolver(model, at, "refined").solve_transposed(-lin.J_u)
    return lin.J_p + lin.R_p.T @ lam, lam


def error_bar(model: Model, state: State, u: Array, lam: Array | None) -> Corrected:
    """g' to hold a gradient of any route against, at the state u (n_u,) that it belongs to, with its lam if it has one.

    state  solved at the same p with the same solver, whose factors are used. Without lam, one more transposed solve.
    Raises NotConverged, SingularMatrix.
    """
    at = replace(state, u=u)
    solver = replace(model.solver, adjoint_rtol=max(RTOL, model.solver.adjoint_rtol))
    R_u = LinearizedSolver(Model(model.problem, solver), at, "refined")
    if lam is None:
        _, lam = adjoint_at(model, state, u)
    return corrected(model, at, R_u, lam)
