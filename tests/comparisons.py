"""What two runs measured, made up: cases, verdicts and stores to compare."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gradient_routes.bench.cases.environment import environment
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.regression.measured import Case, Measured, Verdict
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.verification.columns import CHECKS
from gradient_routes.routes.tally import KINDS

MIB = 2**20
HERE = environment()
WORK = dict.fromkeys(KINDS, 0) | {"forward_solves": 1, "transposed_solves": 1}
OPTIONS = {"problem_options": {"n": 8}, "route_options": {"factors": "refined"}}
NUMBERS = {"work": WORK, "gradient_error": 1e-15, "peak_bytes": 20 * MIB, "tape_bytes": 1000, "memory_method": "VmHWM"}


def row(**values):
    base = {"problem": "bar", "route": "adjoint", "at": "start", "status": "ok"} | OPTIONS | NUMBERS
    return empty_row() | base | values


def case(ratios=(), environment=HERE, **values) -> Case:
    return Case(row(**values), environment, tuple(ratios), min(ratios) if len(ratios) else None)


def side(*cases: Case, verdicts: tuple[Verdict, ...] = ()) -> Measured:
    return Measured("side", cases, verdicts)


def ratios(scale: float = 1.0, n: int = 40, seed: int = 0) -> list[float]:
    """Rounds about 2 forward solves, with the noise of a machine at work."""
    return list(scale * 2.0 * (1 + 0.05 * np.random.default_rng(seed).random(n)))


def stored(path: Path, *rows, seconds=(), verdict: str | None = "agrees") -> Path:
    store = Store(path)
    for one in rows:
        store.append(one, Samples(tuple(seconds), (0.5,) * len(seconds)) if seconds else None)
    if verdict is not None:
        check = dict.fromkeys(c.name for c in CHECKS) | {"problem": "bar", "route": "adjoint", "at": "start"}
        store.append_study("check", {"checks": [check | {"verdict": verdict}]}, "now")
    return path
