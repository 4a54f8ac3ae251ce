"""The sections of a report, in the order of its story; those without rows are left out."""

from __future__ import annotations

from bench.report import bill, identifiability, inversion, kink, overview, scaling, tolerance, unrolling, vcurves
from bench.report.figure import Section
from bench.report.source import Source

EMPTY = (
    "There is nothing to show yet: `routes run --problem bar --route all` measures a first bill,"
    " `routes vcurve --problem bar --route adjoint` checks a gradient."
)


def sections(source: Source) -> list[Section]:
    if not source.cases and not any(source.tables.values()):
        return [Section("overview", "At a glance", EMPTY)]
    parts = (bill, scaling, vcurves, tolerance, unrolling, kink, inversion, identifiability)
    made = (part.section(source) for part in parts)
    told = (overview.section(source), *made, overview.failures(source), overview.environments(source))
    return [section for section in told if section is not None]
