"""One call of `routes invert`: what it runs, shows and keeps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from gradient_routes.bench.command_options import complain
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from rich.console import Console

    from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
    from gradient_routes.bench.cases.row import Row
    from gradient_routes.bench.inversion.history import Iterate
    from gradient_routes.bench.inversion.invert import Engine, Inversion
    from gradient_routes.problems.problem import Array, Problem

Tables = dict[str, list["Row"]]
Found = TypeVar("Found")


class Run:
    """One call of the verb: what it shows and what it keeps.

    What ends it early, `interrupted` or a `failure`, ends none of what it has found by then.
    """

    def __init__(
        self, spec: ProblemSpec, routes: Sequence[RouteSpec], engine: Engine, at: str, quiet: bool, plots: bool
    ) -> None:
        from gradient_routes.bench.render.terminal.tables import console

        self.spec, self.routes, self.engine, self.at = spec, routes, engine, at
        self.quiet, self.plots, self.started, self.interrupted = quiet, plots, now(), False
        self.failure: BaseException | None = None
        self.one_shot: float | None = None
        self.out: Console = console(stderr=quiet)

    def each(self, resumed: Path | None, minibatch: int | None, seed: int) -> Tables:
        """Route by route, from where each ended in the store `resumed` if given; then what each has paid."""
        from gradient_routes.bench.inversion.resumed import last_estimate

        problem = self.spec()
        starts: list[tuple[Array | None, int]] = [(None, 0)] * len(self.routes)
        if resumed is not None:  # what is not there is refused before anything runs
            starts = [last_estimate(resumed, self.spec, r, self.engine.optimizer, self.at) for r in self.routes]
        self._baseline(problem)
        done = self._until_it_ends(self._inversions(problem, starts, minibatch, seed))
        if not self.quiet:
            self._show(done)
        return {name: [row for found in done for row in found.tables[name]] for name in ("inversion", "estimates")}

    def _inversions(
        self, problem: Problem, starts: Sequence[tuple[Array | None, int]], minibatch: int | None, seed: int
    ) -> Iterator[Inversion]:
        from gradient_routes.bench.inversion.invert import invert
        from gradient_routes.bench.inversion.minibatch import minibatched
        from gradient_routes.bench.inversion.variables import Variables
        from gradient_routes.bench.studies.invert import view

        for route, (p, offset) in zip(self.routes, starts, strict=True):
            run = None if minibatch is None else minibatched(problem, route, self.engine, minibatch, seed)
            Variables.of(problem.parameters, problem.parameters.start, self.engine.positive, problem.name)
            self._title(route, problem.truth() is not None)
            found = invert(self.spec, route, self.engine, self.at, p, self._line, problem, run, offset)
            self.interrupted = found.interrupted
            yield found
            self._say(lambda found=found: view.ended(self.out, found, self.one_shot))
            self._warn(found)
            if found.interrupted:
                return

    def _until_it_ends(self, each: Iterable[Found]) -> list[Found]:
        """All of them, or those before an interrupt or a failure, which the verb ends with. Raises either where it has
        none.
        """
        from gradient_routes.bench.cases.status import FOREIGN

        done: list[Found] = []
        try:
            for found in each:
                done.append(found)  # not all at once: what has come stays
        except KeyboardInterrupt:
            self.interrupted = True
            if not done:
                raise
        except FOREIGN as failure:
            self.failure = failure
            if not done:
                raise
        return done

    def sweep(self, given: tuple[float, float, int], draws: int | None) -> Tables:
        """Over alpha, for one route."""
        import numpy as np

        from gradient_routes.bench.inversion.lcurve import l_curve, minima
        from gradient_routes.bench.inversion.tradeoff import trade_off
        from gradient_routes.bench.studies.invert import lcurve_view as view

        if len(self.routes) != 1:
            raise InputError(f"--alpha-sweep with {len(self.routes)} routes - name one, the answers are the same")
        alphas, (route,) = list(dict.fromkeys(float(f"{a:.6g}") for a in np.geomspace(*given))), self.routes
        if len(alphas) < given[2]:
            raise InputError(
                f"--alpha-sweep {given[0]:.10g} {given[1]:.10g}: are the same to six digits - go further apart"
            )
        if draws is not None:
            trades = self._until_it_ends(trade_off(self.spec, route, self.engine, alphas, draws, self.at))
            if not self.quiet:
                if self.plots:
                    self.out.print(view.trade_plot(trades, min(self.out.width, 100)))
                self.out.print(view.trades(trades))
            return {"tradeoff": [trade.row for trade in trades]}
        points = l_curve(self._until_it_ends(self._swept(minima(self.spec, route, self.engine, alphas, self.at))))
        best = next((point for point in points if point.chosen), points[-1]).inversion
        self._warn(best)
        if not self.quiet:
            if self.plots:
                self.out.print(view.curve(points, min(self.out.width, 100)))
            self.out.print(view.table(points))
            for line in view.remarks(points):
                self.out.print(line, soft_wrap=True)
            self._show([best], costs=False)
        return {"lcurve": [point.row for point in points], **best.tables}

    def _baseline(self, problem: Problem) -> None:
        """The one-shot answer, where there is one: what the loop has to beat."""
        from gradient_routes.bench.inversion.one_shot import of_problem

        route = self.routes[0]
        if self.quiet or not problem.affine or route.route.objection(problem, **route.options) is not None:
            return
        prior = problem.regularization
        if prior is not None and prior.kind == "tv" and prior.alpha:
            self._say(
                lambda: self.out.print("u is affine in p, but total variation is not quadratic: no one-shot answer")
            )
            return
        found = of_problem(problem, route, self.engine, self.at)
        self.one_shot = found.J
        self._say(
            lambda: self.out.print(
                f"u is affine in p: one linear least-squares solve gives J = {found.J:.6g}, for {found.forward_solves}"
                f" forward solves and {found.products} products with H; the loop has to beat that",
                soft_wrap=True,
            )
        )

    def _title(self, route: RouteSpec, truth: bool) -> None:
        from gradient_routes.bench.studies.invert import view

        def title() -> None:
            self.out.print(
                f"{self.spec.selector} by {route.name}, {self.engine.optimizer}", style="bold", soft_wrap=True
            )
            view.heading(self.out, truth)

        self._say(title)

    def _line(self, step: Iterate) -> None:
        from gradient_routes.bench.studies.invert import view

        self._say(lambda: view.line(self.out, step))

    def _swept(self, every: Iterable[Inversion]) -> Iterator[Inversion]:
        for found in every:
            self.interrupted = found.interrupted
            yield found
            last = found.iterates[-1]
            paid = f"{last.iteration} iterations, {last.seconds:.3g} s"
            said = f"alpha = {found.alpha:.3g}: misfit {last.misfit:.4g} after {paid}"
            if self.out.is_terminal:
                self._say(lambda said=said: self.out.print(said, style="dim"))

    def _say(self, show: Any) -> None:
        if not self.quiet:
            show()

    def _show(self, done: Sequence[Inversion], costs: bool = True) -> None:
        from gradient_routes.bench.studies.invert import view

        self.out.print()
        if self.plots and costs:
            self.out.print(view.history(done, min(self.out.width, 100)))
        if costs:
            self.out.print(view.costs(done))
            self.out.print(view.LEGEND, style="dim", soft_wrap=True)
        self.out.print()
        self.out.print(view.estimates(done[-1]))
        picture = view.cells(done[-1])
        if picture:
            self.out.print(picture)

    @staticmethod
    def _warn(found: Inversion) -> None:
        if found.warning is not None:
            complain(f"invert: {found.warning}")
