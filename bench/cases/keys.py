"""What a case is known by: a key of what was asked, and one of all that the answer rests on."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import versions
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.sources import Stamp, digest, stamp, stamps

HARNESS = 5  # raised when rows come to mean something else: all that was kept before is then stale


def identified(row: Row, problem: case.ProblemSpec, route: case.RouteSpec, settings: Settings, threads: int) -> Row:
    """The row with its settings, its case_key and its content_key. `row` has its options as given."""
    asked = settings_of(settings, threads)
    key = hashed(*(row[name] for name in ("problem", "problem_options", "route", "route_options", "at")), asked)
    return row | {"settings": asked, "case_key": key, "content_key": content_key(key, problem, route, settings.at)}


def settings_of(settings: Settings, threads: int) -> dict[str, Any]:
    """What a row's numbers depend on beside problem and route."""
    partial = settings.partial
    return asdict(settings.solver) | {
        "partial": None if partial is None else asdict(partial),
        "timed": settings.timed,
        "threads": threads,
    }


def content_key(case_key: str, problem: case.ProblemSpec, route: case.RouteSpec, at: str) -> str:
    """Another one where code, data, libraries or the harness have changed."""
    data = [hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in case.files([problem], at)]
    code = [digest(problem.build), digest(route.route)]
    return hashed(case_key, code, data, versions(), platform.python_version(), HARNESS)


def witnesses(problem: case.ProblemSpec, route: case.RouteSpec, at: str) -> tuple[Stamp, ...]:
    """The files that a content key is of: as long as they are as they were, so is what it stands for."""
    data = tuple(stamp(Path(file)) for file in case.files([problem], at))
    return (*stamps(problem.build), *stamps(route.route), *data)


def hashed(*parts: Any) -> str:
    """16 digits of a hash of plain values."""
    return hashlib.sha256(json.dumps(clean(list(parts)), sort_keys=True).encode()).hexdigest()[:16]
