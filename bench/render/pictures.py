"""Figures as files for a paper, drawn by vl-convert: what the page shows first, as PNG, SVG and PDF."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from gradient_routes.bench.render.figure import Section
from gradient_routes.bench.render.vega import svg
from gradient_routes.bench.store.output_files import Output
from gradient_routes.bench.store.replacing import check_folder
from gradient_routes.problems.errors import InputError

FORMATS = ("png", "svg", "pdf")
PPI = 200


def check(folder: Path) -> None:
    """Raise InputError where nothing can be drawn, before anything is."""
    if find_spec("vl_convert") is None:
        raise InputError("--figures: needs vl-convert - pip install 'gradient-routes[pictures]'")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        check_folder(folder)
    except OSError as error:
        raise InputError(f"--figures {folder}: {error.strerror} - name a folder you may write") from error


def write(sections: Sequence[Section], folder: Path, store: Path) -> list[str]:
    """Every figure in every format; the names of what was drawn. Raises RoutesError."""
    import vl_convert

    drawn = []
    for figure in (figure for section in sections for figure in section.figures if figure.mark):
        picture = svg(figure)
        made = {
            "png": vl_convert.svg_to_png(picture, ppi=PPI),
            "svg": picture.encode(),
            "pdf": vl_convert.svg_to_pdf(picture),
        }
        for format in FORMATS:
            output = Output("--figures", folder / f"{figure.id}.{format}", (f".{format}",))
            output.check([store])
            with output.open() as file:
                file.write(made[format])
        drawn.append(figure.id)
    return drawn
