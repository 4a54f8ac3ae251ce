"""What unrolled differentiation takes to be right: its error and its tape against the number of iterations.

The gradient of the k-th iterate meets that of the solution, by implicit AD, once k is large enough; until then every
iteration adds to the tape. Checkpoints trade that for products.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

import numpy as np

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.case import ProblemSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.study import Found, Kept, Say
from gradient_routes.bench.execution.cost_model import price_of, unaffordable
from gradient_routes.bench.execution.timing import rounds
from gradient_routes.bench.studies.judged import TIGHT, Bench, said
from gradient_routes.bench.studies.options import one_problem
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Gradient, Options, Result, Route
from gradient_routes.routes.unrolled_ad import chosen

ROUNDING = 1e3 * float(np.finfo(np.float64).eps)  # relative error of a gradient that is as good as exact
FEWEST = 3  # points of a curve with checkpoints
MIN_TIME = 0.1  # [s] of gradients in the rounds that compare times


@dataclass(frozen=True)
class Iterate:
    """The gradient through `iterations` iterations in each of `newton` Newton steps."""

    checkpoint: int | None
    iterations: int
    newton: int | None
    status: str = "ok"
    reason: str | None = None
    objective: float | None = None
    objective_error: float | None = None
    gradient_error: float | None = None
    reference: str | None = None
    gradient_error_estimate: float | None = None
    residual: float | None = None
    tape_bytes: int | None = None
    products: int | None = None
    seconds: float | None = None

    @property
    def depth(self) -> int:
        """Iterations on the tape."""
        return self.iterations * (self.newton or 1)


@dataclass(frozen=True)
class Curve:
    """The line through the tapes of one `checkpoint`, and what its checkpoints cost at k = compared_at against none."""

    checkpoint: int | None
    points: int
    bytes_per_iteration: float | None
    fixed_bytes: float | None
    fit_residual: float | None
    compared_at: int | None = None
    tape_ratio: float | None = None
    products_ratio: float | None = None
    time_ratio: float | None = None


@dataclass(frozen=True)
class Unrolling:
    """The study. `meets` is the least k found whose error is at most `enough`, which implicit AD's own error sets."""

    problem: str
    problem_options: Options
    at: str
    n_state: int
    n_param: int
    inner: str
    implicit_error: float | None
    enough: float
    meets: int | None
    iterates: tuple[Iterate, ...] = field(repr=False)
    curves: tuple[Curve, ...] = field(repr=False)

    @property
    def tables(self) -> dict[str, list[Row]]:
        """Tidy rows: one an iterate, one a curve."""
        shared = {name: value for name, value in vars(self).items() if name not in ("iterates", "curves")}
        own = ("implicit_error", "enough", "meets")
        of_iterates = {name: value for name, value in shared.items() if name not in own}
        return {
            "unrolling": [of_iterates | asdict(iterate) for iterate in self.iterates],
            "unrolling_fits": [shared | asdict(curve) for curve in self.curves],
        }


def run(
    say: Say,
    *,
    selector: str,
    at: str,
    inner: str | None,
    checkpoint: int | None,
    max_iterations: int,
    within: float,
    budget: float,
    kept: Path | None = None,
) -> None:
    done = unrolling(one_problem(selector), at, inner, checkpoint, max_iterations, within, budget)
    for table, rows in done.tables.items():
        for row in rows:
            say(Kept(table, row))
    say(Found(done))


def unrolling(
    problem: ProblemSpec,
    at: str = "start",
    inner: str | None = None,
    checkpoint: int | None = None,
    max_iterations: int = 4096,
    within: float = 10.0,
    budget: float = 60.0,
) -> Unrolling:
    """k = 1, 2, 4, ... (Newton steps: 1, 2, 3, ...) until the gradient is within `within` times implicit AD's error.

    Errors below 1e3 eps are as good as none. The least such k is then found by bisection. Raises InputError,
    DomainError, and what implicit AD raises.
    """
    if max_iterations < 1 or not 1.0 <= within < np.inf:
        raise InputError(f"unrolling: at most {max_iterations} iterations, within x {within:g} - give at least 1")
    bench = Bench(problem, at, budget)
    with np.errstate(all="ignore"), redirect_stdout(sys.stderr):
        unrolled = Unrolled(bench, inner, checkpoint, budget)
        implicit_error = unrolled.implicit_error()
        enough = max(within * (implicit_error or 0.0), ROUNDING)
        plain = unrolled.until(enough, max_iterations)
        curves = [fit(plain)]
        thinned: list[Iterate] = []
        if checkpoint is not None:
            thinned = unrolled.thinned(checkpoint, max(point.iterations for point in plain))
            curves.append(unrolled.compared(fit(thinned), thinned))
    met = [point.iterations for point in plain if _met(point, enough)]
    return Unrolling(
        problem.name,
        problem.options,
        at,
        bench.problem.n_state,
        len(bench.p),
        unrolled.inner,
        implicit_error,
        enough,
        min(met, default=None),
        (*plain, *thinned),
        tuple(curves),
    )


def _met(point: Iterate, enough: float) -> bool:
    return point.gradient_error is not None and point.gradient_error <= enough


