"""A piece of evidence: a number, what it should be below, and what it says."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """name of the test; value measured, NaN where it could not be; limit it should not pass.

    Both are relative errors where nothing else is said.
    says     in words, where there is something to say
    claim    a yes or no: value is 0 where it holds, else 1
    culprit  the factor it convicts, where it does; by_mesh: unless that shrinks with the mesh size
    """

    name: str
    value: float
    limit: float
    says: str = ""
    culprit: str | None = None
    by_mesh: bool = False
    claim: bool = False

    @property
    def sound(self) -> bool | None:
        """None where the value could not be had."""
        return None if math.isnan(self.value) else self.value <= self.limit
