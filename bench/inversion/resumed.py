"""Where the last inversion of a problem ended, read from a store."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from bench.case import ProblemSpec
from bench.rows import clean
from bench.store import Store
from problems.errors import InputError
from problems.problem import Array


def last_estimate(path: Path, spec: ProblemSpec) -> tuple[Array, int]:
    """p (n_p,) of the newest estimates of this problem with these options, and the iterations behind them.

    Raises InputError where there are none.
    """
    store = Store(path)
    names, records = store.table("estimates")
    rows = [dict(zip(names, record, strict=True)) for record in records]
    same = [
        row for row in rows if row["problem"] == spec.name and json.loads(row["problem_options"]) == clean(spec.options)
    ]
    if not same:
        raise InputError(f"--resume: store {path} holds no inversion of {spec.name} with these options - leave it out")
    study, label = same[-1]["study_id"], same[-1]["label"]
    p = np.array([row["estimate"] for row in same if (row["study_id"], row["label"]) == (study, label)])
    names, records = store.table("inversion")
    steps = [dict(zip(names, record, strict=True)) for record in records]
    before = [row["iteration"] for row in steps if (row["study_id"], row["label"]) == (study, label)]
    return p, max(before, default=0)
