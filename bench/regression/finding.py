"""A finding: one metric of one case before and now, and how that is judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from gradient_routes.bench.cases.column import Row

Judgement = Literal["same", "better", "worse", "shown", "not-compared"]
JUDGEMENTS: tuple[Judgement, ...] = ("worse", "better", "shown", "not-compared", "same")  # in the order of interest


@dataclass(frozen=True)
class Finding:
    """`case` names the problem and the route; `base` and `new` are values of the metric, None where there is none."""

    case: Row
    metric: str
    base: Any
    new: Any
    judgement: Judgement
    says: str = ""
