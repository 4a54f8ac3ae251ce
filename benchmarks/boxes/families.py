"""All families: importing this registers them."""

from benchmarks.boxes import (  # noqa: F401
    contact,
    corners,
    exploding,
    libraries,
    loose,
    memory,
    mistakes,
    noisy,
    ordinary,
    points,
    scales,
    small,
    state,
    treads,
)
from benchmarks.boxes.box import FAMILIES

__all__ = ["FAMILIES"]
