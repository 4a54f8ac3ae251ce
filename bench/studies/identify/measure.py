"""What `routes identify` measures: experiments compared with the first, sensors proposed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.study import Found, Kept, Note, Say
from gradient_routes.bench.store.output_files import Output, read_by
from gradient_routes.bench.studies.bill import vtu as file
from gradient_routes.bench.studies.identify.identifiability import Identified, identify, varied
from gradient_routes.bench.studies.identify.placement import Criterion, Placement
from gradient_routes.bench.studies.identify.placement import place as placed
from gradient_routes.bench.studies.identify.rows import fields, rows
from gradient_routes.bench.studies.options import one_problem
from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.routes.newton import Solver


@dataclass(frozen=True)
class Determined:
    """Experiments, the first asked for and its variations; sensors proposed for it; their rows by table."""

    experiments: Sequence[Identified]
    placement: Placement | None
    tables: dict[str, list[Row]]


def run(
    say: Say,
    *,
    selector: str,
    at: str,
    noise: float | None,
    sensors: Sequence[str],
    cases: Sequence[str],
    stop: Sequence[str],
    vary: Sequence[str],
    place: int | None,
    criterion: Criterion,
    afresh: bool,
    modes: int | None,
    vtu: Path | None,
    solver: Solver,
    kept: Path | None,
) -> int:
    given = {"sensors": sensors, "cases": cases, "stop": stop}
    changes = [(name, text) for name, texts in given.items() for text in texts]
    specs = varied(one_problem(selector), [*changes, *map(_change, vary)])
    output = None if vtu is None else Output("--vtu", vtu, (".vtu",))
    if output is not None:
        output.check([*([] if kept is None else [kept]), *read_by(selector, at, *vary)])
    found = [identify(spec, at, noise, solver, modes) for spec in specs]
    placement = None if place is None else placed(found[0], place, criterion, afresh)
    mesh = None if output is None else fields(found[0])
    tables = rows(found, placement)
    for name, of in tables.items():
        for row in of:
            say(Kept(name, row))
    say(Found(Determined(found, placement, tables)))
    if output is not None and mesh is not None:
        try:
            file.write(output, mesh)
        except InputError:
            raise
        except RoutesError as error:
            say(Note(str(error)))
            return 1
        say(Note(f"fields in {vtu}", result=True))
    return 0


def _change(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise InputError(f"--vary {text} - write KEY=VALUE, an option of the problem")
    return name.strip(), value.strip()
