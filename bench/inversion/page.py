"""An inversion as a notebook shows it: its steps, and what it found."""

from __future__ import annotations

from gradient_routes.bench.inversion import estimates_figures as estimates
from gradient_routes.bench.inversion.diagnosis import MISLED
from gradient_routes.bench.inversion.history_figure import ENDS, STEPS, history, named
from gradient_routes.bench.inversion.result import Inversion
from gradient_routes.bench.render import notebook
from gradient_routes.bench.render.figure import Note, Section


def fragment(found: Inversion) -> str:
    steps, parameters = (
        [row | {"run": named(row), "panel": found.label} for row in found.tables[table]]
        for table in ("inversion", "estimates")
    )
    figures = (history(steps, _spent(found), f"run {STEPS} {ENDS}"), *estimates.figures(parameters))
    said = [*found.view.remarks, *([] if found.fit is None else found.fit.described.splitlines())]
    notes = tuple(Note("note:", remark) for remark in said)
    section = Section("inversion", "Inversion", "", tuple(f for f in figures if f is not None), notes=notes)
    doubt = MISLED if found.misled else found.fit.verdict if found.fit is not None else ""
    return notebook.shown(f"{found.label}:", doubt, found.end, section)


def _spent(found: Inversion) -> str:
    last = found.iterates[-1]
    return f"{found.forward_solves} forward solves, {last.adjoint_solves} linearized or transposed ones."
