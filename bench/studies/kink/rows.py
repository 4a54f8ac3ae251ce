"""The study of a kink as tidy rows of one table, the event first."""

from __future__ import annotations

from collections.abc import Hashable

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.studies.kink.columns import KINK
from gradient_routes.bench.studies.kink.event import Kink
from gradient_routes.bench.studies.kink.rounding import Trade, width_of

EMPTY: Row = dict.fromkeys((c.name for c in KINK), None)


def rows(kink: Kink, trade: Trade | None, what: Row) -> list[Row]:
    """Rows of what was measured; `what` holds problem and at."""
    measured = of_kink(kink) + ([] if trade is None else of_trade(trade))
    return [EMPTY | what | row for row in measured]


def of_kink(kink: Kink) -> list[Row]:
    found = [_event(kink)]
    found += [{"kind": "point", "route": spec.selector, **_status(why, "skipped")} for spec, why in kink.skipped]
    for one in kink.slopes:
        found.append(
            {
                "kind": "point" if one.side is None else "side",
                "route": one.route.selector,
                **_status(one.reason),
                **_visited(kink, one.s, one.side),
                "side": one.side,
                "slope": one.slope,
                "gradient_error": one.error,
                "reference": one.reference,
            }
        )
    for visit in kink.visits:
        if visit.reason is not None or not kink.slopes:
            found.append({"kind": "point", **_status(visit.reason), **_visited(kink, visit.s, None)})
    for stencil in kink.stencils:
        found.append(
            {
                "kind": "stencil",
                **_status(stencil.reason),
                "s": None if kink.event is None else kink.event.s,
                "step": stencil.step,
                "quotient_central": stencil.quotient,
                "off_left": stencil.off_left,
                "off_right": stencil.off_right,
            }
        )
    return found


def _event(kink: Kink) -> Row:
    event = kink.event
    if event is None:
        return {"kind": "event", "status": "failed" if kink.failed else "none", "reason": kink.says}
    return {
        "kind": "event",
        "status": "ok",
        "s": event.s,
        "objective": event.left.objective,
        "tip": event.left.tip,
        "active_set": word(event.left.active_set),
        "active_set_right": word(event.right.active_set),
        "slope": event.slope_left,
        "slope_right": event.slope_right,
        "jump": event.jump,
        "reference": event.judge,
        "quotient_forward": event.right.forward,
        "quotient_backward": event.left.backward,
    }


def _visited(kink: Kink, s: float, side: str | None) -> Row:
    if side is not None and kink.event is not None:
        visit = kink.event.left if side == "left" else kink.event.right
    else:
        visit = next(v for v in kink.visits if v.s == s)
    return {
        "s": s,
        "active_set": word(visit.active_set),
        "objective": visit.objective,
        "tip": visit.tip,
        "quotient_forward": visit.forward,
        "quotient_backward": visit.backward,
    }


def of_trade(trade: Trade) -> list[Row]:
    return [
        {
            "kind": "trade",
            "route": trade.route.selector,
            **_status(one.reason),
            "s": one.s,
            "width": width_of(one.stop),
            "k_c": one.stop.law.k_c,
            "penetration": one.penetration,
            "objective": one.objective,
            "slope": one.slope,
            "off_objective": one.off_objective,
            "off_slope": one.off_slope,
            "curvature": one.curvature,
            "newton_iterations": one.iterations,
        }
        for one in trade.rows
    ]


def _status(reason: str | None, otherwise: str = "failed") -> Row:
    return {"status": "ok" if reason is None else otherwise, "reason": reason}


def word(active_set: Hashable | None) -> str | None:
    return None if active_set is None else str(active_set)
