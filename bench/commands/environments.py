"""`routes environments`: what adapters run in."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import debug_option
from gradient_routes.bench.sanitize import echo

if TYPE_CHECKING:
    from gradient_routes.routes.foreign.manifest import Manifest

# by kind: a problem to hold a new environment against ours, with values that the adapter knows
CASES = {"bar": "bar", "hyperelastic": "block[n=2]", "vibrating-bar": "vibrating-bar[scheme={scheme}]"}


@click.group(invoke_without_command=True)
@click.pass_context
@debug_option
def environments(context: click.Context) -> None:
    """List the environments that the adapters of other frameworks run in.

    \b
    routes environments                     which there are, what they weigh
    routes environments create torch-fem    make one, and hold a gradient of it against ours
    routes environments create --missing all
    """
    from gradient_routes.bench.environments.building import weight
    from gradient_routes.bench.units import size
    from gradient_routes.routes.foreign.manifest import manifest, shipped

    if context.invoked_subcommand is not None:
        return
    for name, script in shipped().items():
        found = manifest(script)
        state = size(weight(found.folder)) if found.ready else f"missing: routes environments create {name}"
        echo(f"{name:<16}{state:<16}  {found.summary}")


@environments.command()
@click.argument("names", nargs=-1, required=True, metavar="NAME|all|FILE.py...")
@click.option("--missing", is_flag=True, help="Leave those alone that have been made.")
@debug_option
def create(names: tuple[str, ...], missing: bool) -> None:
    """Make the environments of adapters, by uv where it is installed, else by venv and pip.

    Packages and versions are those of the adapter's inline metadata. A new environment is held against ours by one
    gradient.
    """
    from gradient_routes.bench.cases.suggest import did_you_mean
    from gradient_routes.bench.environments.building import create as make
    from gradient_routes.bench.environments.building import weight
    from gradient_routes.bench.units import size
    from gradient_routes.problems.errors import InputError
    from gradient_routes.routes.foreign.manifest import manifest, shipped

    known = shipped()
    names = tuple(known) if names == ("all",) else names
    scripts = {name: Path(name).absolute() if name.endswith(".py") else known.get(name) for name in names}
    for name in (name for name, script in scripts.items() if script is None):
        raise InputError(f"no adapter '{name}' - {did_you_mean(name, known)}")
    for found in [manifest(script) for script in scripts.values() if script is not None]:
        if missing and found.ready:
            continue
        folder = make(found)
        route = found.name if found.script in known.values() else f"adapter[command={shlex.quote(str(found.script))}]"
        echo(f"{found.name}: {size(weight(folder))} in {folder}, {_compared(route, found)}")


def _compared(route: str, adapter: Manifest) -> str:
    """One gradient against ours, in words. Raises RoutesError where it is none."""
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.execution.sweep import run
    from gradient_routes.problems.errors import RoutesError

    kind = next((kind for kind in CASES if kind in adapter.cases), None)
    if kind is None:
        return "not compared: it knows none of our problems"
    problem = CASES[kind].format(**{name: values[0] for name, values in adapter.cases[kind].items()})
    (outcome,) = run(case.problems([problem]), case.routes([route]), Settings(timed=False))
    row = outcome.row
    if row["status"] != "ok":
        raise RoutesError(f"{adapter.name}: its gradient on {problem} is {row['status']}: {row['reason']}")
    return f"gradient on {problem} off ours by {row['gradient_error']:.1e}"
