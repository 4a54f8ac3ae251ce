"""The sections of a report, in the order of its story; those without rows are left out."""

from __future__ import annotations

from gradient_routes.bench.render import overview
from gradient_routes.bench.render.figure import Section
from gradient_routes.bench.render.source import Source
from gradient_routes.bench.studies.bill import figures as bill
from gradient_routes.bench.studies.identify import figures as identifiability
from gradient_routes.bench.studies.invert import figures as inversion
from gradient_routes.bench.studies.kink import figures as kink
from gradient_routes.bench.studies.scaling import figures as scaling
from gradient_routes.bench.studies.tolerance import figures as tolerance
from gradient_routes.bench.studies.unrolling import figures as unrolling
from gradient_routes.bench.studies.vcurve import figures as vcurves

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