def fit(points: Sequence[Iterate]) -> Curve:
    """Least squares: tape = fixed + bytes_per_iteration * iterations, off by at most fit_residual of the largest."""
    known = [(point.depth, point.tape_bytes) for point in points if point.tape_bytes is not None]
    checkpoint = points[0].checkpoint
    if len(known) < 2:
        return Curve(checkpoint, len(known), None, None, None)
    depth, tape = np.array(known, dtype=np.float64).T
    each, fixed = np.polyfit(depth, tape, 1)
    off = np.abs(fixed + each * depth - tape).max() / tape.max()
    return Curve(checkpoint, len(known), float(each), float(fixed), float(off))


class Unrolled:
    """The route unrolled-ad on one problem, k after k."""

    def __init__(self, bench: Bench, inner: str | None, checkpoint: int | None, budget: float) -> None:
        self.bench, self.problem, self.p, self.budget = bench, bench.problem, bench.p, budget
        self.route: Route = registry.find("route", "unrolled-ad").load()
        self.inner = chosen(self.problem, inner)
        given = {"inner": self.inner, "iterations": 1, "newton": None, "checkpoint": checkpoint}
        self.route.check(**given)
        objection = self.route.objection(self.problem, **given)
        if objection is not None:
            raise InputError(f"unrolling: {objection}")
        self.model = Model(self.problem, Solver(newton="full"))  # for every k: JAX traces R and J once
        self.newton = None
        if self.inner != "direct" and not self.problem.linear:
            self.newton = self.model.solve(self.p).work.newton_iterations

    def implicit_error(self) -> float | None:
        implicit: Route = registry.find("route", "implicit-ad").load()
        result = implicit.prepare(Model(self.problem, TIGHT), self.p)(self.p)
        error: float | None = self.bench.errors(implicit, result)["gradient_error"]
        return error

    def until(self, enough: float, max_iterations: int) -> list[Iterate]:
        """Iterates by k, up to the least that is good enough, as far as can be afforded."""
        points = [self.iterate(1)]
        while points[-1].status == "ok" and not _met(points[-1], enough) and points[-1].iterations < max_iterations:
            k = points[-1].iterations
            points.append(self.iterate(min(k + 1 if self.inner == "direct" else 2 * k, max_iterations)))
        if len(points) > 1 and _met(points[-1], enough):
            points += self._between(points[-2].iterations, points[-1].iterations, enough)
        return sorted(points, key=lambda point: point.iterations)

    def _between(self, short: int, long: int, enough: float) -> list[Iterate]:
        """Bisection: the last k that is too few, the first that is enough."""
        points = []
        while long - short > 1:
            points.append(self.iterate((short + long) // 2))
            if _met(points[-1], enough):
                long = points[-1].iterations
            else:
                short = points[-1].iterations
        return points

    def thinned(self, checkpoint: int, longest: int) -> list[Iterate]:
        """The curve with checkpoints, at multiples of their distance."""
        doublings = max(FEWEST, int(np.log2(max(longest / checkpoint, 1.0))) + 1)
        return [self.iterate(checkpoint * 2**j, checkpoint) for j in range(doublings)]

    def compared(self, curve: Curve, points: Sequence[Iterate]) -> Curve:
        """The longest of `points` beside the same without checkpoints, timed in the same rounds."""
        done = [point for point in points if point.status == "ok"]
        if not done:
            return curve
        few = done[-1]
        every = self.iterate(few.iterations)
        if every.status != "ok" or not (every.products and few.products and every.tape_bytes and few.tape_bytes):
            return curve
        gradients = [self._prepare(few.iterations, c) for c in (curve.checkpoint, None)]
        for gradient in gradients:
            gradient(self.p)
        ratio = rounds(lambda: gradients[0](self.p), lambda: gradients[1](self.p), MIN_TIME).ratio
        return replace(
            curve,
            compared_at=few.iterations,
            tape_ratio=few.tape_bytes / every.tape_bytes,
            products_ratio=few.products / every.products,
            time_ratio=ratio,
        )

    def iterate(self, k: int, checkpoint: int | None = None) -> Iterate:
        """Measured, skipped with its bill or failed with its reason."""
        options = self._options(k, checkpoint)
        reason = self._unaffordable(options)
        if reason is not None:
            return Iterate(checkpoint, k, self.newton, "skipped", reason)
        try:
            gradient, before = self._prepare(k, checkpoint), self.model.tally.work
            result, products = gradient(self.p), (self.model.tally.work - before).matvecs
            price, _ = price_of(lambda: gradient(self.p))
            errors = self.bench.errors(self.route, result)
        except Exception as failure:
            return Iterate(checkpoint, k, self.newton, "failed", said(failure))
        measured = Iterate(checkpoint, k, self.newton, tape_bytes=result.tape, products=products, seconds=price.wall)
        return replace(measured, residual=result.residual, **errors)

    def _options(self, k: int, checkpoint: int | None) -> Options:
        return {"inner": self.inner, "iterations": k, "newton": self.newton, "checkpoint": checkpoint}

    def _prepare(self, k: int, checkpoint: int | None) -> Gradient:
        function = self.route.function(self.model, self.p, **self._options(k, checkpoint))
        return lambda q: Result(*function(q))

    def _unaffordable(self, options: Options) -> str | None:
        own = self.bench.prices
        work = self.route.cost(len(self.p), own.declared, **options)
        tape = None if self.route.tape is None else self.route.tape(self.problem, **options)
        return unaffordable(own, tape, work, self.budget)
