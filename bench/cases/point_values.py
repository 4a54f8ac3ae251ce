"""--at 0.1,0,-0.3 or --at 'log E_1=0.1,log E_3=-0.3': p itself, in the command."""

from __future__ import annotations

import hashlib
import math
import os

import numpy as np

from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.point_file import listed
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Parameters

LONGEST = 32  # characters of values in a table


def are_values(at: str) -> bool:
    """Whether `at` holds numbers. What names a file that exists is that file, whatever it looks like."""
    return (not at or "," in at or "=" in at or _number(at) is not None) and not os.path.isfile(located(at))


def values(at: str) -> Array:
    """p (n_p,) of `at`, numbers in order. Raises InputError."""
    return np.array([_finite(at, text) for text in at.split(",")])


def values_of(parameters: Parameters, at: str) -> Array:
    """p (n_p,), not yet inside its domain: all numbers in order, or some by name, the others those of the start.

    Raises InputError.
    """
    who = f"--at {shown(at)}"
    if "=" not in at:
        return values(at)
    places = {parameters.label(i): i for i in range(len(parameters))}
    p, given = parameters.start.copy(), set[str]()
    for part in at.split(","):
        name, equals, text = (word.strip() for word in part.rpartition("="))
        if not equals:
            raise InputError(f"{who}: '{part}' has no name - name every value, or none")
        if name not in places:
            raise InputError(f"{who}: no file, and '{name}' no parameter - the parameters are {listed(places)}")
        if name in given:
            raise InputError(f"{who}: {name} is given twice - give it once")
        if len(places) < len(p):
            raise InputError(f"{who}: names of parameters are not unique - give all {len(p)} values, without names")
        given.add(name)
        p[places[name]] = _finite(at, text)
    return p


def shown(at: str | None) -> str:
    """`at` for a table: of many values the first, their number, and four digits that tell them from others."""
    if at is None or len(at) <= LONGEST or not are_values(at):
        return at or ""
    head, comma, _ = at[:LONGEST].rpartition(",")
    kept, digits = head if comma else at[:LONGEST], hashlib.sha256(at.encode()).hexdigest()[:4]
    return f"{kept},... ({at.count(',') + 1} values, #{digits})"


def _finite(at: str, text: str) -> float:
    p = _number(text)
    if p is None:
        raise InputError(f"--at {shown(at)}: no file, and '{text.strip()}' no number - give a file or n_p numbers")
    if not math.isfinite(p):
        raise InputError(f"--at {shown(at)}: {text.strip()} is not finite - give finite numbers")
    return p


def _number(text: str) -> float | None:
    try:
        return float(text.replace("_", "?"))  # Python would read 1_0 as 10
    except ValueError:
        return None
