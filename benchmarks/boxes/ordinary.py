"""Families of ordinary objectives: sound ones, and with mistakes."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.boxes.box import Box, Model, add, right, wrong
from benchmarks.boxes.faults import sign, some
from benchmarks.boxes.fits import FITS
from benchmarks.boxes.physics import PHYSICS


def ordinary(build: Callable[[np.random.Generator], Model]) -> Callable[[np.random.Generator], Iterator[Box]]:
    """Three right gradients of different data, a wrong sign, and one more mistake."""

    def boxes(rng: np.random.Generator) -> Iterator[Box]:
        for k in range(3):
            yield right(build(rng), name=f"right-{k + 1}")
        model = build(rng)
        yield wrong(model, sign(model, rng))
        for fault in some(model, rng, 1):
            yield wrong(model, fault, name=fault.name)

    return boxes


for build in (*FITS, *PHYSICS):
    add(build.__name__.replace("_", "-"), "ordinary", ordinary(build))
