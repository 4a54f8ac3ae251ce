"""The adjoint method with one deliberate mistake, to test verification: mistakes found in published codes."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError, NotOffered
from gradient_routes.problems.problem import Array, Linearization, Problem
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.linearized_solve import LinearizedSolver, work
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.route import Offers, Result, Work, route

Fault = Annotated[
    Literal[
        "sign",
        "factor",
        "transpose",
        "missing-term",
        "stale",
        "loose",
        "functional",
        "otd",
        "scale",
        "quadrature",
        "stabilization",
        "mesh",
    ],
    "wrong sign of lam; dR/dp of one component doubled; R_u in place of R_u^T; J_p omitted; factors of the previous"
    " Newton step; forward solve at 1e8 times the tolerance; gradient of the integral that J approximates; adjoint"
    " equation differentiated before it is discretized; chain rule of p = log(...) omitted; adjoint equation with"
    " another quadrature, without stabilization, on a coarser mesh",
]
Component = Annotated[int | None, "of fault=factor, counted from 1 [the most sensitive]"]
LOOSE = 1e8  # times the forward tolerance: 1e-4 by default


OWN = ("otd", "quadrature", "stabilization", "mesh")  # the adjoint equation has a discretization of its own


def cost(n_p: int, forward: ForwardWork, *, fault: str, component: int | None) -> Work:
    if fault in OWN:
        return forward.cold + Work(factorizations=1, solves=1)
    if fault == "loose" and forward.counted is not None:
        return forward.counted  # how many steps the looser tolerance saves is known once they are counted
    return work(forward, 1, transposed=fault != "transpose", factors="stale" if fault == "stale" else "refined")


def check(*, fault: str, component: int | None) -> None:
    if component is not None and (component < 1 or fault != "factor"):
        raise InputError(
            f"faulty-adjoint: component={component} - fault=factor takes one from 1, other faults take none"
        )


def missing(problem: Problem, *, fault: str, component: int | None) -> str | None:
    lacks = {
        "functional": (Offers.INTEGRAL not in problem.offers, "a J that stands for an integral"),
        "otd": (Offers.CONTINUOUS_ADJOINT not in problem.offers, "an adjoint equation of its own"),
        **dict.fromkeys(OWN[1:], (Offers.INCONSISTENT_ADJOINT not in problem.offers, "another discretization")),
        "scale": (not problem.parameters.unit_of(0).startswith("log"), "parameters that are logarithms"),
    }
    lacking, what = lacks.get(fault, (False, ""))
    if component is not None and component > len(problem.parameters):
        return f"faulty-adjoint[component={component}]: {problem.name} has {len(problem.parameters)} parameters"
    return f"faulty-adjoint[fault={fault}] needs {what}, which {problem.name} does not have" if lacking else None


@route("faulty-adjoint", needs=Offers.LINEARIZE, cost=cost, check=check, missing=missing, sound=False)
def faulty_adjoint(model: Model, p: Array, *, fault: Fault = "sign", component: Component = None) -> Result:
    """R_u^T lam = -J_u,  dJ/dp = J_p + lam^T R_p, with a deliberate mistake."""
    if fault == "loose":
        model = Model(model.problem, replace(model.solver, rtol=min(0.5, LOOSE * model.solver.rtol)), model.tally)
    state = model.solve(p)
    lin = model.linearize(state)
    J = state.J
    if fault == "functional":
        J, J_u = _known(model.problem.integral(state.u, p))
        lin = replace(lin, J_u=J_u)
    if fault == "otd":
        A, Q = _known(model.problem.continuous_adjoint(state.u, p))
        lin, lam = replace(lin, R_p=Q), model.solve_linear(model.factorize(A), -lin.J_u)
    elif fault == "quadrature" or fault == "stabilization" or fault == "mesh":
        A, Q, b = _known(model.problem.inconsistent_adjoint(state.u, p, fault))
        lin, lam = replace(lin, R_p=Q), model.solve_linear(model.factorize(A), -b)
    else:
        lam = _adjoint_state(model, state, lin, fault)
    gradient = lin.J_p + lin.R_p.T @ lam
    match fault:
        case "sign":
            gradient = lin.J_p - lin.R_p.T @ lam
        case "missing-term":
            gradient = gradient - lin.J_p
        case "factor":
            data_term = gradient - lin.J_p
            i = int(np.abs(data_term).argmax()) if component is None else component - 1
            gradient[i] += data_term[i]
        case "scale":
            gradient = gradient / np.exp(p)
    return Result(J, gradient, state.u, state.residual, lam if lam.shape == state.u.shape else None)


def _adjoint_state(model: Model, state: State, lin: Linearization, fault: str) -> Array:
    R_u = LinearizedSolver(model, state, "stale" if fault == "stale" else "refined")
    return R_u.solve(-lin.J_u) if fault == "transpose" else R_u.solve_transposed(-lin.J_u)


def _known(offered: Any) -> Any:
    if offered is None:
        raise NotOffered(
            "faulty-adjoint: the problem lacks what this fault needs with these options - choose another fault"
        )
    return offered
