"""`routes list`: registered problems, routes and studies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import debug_option

if TYPE_CHECKING:
    from gradient_routes.bench.cases.registry import Kind

KINDS: dict[str, Kind] = {"problems": "problem", "routes": "route", "studies": "study"}


@click.command("list")
@click.argument("what", required=False, type=click.Choice([*KINDS]))
@debug_option
def list_(what: str | None) -> None:
    """List problems and routes with their options and defaults, studies, and plug-ins that cannot be imported."""
    from gradient_routes.bench.commands.list_view import listing
    from gradient_routes.bench.render.terminal.tables import console

    out = console()
    for title, kind in KINDS.items():
        if what in (None, title):
            for line in listing(title, kind, out.width):
                out.print(line, soft_wrap=True)
