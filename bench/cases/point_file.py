"""--at FILE.csv: p in one column, or by the names of parameters, as other commands write it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice

import numpy as np

from gradient_routes.bench.cases.folder import located
from gradient_routes.problems.data.csv import NumberFile, read_columns
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem

VALUES = ("estimate", "p")  # of `invert -o` and `export --table estimates`, and of `run --gradient`
LISTED = 6  # names in a message


def read_point(problem: Problem, path: str) -> Array:
    """p (n_p,). Raises InputError for a file that cannot be read, lacks parameters or holds several values of one."""
    file = NumberFile.opened(path, located(""))
    if len(file.names) == 1:
        return next(iter(read_columns(path, None, folder=located("")).values()))
    value = next((name for name in VALUES if name in file.names), None)
    if value is None or "parameter" not in file.names:
        raise InputError(
            f"{path}: has {len(file.names)} columns - --at reads one, with a header line, or columns parameter and"
            f" {' or '.join(VALUES)}"
        )
    names = file.words(file.names.index("parameter"))
    units = file.words(file.names.index("unit")) if "unit" in file.names else [""] * len(names)
    values, q = read_columns(path, (value,), folder=located(""))[value], problem.parameters
    given: dict[str, float] = {}
    wanted = {q.label(i): q.unit_of(i) for i in range(len(q))}
    for name, unit, p in zip(names, units, values, strict=True):
        if given.setdefault(name, float(p)) != p:
            raise InputError(f"{path}: {name} is {given[name]:g} and {p:g}, of several runs - keep the rows of one")
        if unit and unit != wanted.get(name, unit):
            raise InputError(f"{path}: {name} is in {unit}, of {problem.name} in {wanted[name]} - convert it")
    other = [name for name in given if name not in wanted]
    if len(wanted) < len(q) and names == [q.label(i) for i in range(len(q))]:  # names that are not unique
        return values
    completed = problem.completed(given) if set(given) != set(wanted) else None
    if completed is not None:
        converted = [name for name, unit in zip(names, units, strict=True) if unit not in ("", "Pa")]
        if converted:
            raise InputError(f"{path}: {converted[0]} is in {units[names.index(converted[0])]}, not in Pa - convert it")
        return problem.parameters.check(completed, path)
    if other:
        raise InputError(f"{path}: {other[0]} is no parameter of {problem.name}: {listed(wanted)} - choose its law")
    if len(given) < len(wanted):
        absent = [name for name in wanted if name not in given]
        raise InputError(f"{path}: has no {listed(absent)} of {problem.name} - give all parameters")
    return np.array([given[name] for name in wanted])


def listed(names: Iterable[str]) -> str:
    """The first of them."""
    first = list(islice(names, LISTED + 1))
    return ", ".join(first[:LISTED]) + (", ..." if len(first) > LISTED else "")
