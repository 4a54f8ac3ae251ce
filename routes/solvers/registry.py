"""Linear solvers by name: built-in ones and plug-ins, all by entry point, imported when they are used."""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint
from typing import TYPE_CHECKING

from gradient_routes.problems.errors import InputError
from gradient_routes.routes.entry_points import group, is_built_in

if TYPE_CHECKING:
    from gradient_routes.routes.solvers.solver import LinearSolver

GROUP = "gradient_routes.solvers"
BUILT_IN = "gradient-routes"
DEFAULT = "auto"


@cache
def points() -> dict[str, EntryPoint]:
    """Entry points by name: the default, then the built-in ones, then plug-ins; of two with one name the first."""

    def place(point: EntryPoint) -> tuple[bool, bool, str]:
        return point.name != DEFAULT, not is_built_in(point), point.name

    found: dict[str, EntryPoint] = {}
    for point in sorted(group(GROUP), key=place):
        found.setdefault(point.name, point)
    return found


@cache
def linear_solver(name: str) -> LinearSolver:
    """The solver of that name. Raises InputError for unknown names and for plug-ins that cannot be imported."""
    from gradient_routes.routes.solvers.solver import LinearSolver

    if name not in points():
        known = ", ".join(points()) or f"none: {BUILT_IN} was installed before it had solvers, install it again"
        raise InputError(f"linear solver '{name}': not registered - choose from {known}")
    point = points()[name]
    origin = point.dist.name if point.dist else point.value
    try:
        solver = point.load()
    except (Exception, SystemExit) as error:  # a plug-in may raise anything while it is imported
        why = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise InputError(
            f"linear solver '{name}' of {origin} cannot be imported: {why} - repair or uninstall {origin}"
        ) from error
    if not isinstance(solver, LinearSolver) or solver.name != name:
        raise InputError(f"linear solver '{name}' of {origin} is no LinearSolver of that name - correct {origin}")
    return solver
