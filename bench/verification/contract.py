"""The contract of problems and routes, tested on user code: shapes, derivatives, transposes, work."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.bench.verification.factors import ASKED, CONVERGED, EXACT, Factors, relative
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.guarded import FOREIGN, one_line
from gradient_routes.bench.verification.steps import of_steps
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.problems.transient import Transient
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.imaginary import losses
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State, norm
from gradient_routes.routes.route import Result, Route
from gradient_routes.routes.tally import Work

NEARBY = 1e-2  # relative distance from p and its state at which derivatives are tested


@dataclass(frozen=True)
class Contract:
    """Findings on a problem or route."""

    name: str
    findings: tuple[Finding, ...]

    @property
    def broken(self) -> list[Finding]:
        return [f for f in self.findings if f.sound is False]


def of_problem(problem: Problem, p: Array, routes: Sequence[Route], solver: Solver) -> Contract:
    """Everything that `problem.offers` declares, tested near p and its solved state."""
    return Contract(problem.name, tuple(_until_failure(_of_problem(problem, p, routes, solver))))


def of_route(problem: Problem, p: Array, route: Route, options: dict[str, Any], solver: Solver) -> Contract:
    """Everything that a route declares, tested on one problem."""
    found = _until_failure(_declared(problem, p, route, options, solver))
    return Contract(f"{route.name} on {problem.name}", tuple(found))


def _until_failure(findings: Iterator[Finding]) -> Iterator[Finding]:
    """An exception is a violation, and ends the test."""
    try:
        yield from findings
    except InputError:
        raise
    except FOREIGN as failure:
        yield _claim("every call succeeds", False, f"{one_line(failure)} - see --debug")


def _of_problem(problem: Problem, p: Array, routes: Sequence[Route], solver: Solver) -> Iterator[Finding]:
    yield from _parameters(problem)
    if Offers.SOLVE not in problem.offers:
        J = Model(problem, solver).value(p)
        yield _claim("J(p) is a finite number", np.isfinite(J), f"J = {J}")
        return
    wrong_shapes = "; ".join(_wrong_shapes(problem, problem.initial(p), p))
    yield _claim("shapes of u, R, R_u, R_p, J_u, J_p", not wrong_shapes, wrong_shapes)
    if wrong_shapes:
        return
    state = Model(problem, solver).solve(p)
    limit = max(CONVERGED, ASKED * solver.rtol)
    yield Finding("forward residual |R(u, p)| / |R(u_0, p)|", state.residual, limit)
    u, q = _nearby(problem, state)
    lost = losses(problem, u, q)
    if Offers.COMPLEX in problem.offers:
        for name in ("residual", "objective"):
            yield _claim(f"{name} keeps imaginary parts (COMPLEX)", name not in lost, lost.get(name, ""))
    if Offers.LINEARIZE in problem.offers:
        yield from Factors(problem, u, q).findings()
        if isinstance(problem, Transient):
            yield from of_steps(problem, u, q)
    yield from _structure(problem, u, q)
    if Offers.TRACE in problem.offers:
        yield from _traced(problem, u, q)
    for route in routes:
        if route.sound and route.objection(problem) is None and not (lost and Offers.COMPLEX in route.needs):
            yield from _declared(problem, p, route, route.defaults, solver)


def _claim(name: str, holds: Any, otherwise: str = "") -> Finding:
    said, culprit = ("", None) if holds else (otherwise, name)
    return Finding(name, 0.0 if holds else 1.0, 0.5, said, culprit, claim=True)


def _parameters(problem: Problem) -> Iterator[Finding]:
    parameters = problem.parameters
    n_p, outside = len(parameters), ""
    labels = {parameters.label(i) for i in range(n_p)}
    yield _claim("scales are > 0 and finite", np.isfinite(parameters.scale).all() and (parameters.scale > 0).all())
    yield _claim("labels differ", len(labels) == n_p, f"{len(labels)} labels for {n_p} parameters")
    try:
        parameters.check(parameters.start, problem.name)
    except RoutesError as failure:
        outside = str(failure)
    yield _claim("the start lies in the domain", not outside, outside)


def _nearby(problem: Problem, state: State) -> tuple[Array, Array]:
    """A state and parameters close by, where R is not zero and no symmetry of the start hides a term."""
    rng = np.random.default_rng(0)
    size = norm(state.u) or 1.0  # a zero state has no scale
    u = state.u + NEARBY * size * rng.uniform(-1.0, 1.0, len(state.u))
    q = state.p + NEARBY * problem.parameters.natural(state.p) * rng.uniform(-1.0, 1.0, len(state.p))
    inside = (q > problem.parameters.lower) & (q < problem.parameters.upper)
    return u, np.where(inside, q, state.p)


def _wrong_shapes(problem: Problem, u: Array, p: Array) -> Iterator[str]:
    n_u, n_p = problem.n_state, len(p)
    R = np.asarray(problem.residual(u, p))
    if u.shape != (n_u,) or R.shape != (n_u,):
        yield f"u has the shape {u.shape}, R {R.shape}: n_state says ({n_u},)"
        return
    made: dict[str, tuple[Any, int]] = {"u": (u, n_u), "R": (R, n_u), "R_u w": (problem.tangent(u, p) @ u, n_u)}
    if Offers.LINEARIZE in problem.offers:
        lin = problem.linearize(u, p)
        made |= {"R_p v": (lin.R_p @ p, n_u), "R_p^T lam": (lin.R_p.T @ u, n_p)}
        made |= {"J_u": (lin.J_u, n_u), "J_p": (lin.J_p, n_p)}
    for name, (array, length) in made.items():
        if np.shape(array) != (length,):
            yield f"{name} has the shape {np.shape(array)}, not ({length},)"
        elif not np.isfinite(array).all():
            yield f"{name} is not finite"


def _structure(problem: Problem, u: Array, p: Array) -> Iterator[Finding]:
    """Symmetry, definiteness and linearity, where the problem declares them."""
    v, w = np.random.default_rng(1).standard_normal((2, len(u)))
    R_u = problem.tangent(u, p)
    if problem.structure != "general":
        left, right = v * (R_u @ w), w * (R_u @ v)
        off = abs(left.sum() - right.sum()) / (np.abs(left).sum() + np.abs(right).sum())
        said = "" if off <= EXACT else "set structure='general'"
        yield Finding(f"R_u is symmetric (structure={problem.structure})", float(off), EXACT, said)
    if problem.structure == "spd":
        yield _claim("w.R_u w > 0 (structure=spd)", w @ (R_u @ w) > 0, "R_u is not positive definite")
    if problem.linear:
        off = relative(problem.residual(u + w, p) - problem.residual(u, p), R_u @ w)
        yield Finding("R(u + w) - R(u) = R_u w (linear=True)", off, EXACT, "" if off <= EXACT else "set linear=False")


def _traced(problem: Problem, u: Array, p: Array) -> Iterator[Finding]:
    traced, R, J = problem.traced(), problem.residual(u, p), float(problem.objective(u, p))
    yield Finding("R in jax.numpy equals R in NumPy", relative(np.asarray(traced.residual(u, p)), R), EXACT)
    off = abs(float(traced.objective(u, p)) - J) / (abs(J) or 1.0)
    yield Finding("J in jax.numpy equals J in NumPy", off, EXACT)


def _declared(problem: Problem, p: Array, route: Route, options: dict[str, Any], solver: Solver) -> Iterator[Finding]:
    """The result has the shapes of a gradient, a state and an adjoint; counted work is the declared work."""
    objection = route.objection(problem, **options)
    if objection is not None:
        raise InputError(f"check: {objection} - choose another route or problem")
    model = Model(problem, solver)
    options = route.resolve(model, p, **route.defaults | options)
    gradient = route.prepare(model, p, **options)
    before = model.tally.work
    result = gradient(p)
    counted = model.tally.work - before
    shape = np.shape(result.gradient)
    yield _claim(f"{route.name}: gradient (n_p,)", shape == p.shape, f"its shape is {shape}, not {p.shape}")
    wrong = ", ".join(_invalid(problem, result))
    yield _claim(f"{route.name}: J, u and lam are valid", not wrong, wrong)
    declared = vars(route.cost(len(p), _forward(problem, p, solver, counted), **options))
    differs = {kind: n for kind, n in vars(counted).items() if n != declared[kind]}
    said = ", ".join(f"{kind} counted {n}, declared {declared[kind]}" for kind, n in differs.items())
    yield _claim(f"{route.name}: counted work is the declared work", not differs, said)


def _invalid(problem: Problem, result: Result) -> Iterator[str]:
    """J, u and lam of a route that are neither None nor of the right kind."""
    J = result.J
    if J is not None and not (np.isrealobj(J) and isinstance(J, float | int | np.floating) and np.isfinite(J)):
        yield f"J = {J!r} is not a finite number"
    for name, vector in (("u", result.u), ("lam", result.lam)):
        if vector is not None and np.shape(vector) != (problem.n_state,):
            yield f"{name} has the shape {np.shape(vector)}, not ({problem.n_state},)"


def _forward(problem: Problem, p: Array, solver: Solver, counted: Work) -> ForwardWork:
    model = Model(problem, solver)
    if Offers.SOLVE not in problem.offers:
        return ForwardWork(Work(forward_solves=1))
    state = model.solve(p)
    known = None if problem.linear else counted
    return ForwardWork(state.work, problem.linear, solver.rtol, known, problem.matrix_free, model.newton)
