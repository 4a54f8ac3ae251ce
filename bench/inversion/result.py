"""What an inversion ends with, and the rows of its tables."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.inversion import fit_rows
from gradient_routes.bench.inversion.columns import RUN
from gradient_routes.bench.inversion.diagnosis import MISLED
from gradient_routes.bench.inversion.fit import Fit
from gradient_routes.bench.inversion.history import Iterate
from gradient_routes.bench.inversion.linear_regime import LinearRegime
from gradient_routes.problems.problem import Array, ParameterView, Problem
from gradient_routes.routes.route import Options

SHARED = tuple(column.name for column in RUN)


@dataclass(frozen=True)
class Stop:
    """How the optimizer itself stopped, before differences of J were asked.

    says           its reason
    evaluations    of J and its gradient
    shortest_step  |x - x_k| of the shortest step tried in vain after the last one, x being p in natural changes
    """

    says: str
    evaluations: int
    shortest_step: float | None


@dataclass(frozen=True)
class Inversion:
    """The result: fields are columns of its table, and the arrays behind them.

    p, gradient (n_p,) at the end; start p_0; truth where known; view: the problem's own columns
    end      why it stopped; stop: why the optimizer itself did; interrupted: by Ctrl-C
    ending_solves  forward solves after the last step, to explain or to confirm the end
    scaled   the units of the optimizer's variables; warning: what is wrong with them
    fit      residuals and error bars, where data were measured
    regime   what the problem linearized at u = 0 reads there, where noise is known and R nonlinear in u
    """

    problem: str
    problem_options: Options
    at: str
    n_state: int
    n_param: int
    route: str
    route_options: Options
    optimizer: str
    alpha: float
    label: str
    iterates: tuple[Iterate, ...] = field(repr=False)
    made: Problem = field(repr=False)
    start: Array = field(repr=False)
    p: Array = field(repr=False)
    gradient: Array = field(repr=False)
    truth: Array | None = field(repr=False)
    view: ParameterView = field(repr=False)
    end: str = field(repr=False)
    stop: Stop = field(repr=False)
    ending_solves: int = field(repr=False)
    interrupted: bool = field(repr=False)
    warning: str | None = field(repr=False)
    scaled: str = field(repr=False)
    fit: Fit | None = field(default=None, repr=False)
    regime: LinearRegime | None = field(default=None, repr=False)

    def _repr_html_(self) -> str:
        """In a notebook."""
        from gradient_routes.bench.inversion import page

        return page.fragment(self)

    @property
    def misled(self) -> bool:
        """Whether the gradient has turned out not to be that of J."""
        return self.end.startswith(MISLED)

    @property
    def unexplained(self) -> bool:
        """Whether residuals exceed their noise, or the data themselves, or steps in time move the answer."""
        return self.fit is not None and bool(self.fit.verdict)

    @property
    def linear_regime(self) -> str | None:
        return None if self.regime is None else self.regime.described("the problem linearized at u = 0")

    @property
    def forward_solves(self) -> int:
        """All of them."""
        return self.iterates[-1].forward_solves + self.ending_solves

    @property
    def shared(self) -> Row:
        return {name: getattr(self, name) for name in SHARED}

    @property
    def tables(self) -> dict[str, list[Row]]:
        """Tidy: one row an iterate, one a parameter; where data were measured one of the fit, and one a datum."""
        last = len(self.iterates) - 1
        rows = [self.shared | asdict(iterate) | {"ending_solves": None} for iterate in self.iterates]
        rows[last]["ending_solves"] = self.ending_solves
        doubt = self.fit.doubts.replace("\n", "; ") if self.fit is not None and self.unexplained else None
        says = (rows[last]["says"], self.end, self.linear_regime, doubt, *self.view.remarks)
        rows[last]["says"] = "; ".join(filter(None, says))
        found = {"inversion": rows, "estimates": [self.shared | self._estimate(i) for i in range(self.n_param)]}
        if self.fit is None:
            return found
        each = [self.shared | row for row in fit_rows.of_each(self.fit)]
        said = [self.shared | row for row in fit_rows.of_constants(self.fit)]
        return found | {"constants": said, "fit": [self.shared | fit_rows.of_all(self.fit)], "residuals": each}

    def _estimate(self, i: int) -> Row:
        q = self.made.parameters
        x: list[Any] = [None, None, None] if q.position is None else [*q.position[i].tolist(), None, None][:3]
        return {
            "parameter": q.label(i),
            **dict(zip("xyz", x, strict=True)),
            "start": self.start[i],
            "estimate": self.p[i],
            "sd": None if self.fit is None or np.isnan(self.fit.sd[i]) else self.fit.sd[i],
            "truth": None if self.truth is None else self.truth[i],
            "gradient": self.gradient[i],
            "blind": None if self.view.blind is None else int(self.view.blind[i]),
            "view": {name: float(column[i]) for name, column in self.view.columns.items()},
        }
