"""A piece of evidence beside difference quotients: a measured number and its limit."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """A test by name; value and limit are relative errors unless the name says otherwise, value NaN where unknown.

    says     explanation, where one is needed
    culprit  the part of the gradient that the test proves wrong; by_mesh: unless the error shrinks with the mesh size
    claim    a yes-or-no test: value is 0 where it holds, else 1
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
        """Whether the value is within its limit; None where it is unknown."""
        return None if math.isnan(self.value) else self.value <= self.limit
