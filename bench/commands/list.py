"""`routes list`: registered problems and routes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gradient_routes.bench.command_options import debug_option

if TYPE_CHECKING:
    from gradient_routes.bench.cases.registry import Kind


@click.command("list")
@click.argument("what", required=False, type=click.Choice(["problems", "routes"]))
@debug_option
def list_(what: str | None) -> None:
    """List problems and routes with their options and defaults, and plug-ins that cannot be imported."""
    from gradient_routes.bench.commands.list_view import listing
    from gradient_routes.bench.render.terminal.tables import console

    out = console()
    kinds: list[Kind] = ["problem", "route"]
    for kind in kinds:
        if what in (None, f"{kind}s"):
            for line in listing(kind, out.width):
                out.print(line, soft_wrap=True)
