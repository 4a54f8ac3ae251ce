"""A stop on either side of the tip."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.problems.contact import ContactLaw


@dataclass(frozen=True)
class BothSides:
    """q(g) - q(g'), g' = -g - 2 gap being the penetration of a second stop, as far from the tip on its other side."""

    law: ContactLaw
    gap: float

    @property
    def k_c(self) -> float:
        return self.law.k_c

    def force(self, g: Any, xp: Any = np) -> Any:
        return self.law.force(g, xp) - self.law.force(-g - 2.0 * self.gap, xp)

    def stiffness(self, g: Any) -> Any:
        return self.law.stiffness(g) + self.law.stiffness(-g - 2.0 * self.gap)

    def energy(self, g: Any) -> Any:
        return self.law.energy(g) + self.law.energy(-g - 2.0 * self.gap)

    def active_set(self, g: Any) -> str | None:
        behind = self.law.active_set(-g - 2.0 * self.gap)
        return "behind" if behind == "closed" else self.law.active_set(g)
