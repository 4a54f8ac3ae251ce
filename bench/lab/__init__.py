"""`routes lab`: pages to play on, in a browser or a notebook. What moves there is what commands of `routes` compute.

shell.py   a command of `routes` in a process that stays        pool.py   so many of these processes
place.py   what a session computes with                           state.py  values of a state as text
part.py    a part of the laboratory: a state = a command = a URL, and what is drawn of its rows
parts/     one part a file           page.py   what is around a part            server.py   all of them, on loopback
"""

from __future__ import annotations

from importlib.util import find_spec

from gradient_routes.problems.errors import InputError

NEEDED = ("panel", "bokeh", "latex2mathml")


def check_installed() -> None:
    """Raises InputError where the extra is missing."""
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        raise InputError(f"lab: {', '.join(missing)} not installed - pip install 'gradient-routes[lab]'")
