"""What a loosely converged solve does to a gradient: its error against the tolerance, route by route.

Finite differences differentiate the noise of the solver, the adjoint and implicit AD rely on an identity that holds at
R = 0 only, unrolled AD and the complex step differentiate another iterate. None of their errors is the residual.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.study import Found, Kept, Say
from gradient_routes.bench.execution.cost_model import Prices, prices, unaffordable
from gradient_routes.bench.studies.judged import Bench, said
from gradient_routes.bench.studies.options import one_problem, routes_of
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.problem import Offers, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.route import Options, Result, Route
from gradient_routes.routes.solvers.iterative import descent, krylov
from gradient_routes.routes.solvers.registry import linear_solver as named

Swept = Literal["forward", "adjoint", "both"]
TIGHT = 1e-12  # tolerance of the solves that are not swept
NOT_SHARED = ("jumps", "interrupted", "points")  # by rows
FEW = 32  # unknowns up to which conjugate gradients are exact before they are accurate


@dataclass(frozen=True)
class ToleranceSweep:
    """Tolerances, loosest first; `forward` or `adjoint` is a tolerance that stays as it is instead."""

    tolerances: tuple[float, ...]
    forward: float | None = None
    adjoint: float | None = None

    @property
    def name(self) -> str:
        return "adjoint" if self.forward is not None else "forward" if self.adjoint is not None else "both"

    @property
    def pairs(self) -> list[tuple[float, float]]:
        """(rtol, adjoint_rtol) of the solver, one pair a point."""
        return [(self.forward or t, self.adjoint or t) for t in self.tolerances]


def decades(loosest: float, tightest: float, per_decade: int = 1) -> tuple[float, ...]:
    """Tolerances in equal ratios, both ends among them. Raises InputError."""
    if not 0.0 < tightest <= loosest < 1.0 or per_decade < 1:
        raise InputError(
            f"tolerances from {loosest:g} to {tightest:g}, {per_decade} a decade - give 1 > loosest >= tightest > 0 and"
            " at least 1"
        )
    count = round(per_decade * np.log10(loosest / tightest)) + 1
    return tuple(float(f"{t:.6g}") for t in np.geomspace(loosest, tightest, count))


@dataclass(frozen=True)
class Point:
    """A route at one pair of tolerances; skipped as a whole, it has none. Fields are columns of its table."""

    route: str
    route_options: Options
    rtol: float | None = None
    adjoint_rtol: float | None = None
    status: str = "ok"
    reason: str | None = None
    objective: float | None = None
    objective_error: float | None = None
    gradient_error: float | None = None
    reference: str | None = None
    gradient_error_estimate: float | None = None
    residual: float | None = None
    adjoint_residual: float | None = None


@dataclass(frozen=True)
class Tolerance:
    """The study: its points and what they share.

    jumps        R_u is positive definite, so that steepest descent would converge, and the solver is a less even one
    interrupted  by Ctrl-C, after these points
    """

    problem: str
    problem_options: Options
    at: str
    linear_solver: str
    sweep: str
    n_state: int
    n_param: int
    jumps: bool = field(repr=False)
    interrupted: bool = field(repr=False)
    points: tuple[Point, ...] = field(repr=False)

    @property
    def rows(self) -> list[Row]:
        """Tidy: one a point, with the columns of the table `tolerance`."""
        shared = {name: value for name, value in vars(self).items() if name not in NOT_SHARED}
        return [shared | asdict(point) for point in self.points]


def run(
    say: Say,
    *,
    selector: str,
    routes: Sequence[str],
    at: str,
    loosest: float,
    tightest: float,
    per_decade: int,
    sweep: Swept | None,
    rtol: float | None,
    adjoint_rtol: float | None,
    linear_solver: str | None,
    budget: float,
    kept: Path | None = None,
) -> None:
    """Ctrl-C ends the study, not what it has measured."""
    problem, specs = one_problem(selector), routes_of(routes, say)
    tolerances = sweep_of(decades(loosest, tightest, per_decade), sweep, rtol, adjoint_rtol)
    done = tolerance(problem, specs, tolerances, at, linear_solver, budget)
    for row in done.rows:
        say(Kept("tolerance", row))
    say(Found(done))
    if done.interrupted:
        raise KeyboardInterrupt


def sweep_of(
    tolerances: tuple[float, ...], sweep: Swept | None, rtol: float | None, adjoint_rtol: float | None
) -> ToleranceSweep:
    """Which tolerance varies and where the other stays. Raises InputError."""
    sweep = sweep or ("both" if adjoint_rtol is None else "forward")
    if rtol is not None and sweep != "adjoint":
        raise InputError(f"--rtol {rtol:g} with the forward tolerance swept - add --sweep adjoint or drop it")
    if adjoint_rtol is not None and sweep != "forward":
        raise InputError(f"--adjoint-rtol {adjoint_rtol:g} with the adjoint's swept - take --sweep forward or drop it")
    return ToleranceSweep(
        tolerances,
        forward=(rtol or TIGHT) if sweep == "adjoint" else None,
        adjoint=(adjoint_rtol or TIGHT) if sweep == "forward" else None,
    )


def tolerance(
    problem: ProblemSpec,
    routes: Sequence[RouteSpec],
    sweep: ToleranceSweep,
    at: str = "start",
    linear_solver: str | None = None,
    budget: float = 60.0,
) -> Tolerance:
    """Every route at every tolerance, judged by what is found directly at a tight one.

    A route predicted to take more than `budget` seconds in all is skipped. Ctrl-C ends the study, not what it has
    measured. Raises InputError, DomainError, and what the solve at that tight tolerance raises.
    """
    bench = Bench(problem, at, budget)
    linear_solver = linear_solver or default_solver(bench.problem)
    experiment = Experiment(bench, sweep, linear_solver, budget)
    points: list[Point] = []
    interrupted = False
    with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
        try:
            for point in (point for route in routes for point in experiment.points(route)):
                points.append(point)
        except KeyboardInterrupt:
            if not points:
                raise
            interrupted = True
    return Tolerance(
        problem.name,
        problem.options,
        at,
        linear_solver,
        sweep.name,
        bench.problem.n_state,
        len(bench.p),
        bench.problem.structure == "spd" and not named(linear_solver).gradual,
        interrupted,
        tuple(points),
    )


def default_solver(problem: Problem) -> str:
    """One whose tolerance means something: on a linear problem a direct solver is exact after one step."""
    if not problem.linear:
        return Solver.linear_solver
    return descent.name if problem.n_state <= FEW else krylov.name


class Experiment:
    """One problem at one p under a sweep."""

    def __init__(self, bench: Bench, sweep: ToleranceSweep, linear_solver: str, budget: float) -> None:
        self.bench, self.problem, self.p = bench, bench.problem, bench.p
        self.sweep, self.linear_solver, self.budget = sweep, linear_solver, budget
        self._priced: Prices | None = None
        self._states: dict[float, State | None] = {}

    def points(self, spec: RouteSpec) -> Iterator[Point]:
        route, options = spec.route, self._alike(spec)
        try:
            reason = route.objection(self.problem, **options) or self._unaffordable(route, options)
        except Exception as failure:
            yield Point(route.name, options, status="failed", reason=said(failure))
            return
        if reason is not None:
            yield Point(route.name, options, status="skipped", reason=reason)
            return
        yield from (self._point(route, options, *pair) for pair in self.sweep.pairs)

    def _alike(self, spec: RouteSpec) -> Options:
        """Left open, the iteration that unrolled AD differentiates is as slow as the solver's, where there is one."""
        if not named(self.linear_solver).gradual or spec.options.get("inner", "") is not None:
            return spec.options
        options = spec.options | {"inner": "richardson"}
        return options if spec.route.objection(self.problem, **options) is None else spec.options

    def _point(self, route: Route, options: Options, rtol: float, adjoint_rtol: float) -> Point:
        solver = Solver(rtol, linear_solver=self.linear_solver, adjoint_rtol=adjoint_rtol)
        try:
            model = Model(self.problem, solver)
            options = route.resolve(model, self.p, **options)
            result = route.prepare(model, self.p, **options)(self.p)
            state = self._solved(solver)
            measured = self.bench.errors(route, result, model, state) | self._achieved(result, state)
            return Point(route.name, options, rtol, adjoint_rtol, **measured)
        except Exception as failure:
            return Point(route.name, options, rtol, adjoint_rtol, "failed", said(failure))

    def _achieved(self, result: Result, state: State | None) -> dict[str, float | None]:
        """Residuals; of routes that do not tell theirs, that of a forward solve."""
        known = result.residual if state is None or result.residual is not None else state.residual
        return {
            "residual": None if known is None else float(known),
            "adjoint_residual": self._adjoint_residual(result),
        }

    def _solved(self, solver: Solver) -> State | None:
        """A forward solve at p; None for a black box, and where the tolerance is not met."""
        if solver.rtol not in self._states:
            solvable = Offers.SOLVE in self.problem.offers
            try:
                self._states[solver.rtol] = Model(self.problem, solver).solve(self.p) if solvable else None
            except RoutesError:
                self._states[solver.rtol] = None
        return self._states[solver.rtol]

    def _adjoint_residual(self, result: Result) -> float | None:
        if result.lam is None or result.u is None:
            return None
        left, J_u = Model(self.problem).adjoint_residual(result.u, result.lam, self.p)
        return left / (J_u or 1.0)

    def _unaffordable(self, route: Route, options: Options) -> str | None:
        """Why the sweep is not paid for, all of it at the price of the tightest tolerance that can be met."""
        model = Model(self.problem, Solver(min(self.sweep.pairs)[0], linear_solver=self.linear_solver))
        options = route.expect(model, self.p, **options)
        own = self._prices()
        work = len(self.sweep.pairs) * route.cost(len(self.p), own.declared, **options)
        tape = None if route.tape is None else route.tape(self.problem, **options)
        return unaffordable(own, tape, work, self.budget)

    def _prices(self) -> Prices:
        if self._priced is None:
            failure: RoutesError | None = None
            for rtol in sorted({forward for forward, _ in self.sweep.pairs}):
                try:
                    self._priced, _ = prices(
                        Model(self.problem, Solver(rtol, linear_solver=self.linear_solver)), self.p
                    )
                    return self._priced
                except RoutesError as unmet:
                    failure = unmet
            assert failure is not None
            raise failure
        return self._priced
