"""What `routes invert` runs: an inversion per route, or one route over many weights of Phi."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.status import FOREIGN
from gradient_routes.bench.cases.study import Found, Kept, Note, Say
from gradient_routes.bench.inversion.discrepancy import between
from gradient_routes.bench.inversion.history import Iterate
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.lcurve import l_curve, minima
from gradient_routes.bench.inversion.minibatch import minibatched
from gradient_routes.bench.inversion.objective import noise_level
from gradient_routes.bench.inversion.one_shot import OneShot, of_problem
from gradient_routes.bench.inversion.optimizers import Limits, Name, check_noise
from gradient_routes.bench.inversion.resumed import last_estimate
from gradient_routes.bench.inversion.tradeoff import Trade, trade_off
from gradient_routes.bench.inversion.variables import Positive, Variables
from gradient_routes.bench.store.output_files import read_by
from gradient_routes.bench.studies.invert import answer_files
from gradient_routes.bench.studies.invert.linear import by_map
from gradient_routes.bench.studies.invert.messages import Begun, Compared, Ended, LCurve, Taken, Trades
from gradient_routes.bench.studies.options import one_problem
from gradient_routes.problems.errors import OUTSIDE, InputError
from gradient_routes.problems.problem import Array, Problem
from gradient_routes.routes.newton import Solver

One = TypeVar("One")
Start = tuple[Array | None, int]  # p and the iterations before it


def run(
    say: Say,
    *,
    selector: str | None,
    routes: Sequence[str],
    at: str,
    optimizer: Name,
    iterations: int,
    tolerance: float,
    positive: Positive,
    alpha_sweep: tuple[float, float, int] | None,
    draws: int | None,
    minibatch: int | None,
    rate: float,
    seed: int,
    stop_at_noise: bool,
    resume: bool,
    linear: bool,
    saved_map: Path | None,
    frames: Path | None,
    output: Sequence[Path],
    solver: Solver,
    kept: Path | None,
) -> int:
    """An interrupt or a failure ends the run, not what it has found by then."""
    if linear:
        return by_map(say, selector, routes, at, Limits(1, tolerance), saved_map, frames, output, solver, kept)
    if selector is None:
        raise InputError("--problem is missing - name one")
    _check(iterations, tolerance, rate, draws, alpha_sweep, minibatch, optimizer)
    if resume and kept is None:
        raise InputError("--resume: reads a store, with --no-store there is none - leave one of them out")
    engine = Engine(optimizer, Limits(iterations, tolerance, rate, stop_at_noise), solver, positive)
    files = answer_files.outputs(output, [*([] if kept is None else [kept]), *read_by(selector, at)])
    asked = Run(say, one_problem(selector), case.routes(routes), engine, at)
    if alpha_sweep is None:
        asked.each(kept if resume else None, minibatch, seed)
    else:
        asked.sweep(alpha_sweep, draws)
    for file in files if asked.found else ():
        say(Note(answer_files.write(file, asked.found, solver), result=True))
    if asked.failure is not None:
        raise asked.failure
    return 1 if asked.misled else 0


class Run:
    """One call; `failure` is what ended it early, `misled` whether a gradient was not that of J, or the model does not
    explain the data.
    """

    def __init__(self, say: Say, spec: ProblemSpec, routes: Sequence[RouteSpec], engine: Engine, at: str) -> None:
        self.say, self.spec, self.routes, self.engine, self.at = say, spec, routes, engine, at
        self.failure: BaseException | None = None
        self.misled = False
        self.found: list[Inversion] = []

    def each(self, resumed: Path | None, minibatch: int | None, seed: int) -> None:
        """Route by route, from where each ended in the store `resumed` if given; then the cost of each."""
        problem = self.spec()
        self._tell(problem)
        starts: list[Start] = [(None, 0)] * len(self.routes)
        if resumed is not None:  # what is not there is refused before anything runs
            starts = [last_estimate(resumed, self.spec, r, self.engine.optimizer, self.at) for r in self.routes]
        one_shot = self._one_shot(problem)
        done = self._until_it_ends(self._inversions(problem, starts, minibatch, seed, one_shot))
        self.found = done
        kept = [found.tables for found in done]
        for table in ("inversion", "estimates", "constants", "fit", "residuals"):
            for tables in kept:
                self._keep(table, tables.get(table, ()))
        self.say(Found(Compared(done)))

    def _inversions(
        self, problem: Problem, starts: Sequence[Start], minibatch: int | None, seed: int, one_shot: float | None
    ) -> Iterator[Inversion]:
        for route, (p, offset) in zip(self.routes, starts, strict=True):
            run = None if minibatch is None else minibatched(problem, route, self.engine, minibatch, seed)
            Variables.of(problem.parameters, problem.parameters.start, self.engine.positive, problem.name)
            check_noise(problem, self.engine.limits)
            title = f"{self.spec.selector} by {route.name}, {self.engine.optimizer}"
            noise = problem.alpha == 0.0 and noise_level(problem, problem.parameters.start) > 0.0
            self.say(Found(Begun(title, problem.truth() is not None, noise)))
            show = partial(self._show, noise)
            found = invert(self.spec, route, self.engine, self.at, p, show, problem, run, offset)
            yield found
            self.misled = self.misled or found.misled or found.unexplained
            self.say(Found(Ended(found, one_shot)))
            self._warn(found)
            if found.interrupted:
                raise KeyboardInterrupt

    def _show(self, noise: bool, step: Iterate) -> None:
        self.say(Found(Taken(step, noise)))

    def _until_it_ends(self, each: Iterable[One], least: int = 1) -> list[One]:
        """All of them, or those before an interrupt or a failure. Raises either where there are fewer than `least`."""
        done: list[One] = []
        try:
            for found in each:
                done.append(found)  # not all at once: what has come stays
        except (KeyboardInterrupt, *FOREIGN) as failure:
            self.failure = failure
            if len(done) < least:
                raise
        return done

    def sweep(self, given: tuple[float, float, int], draws: int | None) -> None:
        """Over alpha, for one route."""
        if len(self.routes) != 1:
            raise InputError(f"--alpha-sweep with {len(self.routes)} routes - name one, the answers are the same")
        alphas, (route,) = list(dict.fromkeys(float(f"{a:.6g}") for a in np.geomspace(*given))), self.routes
        if len(alphas) < given[2]:
            raise InputError(
                f"--alpha-sweep {given[0]:.10g} {given[1]:.10g}: are the same to six digits - go further apart"
            )
        if draws is not None:
            trades = self._until_it_ends(self._traded(trade_off(self.spec, route, self.engine, alphas, draws, self.at)))
            self._judge([trade.inversion for trade in trades])
            self.say(Found(Trades(trades)))
            return
        swept = self._until_it_ends(self._swept(minima(self.spec, route, self.engine, alphas, self.at)))
        points = l_curve(swept)
        if self.failure is None:
            further = self._swept(between(self.spec, route, self.engine, points, self.at))
            points = l_curve(swept, self._until_it_ends(further, least=0))
        best = next((point for point in points if point.chosen), points[-1]).inversion
        self.found = [best]
        self._tell(best.made)
        self._warn(best)
        self._judge([point.inversion for point in points])
        self.misled = self.misled or best.unexplained
        self._keep("lcurve", [point.row for point in points])
        for table, rows in best.tables.items():
            self._keep(table, rows)
        self.say(Found(LCurve(points, best)))

    def _traded(self, every: Iterable[Trade]) -> Iterator[Trade]:
        for trade in every:
            yield trade
            self._keep("tradeoff", [trade.row])

    def _swept(self, every: Iterable[Inversion]) -> Iterator[Inversion]:
        for found in every:
            yield found
            self.say(Found(found))
            if found.interrupted:
                raise KeyboardInterrupt

    def _one_shot(self, problem: Problem) -> float | None:
        """J of the linear least-squares answer, where u is affine in p: what the loop has to reach, or to go below."""
        route = self.routes[0]
        if (
            not (problem.affine or problem.affine_at_rest)
            or route.route.objection(problem, **route.options) is not None
        ):
            return None
        prior = problem.regularization
        if prior is not None and prior.kind == "tv" and prior.alpha:
            self.say(Found("u is affine in p, but total variation is not quadratic: no one-shot answer"))
            return None
        try:
            found: OneShot = of_problem(problem, route, self.engine, self.at)
        except OUTSIDE as error:
            self.say(Found(f"no one-shot answer: {error}"))
            return None
        self.say(Found(found))
        return found.J

    def _keep(self, table: str, rows: Iterable[dict[str, object]]) -> None:
        for row in rows:
            self.say(Kept(table, row))

    def _judge(self, swept: Sequence[Inversion]) -> None:
        """Say once that the gradient is wrong, of a sweep whose ends are not shown one by one."""
        ends = [found.end for found in swept if found.misled]
        self.misled = bool(ends)
        for end in ends[:1]:
            self.say(Note(f"invert: {end}"))

    def _tell(self, problem: Problem) -> None:
        for text in problem.read_as:
            self.say(Note(f"{problem.name}: {text}"))

    def _warn(self, found: Inversion) -> None:
        if found.warning is not None:
            self.say(Note(f"invert: {found.warning}"))


def _check(
    iterations: int,
    tolerance: float,
    rate: float,
    draws: int | None,
    alpha_sweep: tuple[float, float, int] | None,
    minibatch: int | None,
    optimizer: str,
) -> None:
    """Raises InputError."""
    if iterations < 0 or not 0.0 <= tolerance < 1.0 or not 0.0 < rate < float("inf"):
        raise InputError(
            f"--iterations {iterations} --tolerance {tolerance:g} --rate {rate:g} - give iterations >= 0, a"
            " tolerance below 1 and a rate > 0"
        )
    if draws is not None and (draws < 2 or alpha_sweep is None):
        raise InputError(f"--draws {draws} - give at least 2, and --alpha-sweep")
    if alpha_sweep is not None and not (0.0 < alpha_sweep[0] < alpha_sweep[1] < float("inf") and alpha_sweep[2] >= 2):
        raise InputError(
            f"--alpha-sweep {alpha_sweep[0]:g} {alpha_sweep[1]:g} {alpha_sweep[2]} - give 0 < LEAST < MOST, COUNT >= 2"
        )
    if minibatch is not None and (optimizer != "adam" or minibatch < 1):
        raise InputError(
            f"--minibatch {minibatch} - give at least 1, and --optimizer adam: a line search needs all of J"
        )
