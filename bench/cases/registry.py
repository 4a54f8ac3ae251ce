"""What exists: problems, routes and studies, built-in and from plug-ins, all by entry points, loaded when asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.metadata import Distribution, EntryPoint
from typing import Any, Literal

from gradient_routes.bench.cases.column import Table
from gradient_routes.bench.cases.imported import imported, is_reference
from gradient_routes.bench.cases.study import Study
from gradient_routes.bench.cases.suggest import did_you_mean
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.entry_points import group, is_built_in

Kind = Literal["problem", "route", "study"]
GROUPS = {"problem": "gradient_routes.problems", "route": "gradient_routes.routes", "study": "gradient_routes.studies"}
BUILT_IN = "gradient-routes"


@dataclass(frozen=True)
class Pointer:
    """`FILE.py:NAME` or `package.module:NAME` in place of an entry point."""

    name: str
    dist: None = None

    def load(self) -> Any:
        return imported(self.name)


@dataclass(frozen=True)
class Entry:
    """A registered name; `load` imports it, `failure` says why it cannot be imported (None if it can)."""

    kind: Kind
    point: EntryPoint | Pointer

    @property
    def name(self) -> str:
        return self.point.name

    @property
    def origin(self) -> str:
        """The distribution that registered it."""
        return distribution_name(self.point.dist) if self.point.dist else self.point.name

    def load(self) -> Any:
        """The factory of a problem, the Route or the Study. Raises InputError with the reason if that fails."""
        try:
            target = self.point.load()
        except InputError:
            raise
        except (Exception, SystemExit) as error:  # a plug-in may raise anything while it is imported
            if isinstance(self.point, Pointer):
                raise  # it says so itself
            said = " ".join(str(error).split())
            raise InputError(
                f"{self.kind} '{self.name}' of {self.origin} cannot be imported: {type(error).__name__}: {said}"
                f" - mend or uninstall {self.origin}"
            ) from error
        if self.kind == "route" and not is_route(target):
            raise InputError(f"route '{self.name}' of {self.origin} is no Route - decorate its function with @route")
        if self.kind == "route" and isinstance(self.point, EntryPoint) and target.name != self.name:
            raise InputError(f"route '{self.name}' of {self.origin} calls itself '{target.name}' - give it one name")
        if self.kind == "problem" and not callable(target):
            raise InputError(f"problem '{self.name}' of {self.origin} cannot be called - register a class or a factory")
        if self.kind == "study":
            if not (isinstance(target, Study) and target.name == self.name):
                raise InputError(f"study '{self.name}' of {self.origin} is no Study of that name - register one")
            if odd := target.odd_name():
                raise InputError(
                    f"study '{self.name}' of {self.origin}: a table or column cannot be named '{odd}'"
                    f" - choose another name"
                )
        return target

    @property
    def sound(self) -> bool:
        """Whether `all` names it: it can be imported, and is not wrong on purpose."""
        return self.failure is None and getattr(self.load(), "sound", True)

    @property
    def failure(self) -> str | None:
        try:
            self.load()
        except InputError as error:
            return str(error)
        return None


@cache
def distribution_name(distribution: Distribution) -> str:
    """Its name, which Python parses all its metadata for."""
    return distribution.name


@cache
def registered(kind: Kind) -> list[Entry]:
    """All entries of a kind, built-ins first."""
    points = sorted(group(GROUPS[kind]), key=lambda point: (not is_built_in(point), *place(point.name)))
    return [Entry(kind, point) for point in points]


def place(name: str) -> tuple[int, str]:
    """A key to sort names by: the story's, then the others'."""
    return ORDER.index(name) if name in ORDER else len(ORDER), name


@cache
def entries(kind: Kind) -> dict[str, Entry]:
    """The entries that count: of two with one name, the built-in or first one."""
    first: dict[str, Entry] = {}
    for entry in registered(kind):
        first.setdefault(entry.name, entry)
    return first


@cache
def studies() -> dict[str, Study]:
    """All that can be imported, by name."""
    return {name: entry.load() for name, entry in entries("study").items() if entry.failure is None}


def study_tables() -> dict[str, Table]:
    """The tables of all studies, by name."""
    return {name: table for study in studies().values() for name, table in study.tables.items()}


# the order of the story: from nothing but J to the whole structure
ORDER = (
    "bar",
    "block",
    "plate",
    "rod",
    "coupon",
    "advection",
    "heat",
    "advection-in-time",
    "vibrating-bar",
    "impact-block",
    "fd-one-sided",
    "fd-central",
    "complex-step",
    "tangent",
    "adjoint",
    "unrolled-ad",
    "implicit-ad",
    "projective",
    "faulty-adjoint",
    "adapter",
    "run",
    "scaling",
    "vcurve",
    "check",
    "tolerance",
    "unrolling",
    "horizon",
    "kink",
    "invert",
    "consistency",
    "identify",
)


def find(kind: Kind, name: str) -> Entry:
    """The entry of that name, or what `FILE.py:NAME` points to. Raises InputError with the nearest name."""
    if is_reference(name):
        return Entry(kind, Pointer(name))
    known = entries(kind)
    if name not in known:
        raise InputError(f"no {kind} '{name}' - {did_you_mean(name, known)}")
    return known[name]


def factory_of(target: Any) -> Callable[..., Any]:
    """What declares the options: a route's function, or the problem's factory itself."""
    function: Callable[..., Any] = target.function if is_route(target) else target
    return function


def is_route(target: Any) -> bool:
    from gradient_routes.routes.route import Route  # NumPy with it: `routes --help` starts without

    return isinstance(target, Route)
