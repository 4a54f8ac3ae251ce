"""What a case is known by: a key of what was asked, and one of all that the answer rests on."""

from __future__ import annotations

import hashlib
import json
import platform
from contextlib import suppress
from dataclasses import asdict
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases import case, declared
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.declared import source_by
from gradient_routes.bench.cases.environment import versions
from gradient_routes.bench.cases.folder import located
from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.cases.sources import Source, Stamp, digest, stamp, stamps
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.foreign.manifest import ADAPTERS, manifest, shipped

HARNESS = 5  # raised when rows come to mean something else: all that was kept before is then stale


def identity(problem: case.ProblemSpec, route: case.RouteSpec, settings: Settings, threads: int) -> Row:
    """What is asked of a case, as columns, and its two keys."""
    asked = {
        "problem": problem.name,
        "problem_options": problem.options,
        "route": route.name,
        "route_options": route.options,
        "at": settings.at,
        "settings": settings_of(settings, threads),
    }
    key = hashed(*asked.values())
    asked |= {"case_key": key, "content_key": content_key(key, problem, route, settings.at)}
    return asked | declared.beside(asked)


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
    code, run = [source_by(problem.build), source_by(route.route)], programs(route.name, route.options)
    return content_key_of(case_key, code, run, problem.options, at)


def content_key_of(case_key: str, code: list[Source], run: list[Path], problem_options: dict[str, Any], at: str) -> str:
    """The same, of what a row holds: files are read, nothing is run."""
    read = [*case.files([problem_options], at), *run]
    data = [hashlib.sha256(located(file).read_bytes()).hexdigest() for file in read]
    rest = _rest(tuple(map(digest, code)), tuple(data), tuple(versions().items()), platform.python_version(), HARNESS)
    return _short(f"[{json.dumps(case_key)}, {rest[1:]}")


@lru_cache
def _rest(
    digests: tuple[str, ...], data: tuple[str, ...], libraries: tuple[tuple[str, Any], ...], python: str, harness: Any
) -> str:
    """What many cases rest on alike."""
    return _plain(digests, data, dict(libraries), python, harness)


def programs(route: str, options: Row) -> list[Path]:
    """The files that a route runs in another process: the script of an adapter, what shows that its environment has
    been made, and the words of a command.
    """
    words = str(options.get("command", "")).replace("'", " ").replace('"', " ").split()
    files = [*map(Path, words), *_adapters().get(route, ())]
    if len(words) == 1 and words[0].endswith(".py"):
        with suppress(InputError):
            files.append(manifest(located(words[0])).mark)
    return [file for file in files if located(file).is_file()]


@cache
def _adapters() -> dict[str, list[Path]]:
    """Of each the script, what scripts share, and the mark of its environment."""
    shared = sorted((ADAPTERS / "python").glob("*.py"))
    return {name: [script, *shared, manifest(script).mark] for name, script in shipped().items()}


def witnesses(problem: case.ProblemSpec, route: case.RouteSpec, at: str) -> tuple[Stamp, ...]:
    """The files that a content key is of: as long as they are as they were, so is what it stands for."""
    read = [*case.files([problem.options], at), *programs(route.name, route.options)]
    data = tuple(stamp(located(file)) for file in read)
    return (*stamps(source_by(problem.build)), *stamps(source_by(route.route)), *data)


def hashed(*parts: Any) -> str:
    """16 digits of a hash of plain values."""
    return _short(_plain(*parts))


def _plain(*parts: Any) -> str:
    return json.dumps(clean(list(parts)), sort_keys=True)


def _short(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]
