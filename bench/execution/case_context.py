"""One problem at one p, with what the routes run on it share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, point
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.outcome import Sensitivities, View
from gradient_routes.bench.cases.partial import Partial
from gradient_routes.bench.cases.samples import Elapsed
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.cost_model import Prices, prices, unaffordable
from gradient_routes.bench.execution.references import Judge, Judges, KnownJudges
from gradient_routes.bench.execution.sensitivities import check_columns, sensitivities, with_columns
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Fields, Offers, ParameterView, Problem
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver, State
from gradient_routes.routes.route import Options, Result, Route
from gradient_routes.routes.tally import Work


@dataclass(frozen=True)
class Prediction:
    """What a route will cost: wall time, bytes of tape, work, the forward solve it is priced by; and why it exceeds the
    budget, None where it does not.
    """

    seconds: float
    tape: float | None
    work: Work
    price: Elapsed
    objection: str | None

    @property
    def columns(self) -> Row:
        return {
            "predicted_s": self.seconds,
            "price_s": self.price.wall,
            "price_cpu_s": self.price.cpu,
            "predicted_tape_bytes": self.tape,
            "predicted_work": asdict(self.work),
        }


class CaseContext:
    """A problem at one p, with what all its routes share: prices and references.

    `found` are references known from before. Raises InputError and DomainError, and what the problem raises.
    """

    def __init__(self, spec: ProblemSpec, settings: Settings, found: KnownJudges | None = None) -> None:
        self.spec, self.settings = spec, settings
        self.problem: Problem
        self.build_s, self.problem = seconds_of(spec)
        self.p = point(self.problem, settings.at)
        self.n_p = len(self.p)
        if settings.fields and Offers.FIELDS not in self.problem.offers:
            raise InputError(f"{self.problem.name}: has no mesh to write fields on - drop --vtu")
        if settings.columns is not None:
            check_columns(settings.columns, self.problem.name, self.n_p)
        self.partial = self._restrict(settings.partial)
        self.p.flags.writeable = False  # shared by all routes
        # references are independent of the solver that is examined
        direct = replace(settings.solver, linear_solver=Solver.linear_solver, newton="full")
        self.judges = Judges(Model(self.problem, direct), self.p, self._unaffordable_reference, found)
        self._forward_model = self.model()
        self.factor_bytes: int | None = None  # behind the forward solve, once priced
        self._priced: tuple[Prices, State | None] | Exception | None = None

    def _restrict(self, partial: Partial | None) -> str | None:
        """From here on the problem is the one in the few parameters asked for; what they are, None for all."""
        few = None if partial is None else partial.restrict(self.problem, self.p)
        if partial is None or few is None:
            return None
        self.problem, self.p = few, few.parameters.start.copy()
        return partial.of(self.n_p)

    def model(self) -> Model:
        return Model(self.problem, self.settings.solver)

    def predict(self, n_p: int, route: Route, options: Options) -> Prediction:
        work = route.cost(n_p, self.prices.declared, **options)
        tape = None if route.tape is None else route.tape(self.problem, **options)
        objection = unaffordable(self.prices, tape, work, self.settings.budget)
        return Prediction(self.prices.seconds(work), tape, work, self.prices.forward, objection)

    def _unaffordable_reference(self, route: Route, n_p: int) -> str | None:
        return self.predict(n_p, route, route.defaults).objection

    def price(self) -> tuple[Prices, State | None]:
        """Prices and the state they were measured on; a forward solve that fails is not tried again."""
        if self._priced is None:
            try:
                self._priced = prices(self._forward_model, self.p)
                state = self._priced[1]  # a transposed solve may add factors of R_u^T later
                self.factor_bytes = None if state is None else int(state.factors.nbytes)
            except Exception as failure:  # raised again, for every route
                self._priced = failure
        if isinstance(self._priced, Exception):
            raise self._priced
        return self._priced

    @property
    def prices(self) -> Prices:
        return self.price()[0]

    def objective(self) -> float:
        """J(p) of the forward solve that set the prices."""
        state = self.price()[1]
        return self.model().value(self.p) if state is None else float(state.J)

    def forward(self) -> Callable[[], Any]:
        model = self._forward_model  # has analyzed its matrices, as the route's own has by now
        solvable = Offers.SOLVE in self.problem.offers
        return (lambda: model.solve(self.p)) if solvable else (lambda: model.value(self.p))

    def view(self, route: Route, result: Result) -> View | None:
        if not self.settings.gradient:
            return None
        u = self._state_of(result)
        columns = ParameterView() if u is None else self.problem.view(self.p, u, result.lam)
        judge = self.judges.judge(route)
        reference = judge.whole if isinstance(judge, Judge) else None
        q = self.problem.parameters
        labels, units = zip(*((q.label(i), q.unit_of(i)) for i in range(len(q))), strict=True)
        return View([*labels], [*units], q.position, self.p, np.asarray(result.gradient), reference, columns)

    def fields(self, result: Result) -> Fields | None:
        u = self._state_of(result)
        if u is None or not self.settings.fields:
            return None
        gradient, columns = np.asarray(result.gradient), self.settings.columns
        fields = self.problem.fields(self.p, u, result.lam, gradient)
        if fields is None or columns is None or not columns.on_mesh:
            return fields
        return with_columns(fields, self.problem, self.price()[1], self._forward_model, columns)

    def sensitivities(self) -> Sensitivities | None:
        """The columns asked for; None for a black box."""
        state, columns = self.price()[1], self.settings.columns
        if state is None or columns is None or not columns.table:
            return None
        return sensitivities(self._forward_model, state, columns)

    def _state_of(self, result: Result) -> Array | None:
        """u of the route, or of the forward solve that set the prices; None for a black box."""
        state = self.price()[1]
        return result.u if result.u is not None or state is None else state.u
