"""`routes lab`: the laboratory in a browser."""

from __future__ import annotations

import os
from pathlib import Path

import click

from gradient_routes.bench.command_options import complain, debug_option, store_option
from gradient_routes.bench.commands.group import INTERRUPTED, leave
from gradient_routes.bench.commands.interrupts import over
from gradient_routes.bench.lab import check_installed
from gradient_routes.bench.ranges import Whole
from gradient_routes.bench.sanitize import echo
from gradient_routes.problems.errors import InputError

PORT = "0: any that is free."


@click.command()
@click.option("--port", type=Whole(0, 65_535), default=5080, show_default=True, help=PORT)
@click.option("--browser/--no-browser", default=True, show_default=True, help="Open a browser.")
@store_option
@debug_option
def lab(port: int, browser: bool, store: Path) -> None:
    """Pages to play on, in the browser: derive the adjoint, invert a bar, compare routes, until Ctrl-C.

    What moves on a page is computed by commands of `routes`, which it shows. It listens on this machine only.
    In a notebook: gradient_routes.lab.bar().
    """
    check_installed()
    import webbrowser

    from gradient_routes.bench.lab.server import Laboratory

    def ready(url: str) -> None:
        echo(f"{url} until Ctrl-C")
        if browser:
            webbrowser.open(url)

    try:
        Laboratory(port, store=store).serve(ready)
    except KeyboardInterrupt:
        over()
        complain("interrupted - the laboratory is closed")
        leave(INTERRUPTED)
    except OSError as error:
        raise InputError(f"lab: port {port}: {os.strerror(error.errno or 0)} - name another by --port, or 0") from error
