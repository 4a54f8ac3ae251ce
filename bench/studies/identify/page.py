"""What the data can say, as a notebook shows it: the spectrum with the noise, and parameters one by one."""

from __future__ import annotations

from gradient_routes.bench.render import notebook
from gradient_routes.bench.render.figure import Note, Section
from gradient_routes.bench.studies.identify import figures
from gradient_routes.bench.studies.identify.identifiability import Identified
from gradient_routes.bench.studies.identify.rows import rows
from gradient_routes.bench.studies.identify.view import says


def fragment(one: Identified) -> str:
    tables = {name: [row | {"study_id": 0} for row in found] for name, found in rows([one], None).items()}
    drawn = [figures.spectrum(tables["spectrum"]), *figures.identified(tables["identified"])]
    first, *notes = (line.plain for line in says(one))
    section = Section(
        "identified",
        "Identifiability",
        "",
        tuple(figure for figure in drawn if figure is not None),
        notes=tuple(Note("", note) for note in notes),
    )
    return notebook.shown(f"{one.spec.selector}:", "", first.removeprefix(f"{one.spec.selector}: "), section)
