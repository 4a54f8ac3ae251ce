"""Where the last inversion of a problem ended, read from a store."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array


def last_estimate(path: Path, spec: ProblemSpec, route: RouteSpec, optimizer: str, at: str) -> tuple[Array, int]:
    """p (n_p,) at the end of the newest run of the same problem, route, options, optimizer and start, and its number
    of iterations. Raises InputError where there is none.
    """
    store = Store(path)
    asked = {
        "problem": spec.name,
        "problem_options": clean(spec.options),
        "alpha": float(spec.options.get("alpha") or 0.0),
        "route": route.name,
        "route_options": clean(route.options),
        "optimizer": optimizer,
        "at": at,
    }
    same = [row for row in store.records("estimates") if all(row[name] == value for name, value in asked.items())]
    if not same:
        raise InputError(
            f"--resume: store {path} holds no run of {spec.name} by {route.name}, {optimizer}, with these options"
            " - leave it out"
        )
    study, label = same[-1]["study_id"], same[-1]["label"]
    p = np.array([row["estimate"] for row in same if (row["study_id"], row["label"]) == (study, label)])
    before = [
        row["iteration"] for row in store.records("inversion") if (row["study_id"], row["label"]) == (study, label)
    ]
    return p, max(before, default=0)
