"""How wrong a gradient is, and against what."""

from __future__ import annotations

import numpy as np

from bench import registry
from problems.problem import Array, Problem, Reference
from routes.model import Model
from routes.route import Route

JUDGES = ("complex-step", "tangent")  # where a problem knows no closed form; never the judged route itself
MANY = 200  # parameters; beyond, these cost too much to be run unasked


def reference_for(problem: Problem, p: Array, route: Route) -> Reference | None:
    """The problem's own reference, or else the gradient of another exact route where n_p is small, or None."""
    own = problem.reference(p)
    if own is not None or len(p) > MANY:
        return own
    for name in JUDGES:
        judge: Route = registry.find("route", name).load()
        if name != route.name and judge.objection(problem) is None:
            gradient = judge.prepare(Model(problem), p)(p).gradient
            return Reference(name, gradient, float(np.linalg.norm(gradient)))
    return None


def error(gradient: Array, reference: Reference) -> tuple[float, str]:
    """|g - g_ref| / |g_ref| and the name of the reference.

    Where g_ref is zero up to the rounding of the terms that make it, the error is relative to those terms, and
    the name says so.
    """
    difference = float(np.linalg.norm(gradient - reference.gradient))
    scale = float(np.linalg.norm(reference.gradient))
    rounding = 8.0 * np.finfo(np.float64).eps * np.sqrt(len(gradient)) * reference.size
    if scale > rounding:
        return difference / scale, reference.name
    return difference / (reference.size or 1.0), f"{reference.name} (zero: relative to its terms)"
