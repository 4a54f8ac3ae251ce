"""What a session has to compute with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from gradient_routes.bench.command_options import STORE
from gradient_routes.bench.lab.pool import Pool


@dataclass(frozen=True)
class Place:
    """Where a part computes.

    quick   for what follows every move of a slider
    long    for what is asked for by a button
    folder  of this session alone: uploads, and what commands read
    store   that is looked at
    """

    quick: Pool
    long: Pool
    folder: Path
    store: Path = STORE
