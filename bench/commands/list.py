"""`routes list`: registered problems and routes."""

from __future__ import annotations

import click

from gradient_routes.bench.command_options import debug_option


@click.command("list")
@click.argument("what", required=False, type=click.Choice(["problems", "routes"]))
@debug_option
def list_(what: str | None) -> None:
    """List problems and routes with their options and defaults, and plug-ins that cannot be imported."""
    from gradient_routes.bench.commands.list_view import listing
    from gradient_routes.bench.render.terminal.tables import console

    out = console()
    if what != "routes":
        out.print(listing("problem"))
    if what != "problems":
        out.print(listing("route"))
