"""The parts of the laboratory in the cells of a notebook; `routes lab` has them as pages. Needs gradient-routes[lab].

    import gradient_routes.lab
    gradient_routes.lab.bar()

Options are those of a part's URL: bar(sensors="1,3,5", noise="0.001"). What is shown is computed in processes apart,
which end with the notebook.
"""

from __future__ import annotations

import asyncio
import atexit
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from gradient_routes.bench.lab import check_installed
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    import panel as pn

    from gradient_routes.bench.lab.place import Place

__all__ = ["bar", "derivation"]


def bar(**state: str) -> pn.Column:
    """Moduli of a bar from displacements, by gradients: sensors, noise, regularization, optimizers, a stop.

    Raises InputError where there is no notebook, or the extra is not installed.
    """
    return shown("inverter", state)


def derivation(**state: str) -> pn.Column:
    """The discrete adjoint, step by step, with the numbers of a bar. Raises InputError, as `bar`."""
    return shown("derivation", state)


def shown(slug: str, state: dict[str, str]) -> pn.Column:
    """A part by the last word of its URL."""
    check_installed()
    import panel as pn

    from gradient_routes.bench.lab.page import inside
    from gradient_routes.bench.lab.parts import load

    try:
        asyncio.get_running_loop()
    except RuntimeError:
        raise InputError("lab: this is no notebook - see the pages of `routes lab`") from None
    pn.extension(inline=True)  # no network
    part = load(slug)(_place(), state)
    column = inside(part)
    part.pushed = partial(pn.io.push_notebook, column)
    part.start()
    return column


@cache
def _place() -> Place:
    """One for the whole notebook; its processes and its folder end with it."""
    from gradient_routes.bench.lab.place import Place
    from gradient_routes.bench.lab.pool import LONG, QUICK, Pool

    folder = TemporaryDirectory(prefix="routes-lab-")
    atexit.register(folder.cleanup)
    pools = Pool(QUICK), Pool(LONG)
    for pool in pools:
        pool.warm()
        atexit.register(pool.close)
    return Place(*pools, Path(folder.name))
