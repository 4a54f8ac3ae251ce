"""A case: one problem with its options, one route with its options, one point p."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases import declared, options, registry, selector
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.imported import is_reference
from gradient_routes.bench.cases.point_file import read_point
from gradient_routes.bench.cases.point_values import are_values, shown, values_of
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Parameters, Problem
from gradient_routes.routes.measured_start import with_measured_start
from gradient_routes.routes.route import Route
from gradient_routes.routes.synthetic_data import with_synthetic_data

NOTHING: declared.Told = {}
MOST = 100_000  # cases of one command, unless its user allows more


@dataclass(frozen=True)
class ProblemSpec:
    """A problem still to be built, its synthetic data, if it wants any, solved for, its start fitted to measured ones.

    `build` is its factory, or Declared where it is built in other processes only: they find its code by its name.
    """

    name: str
    options: dict[str, Any]
    build: Any

    @property
    def selector(self) -> str:
        """Its name with the options that are not its defaults."""
        return _written(self.name, self.options, self.build)

    def __reduce__(self) -> tuple[Any, ...]:
        return problem_named, (self.name, self.options)  # code is found by its name wherever it is sent

    def __call__(self) -> Problem:
        problem = self.build(**self.options)
        if not isinstance(problem, Problem) or not isinstance(problem.parameters, Parameters):
            raise TypeError(f"its factory made a {type(problem).__name__}, not a Problem with Parameters")
        return with_measured_start(with_synthetic_data(problem))


@dataclass(frozen=True)
class RouteSpec:
    """A route with its options as given; data-dependent defaults are still open (None).

    `route` is Declared where it runs in other processes only.
    """

    name: str
    route: Route
    options: dict[str, Any]

    @property
    def selector(self) -> str:
        """Its name with the options that are not its defaults."""
        return _written(self.name, self.options, self.route)

    def __reduce__(self) -> tuple[Any, ...]:
        return route_named, (self.name, self.options)


@dataclass(frozen=True)
class Case:
    """A problem and a route, run with these settings; `asked` are the columns of its row that are known before."""

    problem: ProblemSpec
    route: RouteSpec
    settings: Settings
    asked: Row


def _written(name: str, given: dict[str, Any], target: Any) -> str:
    return selector.written(name, given, declared.declared_by(target).defaults)


def selector_of(kind: registry.Kind, name: str, given: dict[str, Any] | None, kept: Any = None) -> str:
    """The selector of a stored problem or route without its defaults; with all options where they are not known.

    `kept` is what its row holds of what it declares: code that a row names is not run to show it.
    """
    if is_reference(name):
        known = None if kept else declared.known(kind, name)
        return selector.written(name, given or {}, known.defaults if known else declared.defaults_of(kept))
    try:
        return _written(name, given or {}, registry.find(kind, name).load())
    except InputError:
        return selector.written(name, given or {}, {})


def problem_named(name: str, options: dict[str, Any]) -> ProblemSpec:
    """Raises InputError for a name that is not known here."""
    return ProblemSpec(name, options, _target("problem", name))


def route_named(name: str, options: dict[str, Any]) -> RouteSpec:
    """Raises InputError for a name that is not known here."""
    return RouteSpec(name, _target("route", name), options)


def _target(kind: registry.Kind, name: str, told: declared.Told = NOTHING) -> Any:
    """What the user named, or what `told` describes in its place; what its code declares is known from then on."""
    target = told.get((kind, name)) or registry.find(kind, name).load()
    if is_reference(name):
        declared.remember(kind, name, declared.declared_by(target))
    return target


def problems(selectors: Iterable[str], told: declared.Told = NOTHING, most: float = MOST) -> list[ProblemSpec]:
    """All problems that the selectors name, grids expanded; the code of those that `told` describes is not imported.

    Raises InputError, for more than `most`, too, and RoutesError where code of the user's own fails.
    """
    return [ProblemSpec(name, opts, target) for name, opts, target in _specs("problem", selectors, told, most)]


def routes(selectors: Iterable[str], told: declared.Told = NOTHING, most: float = MOST) -> list[RouteSpec]:
    """All routes that the selectors name, as `problems` does."""
    specs = []
    for name, opts, target in _specs("route", selectors, told, most):
        if ("route", name) not in told:  # where it was described options have been checked
            target.check(**opts)
        specs.append(RouteSpec(name, target, opts))
    return specs


def check_count(count: int, what: str, most: float = MOST) -> None:
    """Raise InputError for more than `most`."""
    if count > most:
        raise InputError(f"{count} {what} - name at most {MOST}, or lift that limit with `routes run --yes`")


def left_out(problem_selectors: Iterable[str], route_selectors: Iterable[str]) -> list[str]:
    """Why entries that `all` would name are not among them."""
    kinds: dict[registry.Kind, Iterable[str]] = {"problem": problem_selectors, "route": route_selectors}
    entries = [entry for kind, texts in kinds.items() if "all" in texts for entry in registry.entries(kind).values()]
    return [failure for entry in entries if (failure := entry.failure) is not None]


def _specs(
    kind: registry.Kind, selectors: Iterable[str], told: declared.Told, most: float
) -> Iterator[tuple[str, dict[str, Any], Any]]:
    grids = [grid for text in selectors for grid in _grids(kind, text)]
    check_count(sum(grid.size for grid in grids), f"{kind}s", most)  # before a grid fills the memory
    seen: set[str] = set()
    for grid in grids:
        target = _target(kind, grid.name, told)
        for resolved in options.resolve(registry.factory_of(target), grid.grid, grid.name):
            key = repr((grid.name, resolved))  # defaults need not be hashable
            if key not in seen:
                seen.add(key)
                yield grid.name, resolved, target


def _grids(kind: registry.Kind, text: str) -> list[selector.Selector]:
    """What a selector names, `all` written out."""
    chosen = selector.parse(text)
    if chosen.name != "all":
        return [chosen]
    if chosen.grid:
        raise InputError(f"selector '{text}' - 'all' takes no options; name the {kind} to set one")
    return [selector.Selector(name, {}) for name, entry in registry.entries(kind).items() if entry.sound]


def point(problem: Problem, at: str) -> Array:
    """p (n_p,) for `start`, `true`, values or a CSV file, see `read_point`. Raises InputError, DomainError."""
    if at == "start":
        return problem.parameters.check(problem.parameters.start.copy(), f"{problem.name}, start")
    if at == "true":
        truth = problem.truth()
        if truth is None:
            raise InputError(f"{problem.name}: the true parameters are not known - use --at start, values or FILE.csv")
        return problem.parameters.check(truth, f"{problem.name}, true")
    if are_values(at):
        return problem.parameters.check(values_of(problem.parameters, at), f"--at {shown(at)}")
    return problem.parameters.check(read_point(problem, at), at)


def sized(spec: ProblemSpec, at: str) -> tuple[int, int]:
    """n_u and n_p of a problem, built without its synthetic data. Raises as its factory and `point` do."""
    problem = spec.build(**spec.options)
    return problem.n_state, len(point(problem, "start" if at == "true" else at))


def files(options: Iterable[dict[str, Any]], at: str) -> list[Path]:
    """The files that problems with these options and `at` read."""
    texts = [at, *(value for given in options for value in given.values() if isinstance(value, str))]
    return [Path(text) for text in texts if os.path.isfile(located(text))]
