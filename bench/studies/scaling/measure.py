"""How the bill of a route grows - time, memory and work - against unknowns, parameters and iterations; how far it gets.

Every case is a row as `routes run` has it; this fits them (`power_law`) and lets routes race for the number of
parameters from which the adjoint is cheaper (`break_even`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.row import measured
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.isolation.signals import Interrupt
from gradient_routes.bench.execution.sweep import run
from gradient_routes.bench.studies.scaling.break_even import Racing, break_even
from gradient_routes.bench.studies.scaling.checkpoints import RESOLUTION, checkpoints, recomputed
from gradient_routes.bench.studies.scaling.climbing import Climb, Measure, Series
from gradient_routes.bench.studies.scaling.power_law import FEWEST, Fit, fit
from gradient_routes.bench.studies.scaling.sizes import Sizes

WORK = ("forward_solves", "factorizations", "substitutions", "products", "recomputed")
QUANTITIES = ("seconds", "peak_bytes", "tape_bytes", "factor_bytes", "iterations", *WORK)
COUNTED = ("tape_bytes", "factor_bytes", "iterations", *WORK)  # whole numbers without noise


@dataclass(frozen=True)
class Growth:
    """One quantity of one route over one abscissa. Fields are columns of its table."""

    problem: str
    problem_options: dict[str, object]
    at: str
    route: str
    route_options: dict[str, object]
    quantity: str
    against: str
    fit: Fit = field(repr=False)
    least: float | None
    most: float | None
    largest: int | None
    stopped_by: str

    @property
    def row(self) -> Row:
        own = {name: value for name, value in vars(self).items() if name != "fit"}
        return own | asdict(self.fit)


@dataclass(frozen=True)
class Scaling:
    """The study: its cases in the order they were measured, what grows how, and who is cheaper where."""

    sizes: Sizes
    rows: tuple[Row, ...] = field(repr=False)
    series: tuple[Series, ...] = field(repr=False)
    growths: tuple[Growth, ...] = field(repr=False)
    checkpoints: tuple[Row, ...] = field(repr=False)
    break_evens: tuple[Row, ...] = field(repr=False)
    no_break_even: str | None = None
    interrupted: bool = False

    @property
    def tables(self) -> dict[str, list[Row]]:
        """Those of the study alone: cases have theirs."""
        fits = [g.row for g in self.growths]
        return {"scaling_fits": fits, "break_even": [*self.break_evens], "checkpoints": [*self.checkpoints]}


def scaling(
    sizes: Sizes,
    routes: Sequence[RouteSpec],
    settings: Settings,
    taken: Callable[[Outcome], None] = lambda outcome: None,
    measure: Measure = run,
    race: Racing = break_even,
) -> Scaling:
    """Climb, race, fit; `taken` gets each case as it is known; `measure` and `race` run them.

    Ctrl-C ends the study, not what it has measured. Raises InputError and DomainError for what cannot be at all.
    """
    climb = Climb(sizes, routes, settings, measure)
    rows: list[Row] = []
    races: list[Row] = []
    reason, interrupted = None, False
    try:
        for outcome in climb.run():
            with Interrupt() as interrupt:  # a row that is finished is kept whole
                rows.append(outcome.row)
                taken(outcome)
            interrupt.heard()
        races, reason = race(sizes, climb.series, settings)
    except KeyboardInterrupt:
        if not rows:
            raise
        climb.interrupt()
        interrupted = True
    growths = tuple(growths_of(sizes, climb.series, settings.at))
    kept = tuple(checkpoints(rows))
    return Scaling(sizes, tuple(rows), tuple(climb.series), growths, kept, tuple(races), reason, interrupted)


def growths_of(sizes: Sizes, every: Sequence[Series], at: str) -> Iterator[Growth]:
    """Over sizes route by route, then over iterations where a grid of them was asked for."""
    if len(sizes.specs) > 1:
        for series in every:
            for against in abscissas(sizes, series.rows):
                yield from _over(sizes, series, at, against, series.rows)
    for series in iterated(every):
        yield from _over(sizes, series, at, "iterations", series.rows)


def abscissas(sizes: Sizes, rows: Sequence[Row]) -> tuple[str, ...]:
    """T where only steps vary; n_u and n_p where both grow and neither is a multiple of the other; else the one that
    grows.
    """
    if sizes.in_time:
        return ("steps",)
    n_u, n_p = ([row[name] for row in rows] for name in ("n_state", "n_param"))
    if len(set(n_u)) < 2:
        return ("n_param",) if len(set(n_p)) > 1 else ("n_state",)
    proportional = all(a * n_p[0] == b * n_u[0] for a, b in zip(n_u, n_p, strict=True))
    return ("n_state",) if proportional or len(set(n_p)) < 2 else ("n_state", "n_param")


def iterated(every: Sequence[Series]) -> Iterator[Series]:
    """Of routes asked for with several numbers of iterations: those at the largest problem where FEWEST of them ran."""
    groups: dict[str, list[Series]] = {}
    for series in every:
        given = series.route.options
        if given.get("iterations") is not None:
            others = {name: value for name, value in given.items() if name != "iterations"}
            groups.setdefault(f"{series.route.name} {others}", []).append(series)
    for group in groups.values():
        if len(group) > 1:
            yield _at_one_size(group)


def _at_one_size(group: Sequence[Series]) -> Series:
    first = group[0].route
    merged = Series(RouteSpec(first.name, first.route, first.options | {"iterations": None}))
    ran: dict[str, list[tuple[ProblemSpec, Row]]] = {}
    for series in group:
        for spec, row in series.cases:
            if measured(row):
                ran.setdefault(repr(spec.options), []).append((spec, row))
    enough = [cases for cases in ran.values() if len(cases) >= FEWEST] or sorted(ran.values(), key=len)
    merged.cases = sorted(enough[-1], key=lambda case: int(abscissa(case[1], "iterations") or 0)) if enough else []
    stopped = next((series for series in group if series.stopped is not None), None)
    if stopped is not None:
        merged.stop(str(stopped.stopped), stopped.reason)
    return merged


def _over(sizes: Sizes, series: Series, at: str, against: str, rows: Sequence[Row]) -> Iterator[Growth]:
    first = sizes.specs[0]
    family = rows[0]["problem_options"] if against == "iterations" and rows else sizes.family
    largest = max((int(abscissa(row, against) or 0) for row in rows), default=None)
    for quantity in QUANTITIES:
        known = _known(rows, against, quantity)
        y = [value for _, value in known]
        if quantity == against or (quantity != "seconds" and not any(y)):
            continue
        found = fit([x for x, _ in known], y, quantity in COUNTED)
        route = series.route
        names = (first.name, family, at, route.name, route.options, quantity, against)
        yield Growth(*names, found, min(y, default=None), max(y, default=None), largest, series.stopped_by)


def _known(rows: Iterable[Row], against: str, quantity: str) -> list[tuple[float, float]]:
    pairs = ((abscissa(row, against), value(row, quantity)) for row in rows)
    return [(x, y) for x, y in pairs if x is not None and y is not None]


def abscissa(row: Row, name: str) -> float | None:
    """n_u, n_p, T or the iterations of a row, those of all Newton steps together."""
    if name == "steps":
        return int(row["problem_options"][name])
    if name != "iterations":
        return None if row[name] is None else int(row[name])
    k = row["route_options"].get("iterations")
    return None if k is None else int(k) * int(row["route_options"].get("newton") or 1)


def value(row: Row, quantity: str) -> float | None:
    """What a row says about a quantity; None where it says nothing, or less than can be resolved."""
    if quantity == "recomputed":
        return recomputed(row)
    if quantity in WORK:
        return None if row["work"] is None else _counted(row["work"], quantity)
    if quantity == "iterations":
        return abscissa(row, quantity)
    known: float | None = row[quantity]
    return None if quantity == "peak_bytes" and (known or 0) < RESOLUTION else known


def _counted(work: dict[str, int], quantity: str) -> int:
    if quantity == "substitutions":
        return work["solves"] + work["transposed_solves"]
    return work["matvecs"] if quantity == "products" else work[quantity]
