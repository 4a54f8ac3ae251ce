"""The sections of a report, in the order of its story; those without rows are left out."""

from __future__ import annotations

from gradient_routes.bench.cases import registry
from gradient_routes.bench.render import overview
from gradient_routes.bench.render.figure import Section
from gradient_routes.bench.render.source import Source

EMPTY = (
    "There is nothing to show yet: `routes run --problem bar --route all` measures a first bill,"
    " `routes vcurve --problem bar --route adjoint` checks a gradient."
)


def sections(source: Source) -> list[Section]:
    if not source.cases and not any(source.tables.values()):
        return [Section("overview", "At a glance", EMPTY)]
    figures = [study.load("figures") for study in registry.studies().values()]
    made = [section(source) for section in figures if section is not None]
    told = (overview.section(source), *made, overview.failures(source), overview.environments(source))
    return [section for section in told if section is not None]
