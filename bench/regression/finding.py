"""A finding: a metric of a case before and now, and whether it is worse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from gradient_routes.bench.cases.column import Row

Judgement = Literal["same", "better", "worse", "shown", "not-compared"]
JUDGEMENTS: tuple[Judgement, ...] = ("worse", "better", "shown", "not-compared", "same")  # in the order of interest


@dataclass(frozen=True, slots=True)
class Finding:
    """`case` names problem and route; `base` and `new` are the values of the metric, None if absent; `says` is a
    sentence about them."""

    case: Row
    metric: str
    base: Any
    new: Any
    judgement: Judgement
    says: str = ""
