"""How cases are run."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from gradient_routes.bench.cases.partial import Partial
from gradient_routes.routes.newton import Solver


@dataclass(frozen=True)
class Columns:
    """Sensitivities to keep: du/dp of the state or d(S u)/dp of the data, for the parameters `chosen` (from 0; None:
    all), as a table, as fields on the mesh, or both.
    """

    of: Literal["state", "data"] = "state"
    chosen: tuple[int, ...] | None = None
    table: bool = True
    on_mesh: bool = False


@dataclass(frozen=True)
class Settings:
    """How cases are run: at which p, up to which predicted bill [s], timed for how long [s] if at all, with gradients
    kept or not, on the whole of p or on a part, with fields on the mesh or without, with columns of sensitivities or
    without.
    """

    at: str = "start"
    budget: float = 60.0
    min_time: float = 0.1
    timed: bool = True
    gradient: bool = False
    solver: Solver = field(default_factory=Solver)
    partial: Partial | None = None
    fields: bool = False
    columns: Columns | None = None
