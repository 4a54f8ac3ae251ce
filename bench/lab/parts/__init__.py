"""The parts of the laboratory, in the order of its pages. A part is imported when it is asked for."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gradient_routes.bench.lab.part import Part

PARTS = {  # slug -> class in the module of that name
    "derivation": "Derivation",
    "inverter": "Inverter",
    "laboratory": "Laboratory",
    "own-data": "OwnData",
    "store": "KeptRows",
    "which-route": "WhichRoute",
}


def load(slug: str) -> type[Part]:
    """The class of a part."""
    found: type[Part] = getattr(import_module(f"{__name__}.{slug.replace('-', '_')}"), PARTS[slug])
    return found
