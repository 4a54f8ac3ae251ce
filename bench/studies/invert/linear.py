"""`routes invert --linear`: the map from readings to parameters, of a problem or saved, applied to frames."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.study import Found, Kept, Note, Say
from gradient_routes.bench.inversion.frames import estimated, read_frames
from gradient_routes.bench.inversion.history import Iterate
from gradient_routes.bench.inversion.invert import Engine, invert
from gradient_routes.bench.inversion.linear_map import INSUFFICIENT, LinearMap, linear_map, whole_step
from gradient_routes.bench.inversion.objective import noise_level
from gradient_routes.bench.inversion.optimizers import Limits
from gradient_routes.bench.store.output_files import Output, read_by
from gradient_routes.bench.studies.invert.messages import Begun, Ended, Framed, Mapped, Taken
from gradient_routes.bench.studies.options import one_problem, one_route
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.newton import Solver

SUFFIXES = (".npz", ".csv")


def by_map(
    say: Say,
    selector: str | None,
    routes: Sequence[str],
    at: str,
    limits: Limits,
    saved: Path | None,
    frames: Path | None,
    output: Sequence[Path],
    solver: Solver,
    kept: Path | None,
) -> int:
    """Builds the map of a problem, or loads a saved one; saves it, and applies it, as asked. Returns the exit code."""
    outputs = _outputs(output, [*read_by(selector, at, saved, frames), *([] if kept is None else [kept])])
    if (selector is None) == (saved is None):
        raise InputError("--linear: takes --problem, or a --map that is saved - give one of them")
    if ".npz" in outputs and saved is not None:
        raise InputError(f"-o {outputs['.npz'].path}: would save the map of --map again - leave it out")
    if (frames is None) != (".csv" not in outputs):
        raise InputError("--frames and -o FILE.csv: one needs the other - give both, readings and where to write p")
    code = 0
    if saved is not None:
        by = LinearMap.load(saved)
        say(Found(by.described))
    else:
        assert selector is not None
        by, code = _built(say, one_problem(selector), one_route(*_only(routes)), Engine("linear", limits, solver), at)
    if ".npz" in outputs:
        with outputs[".npz"].open() as file:
            by.save(file)
        say(Note(f"the map in {outputs['.npz'].path}", result=True))
    if frames is not None:
        readings, remark = read_frames(frames, by)
        if remark is not None:
            say(Note(remark))
        estimates = estimated(by, readings)
        estimates.write(outputs[".csv"])
        say(Found(Framed(estimates)))
        code = max(code, int(estimates.unexplained))
        say(Note(f"p of every frame in {outputs['.csv'].path}", result=True))
    return code  # 1: a wrong gradient or answer, or data or frames that the model does not explain


def _only(routes: Sequence[str]) -> Sequence[str]:
    if len(routes) != 1:
        raise InputError(f"--linear with {len(routes)} routes - name one, for J and its gradient at the answer")
    return routes


def _built(say: Say, spec: ProblemSpec, route: RouteSpec, engine: Engine, at: str) -> tuple[LinearMap, int]:
    """The map, and the exit code by its answer to the problem's own data."""
    problem, found_by = spec(), list[LinearMap]()
    for text in problem.read_as:
        say(Note(f"{problem.name}: {text}"))
    noise = problem.alpha == 0.0 and noise_level(problem, problem.parameters.start) > 0.0

    def run(*inverted: Any) -> str:
        found_by.append(linear_map(inverted[0], spec.selector))
        return whole_step(found_by[0], *inverted)

    say(Found(Begun(f"{spec.selector} by {route.name}, {engine.optimizer}", problem.truth() is not None, noise)))
    found = invert(spec, route, engine, at, None, partial(_show, say, noise), problem, run)
    say(Found(Ended(found, None)))
    if found.interrupted:
        raise KeyboardInterrupt
    by = found_by[0] if found_by else None
    if by is None:
        raise InputError(f"{problem.name}: --linear: {found.end} - choose another start, --at")
    for table, rows in found.tables.items():
        for row in rows:
            say(Kept(table, row))
    say(Found(Mapped(found, by)))
    return by, 1 if found.misled or found.unexplained or found.end.startswith(INSUFFICIENT) else 0


def _show(say: Say, noise: bool, step: Iterate) -> None:
    say(Found(Taken(step, noise)))


def _outputs(paths: Sequence[Path], taken: Sequence[Path]) -> dict[str, Output]:
    """By their suffixes. Raises InputError."""
    found: dict[str, Output] = {}
    for path in paths:
        suffix = path.suffix.lower()
        if suffix not in SUFFIXES or suffix in found:
            raise InputError(f"-o {path}: name one FILE.npz for the map, one FILE.csv for p of every frame")
        found[suffix] = Output("-o", path, (suffix,))
        found[suffix].check(taken)
    return found
