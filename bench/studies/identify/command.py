"""`routes identify`: what the data can say of p, which experiment would say more, where to measure next."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from gradient_routes.bench.command_options import at_option, debug_option, refuse_given, solver_options, store_options
from gradient_routes.bench.execution.limited import confined
from gradient_routes.bench.studies.study import (
    echo_json,
    json_option,
    keep,
    no_plot_option,
    one_problem,
    problem_option,
    writable,
)
from gradient_routes.bench.units import now
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.problems.problem import Fields
    from gradient_routes.routes.newton import Solver

NOISE = "Standard deviation of a reading. [that of the problem]"
MODES = "So many singular values, by random products. [all where H is affordable]"
OTHER = "The same problem with another {0}=; repeatable."
VARY = "Another value of any other option; repeatable."
PLACE = "Propose so many sensors more."
CRITERION = "Least volume (D) or mean variance (A) of what stays unknown."
AFRESH = "Place them instead of the present sensors, not beside them."
VTU = "Null share, column norm and standard deviation cell by cell, for ParaView."


@click.command()
@problem_option
@at_option
@click.option("--noise", type=float, metavar="SIGMA", help=NOISE)
@click.option("--sensors", multiple=True, metavar="VALUE", help=OTHER.format("sensors"))
@click.option("--cases", multiple=True, metavar="VALUE", help=OTHER.format("cases"))
@click.option("--stop", multiple=True, metavar="VALUE", help=OTHER.format("stop"))
@click.option("--vary", multiple=True, metavar="KEY=VALUE", help=VARY)
@click.option("--place", type=int, metavar="K", help=PLACE)
@click.option("--criterion", type=click.Choice(["D", "A"]), default="D", show_default=True, help=CRITERION)
@click.option("--afresh", is_flag=True, help=AFRESH)
@click.option("--modes", type=int, metavar="K", help=MODES)
@click.option("--vtu", type=click.Path(path_type=Path), metavar="FILE.vtu", help=VTU)
@solver_options
@no_plot_option
@json_option
@store_options
@confined()
@debug_option
def identify(
    selector: str,
    at: str,
    noise: float | None,
    sensors: tuple[str, ...],
    cases: tuple[str, ...],
    stop: tuple[str, ...],
    vary: tuple[str, ...],
    place: int | None,
    criterion: Literal["D", "A"],
    afresh: bool,
    modes: int | None,
    vtu: Path | None,
    solver: Solver,
    no_plot: bool,
    as_json: bool,
    kept: Path | None,
) -> None:
    """What the data can say of p: singular values of H = d(S u)/dp, rank against the noise, blind and weak parameters.

    Columns of H are those of natural changes of p, its rows those of J. Experiments are compared with the first one;
    sensors are proposed beside the present ones.

    \b
    routes identify --problem bar --noise 0.01
    routes identify --problem bar --sensors 8 --stop multiplier     which change buys more?
    routes identify --problem 'block[n=3,alpha=1e-4]' --noise 1e-3 --cases 3 --vtu null.vtu
    routes identify --problem bar --noise 0.01 --place 3            where to measure next

    Exit code: 0 measured, 1 a forward solve failed, 2 wrong usage, 130 interrupted, nothing kept.
    """
    from gradient_routes.bench.studies.identify import identifiability as study
    from gradient_routes.bench.studies.identify import view
    from gradient_routes.bench.studies.identify.placement import place as placed
    from gradient_routes.bench.studies.identify.rows import fields, rows

    problem = one_problem(selector)
    given = {"sensors": sensors, "cases": cases, "stop": stop}
    changes = [(name, text) for name, texts in given.items() for text in texts]
    specs = study.varied(problem, [*changes, *map(_change, vary)])
    if place is None:
        refuse_given(("criterion", "afresh"), "is of the sensors that --place proposes")
    writable(kept)
    if vtu is not None:
        from gradient_routes.bench.store.output_files import check_writable

        check_writable("--vtu", vtu, [] if kept is None else [kept])
    started = now()
    found = [study.identify(spec, at, noise, solver, modes) for spec in specs]
    placement = None if place is None else placed(found[0], place, criterion, afresh)
    mesh = None if vtu is None else fields(found[0])
    tables = rows(found, placement)
    if as_json:
        echo_json(tables)
    else:
        view.show(found, tables, placement, plotted=not no_plot)
    if vtu is not None and mesh is not None:
        _write(vtu, mesh, quiet=as_json)
    keep(kept, tables, started, quiet=as_json)


def _change(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise InputError(f"--vary {text} - write KEY=VALUE, an option of the problem")
    return name.strip(), value.strip()


def _write(path: Path, mesh: Fields, quiet: bool) -> None:
    from gradient_routes.bench.render.terminal.tables import console
    from gradient_routes.bench.studies.bill import vtu

    vtu.write(path, mesh)
    if not quiet:
        console().print(f"fields in {path}", style="dim", soft_wrap=True)
