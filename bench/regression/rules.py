"""A rule for each metric except time: when it is worse than before."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite, log10
from typing import Any

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import ANSWERED
from gradient_routes.bench.regression.finding import Finding, Judgement
from gradient_routes.bench.regression.measured import Case, Verdict
from gradient_routes.bench.render.format import bytes_, number
from gradient_routes.routes.tally import KINDS

ROUNDING = 1e-13  # errors below count as equal: the order of sums changes them
DECADE = 1.0
MEMORY, FLOOR = 1.25, 5 * 2**20  # factor and bytes: small peaks vary by more than the factor
HELD = 1.1  # arrays are counted exactly, but libraries pad and order them differently


def status(base: Case, new: Case, subset: bool = False) -> Finding:
    """A case that was answered and fails is worse, and so is one that was ok and is no longer run.

    The latter is allowed by `subset` under another budget, which may be the reason.
    """
    before, now = base.row["status"], new.row["status"]
    reason = f": {new.row['reason']}" if new.row["reason"] else ""
    says = f"{before} -> {now}{reason}" if before != now else ""
    return Finding(new.row, "status", before, now, _ended(base, new, subset), says)


def _ended(base: Case, new: Case, subset: bool) -> Judgement:
    before, now = base.row["status"], new.row["status"]
    if before == now:
        return "same"
    if now == "ok":
        return "shown" if before in ANSWERED else "better"
    if now not in ANSWERED:
        return "worse" if before in ANSWERED else "shown"
    return "worse" if base.ok and not (subset and _may_be_the_budget(base, new)) else "shown"


def _may_be_the_budget(base: Case, new: Case) -> bool:
    """Whether another budget may be why a case is not run: not if the route does not run on the problem at all."""
    before, now = base.row["budget_s"], new.row["budget_s"]
    lost = new.row["status"] == "skipped" and new.row["predicted_s"] is None
    return before is not None and before != now and not lost


def work(base: Case, new: Case) -> Finding:
    """A larger count of any kind is worse, a smaller one better."""
    before, now = base.row["work"], new.row["work"]
    if before is None or now is None:
        return _absent("work", base, new, _counts(before), _counts(now))
    judgement, says = counted(before, now)
    return Finding(new.row, "work", _counts(before), _counts(now), judgement, says)


def counted(before: Mapping[str, int], now: Mapping[str, int]) -> tuple[Judgement, str]:
    """Compare counts by kind; a kind that is absent was counted 0 times."""
    if before == now:
        return "same", ""
    pairs = {kind: (before.get(kind, 0), now.get(kind, 0)) for kind in KINDS}
    changed = {kind: (b, n) for kind, (b, n) in pairs.items() if b != n}
    more = any(b < n for b, n in changed.values())
    judgement: Judgement = "same" if not changed else "worse" if more else "better"
    return judgement, ", ".join(f"{kind} {b} -> {n}" for kind, (b, n) in changed.items())


def _counts(work: dict[str, int] | None) -> dict[str, int] | None:
    return None if work is None else {kind: count for kind, count in work.items() if count}


def gradient_error(base: Case, new: Case) -> Finding:
    """Worse by an order of magnitude above ROUNDING, or no longer known."""
    before, now = (_finite(case.row["gradient_error"]) for case in (base, new))
    if before is None or now is None:
        return _absent("gradient_error", base, new, before, now)
    if before == now:
        return Finding(new.row, "gradient_error", before, now, "same")
    decades = log10(max(now, ROUNDING)) - log10(max(before, ROUNDING))
    judgement: Judgement = "worse" if decades >= DECADE else "better" if decades <= -DECADE else "same"
    judges = [case.row["reference"] for case in (base, new)]
    other = f", judged against {judges[1]}, not {judges[0]}" if judges[0] != judges[1] else ""
    says = f"error {number(before, 2)} -> {number(now, 2)}: {decades:+.1f} orders of magnitude{other}"
    return Finding(new.row, "gradient_error", before, now, judgement, "" if judgement == "same" else says)


def _finite(value: float | None) -> float | None:
    return value if value is not None and isfinite(value) else None


def peak_bytes(base: Case, new: Case) -> Finding:
    """Worse by MEMORY and by FLOOR; compared only if measured by the same method."""
    before, now = base.row["peak_bytes"], new.row["peak_bytes"]
    for name, how in (("memory_method", "measured by"), ("isolated", "with isolated =")):
        a, b = base.row[name], new.row[name]
        if a != b and (now is not None or name == "isolated"):  # without a measurement there is no method
            return _uncompared("peak_bytes", new, before, now, f"memory, {how} {a} there, {b} here")
    if before is None or now is None:
        return _absent("peak_bytes", base, new, before, now)
    judgement: Judgement = "same"
    if now > MEMORY * before and now - before > FLOOR:
        judgement = "worse"
    elif before > MEMORY * now and before - now > FLOOR:
        judgement = "better"
    return Finding(new.row, "peak_bytes", before, now, judgement, _grown("memory", before, now, judgement))


def held(metric: str, base: Case, new: Case) -> Finding:
    """Bytes of a tape or of factors: worse by HELD, or no longer counted."""
    before, now = base.row[metric], new.row[metric]
    if now is None and before is not None and base.row["route_options"] != new.row["route_options"]:
        return _uncompared(metric, new, before, now, f"{metric}, the route has other options")
    if before is None or now is None:
        return _absent(metric, base, new, before, now)
    judgement: Judgement = "worse" if now > HELD * before else "better" if before > HELD * now else "same"
    return Finding(new.row, metric, before, now, judgement, _grown(metric.partition("_")[0], before, now, judgement))


def _grown(what: str, before: float, now: float, judgement: Judgement) -> str:
    if judgement == "same":
        return ""
    percent = f" ({100 * (now / before - 1):+.0f} %)" if before else ""
    return f"{what} {bytes_(before)} -> {bytes_(now)}{percent}"


def verdict(base: Verdict, new: Verdict) -> Finding:
    """Any change is worse: a check that no longer finds a fault is as bad as a fault."""
    same = base.verdict == new.verdict
    says = "" if same else f"{base.verdict} -> {new.verdict}"
    return Finding(new.case, "verdict", base.verdict, new.verdict, "same" if same else "worse", says)


def seconds(base: Case, new: Case) -> Finding:
    """Shown only: seconds vary with load and clock rate."""
    return Finding(new.row, "seconds", base.row["seconds"], new.row["seconds"], "shown")


def _absent(metric: str, base: Case, new: Case, before: Any, now: Any) -> Finding:
    """A number that one side lacks: worse if NEW lacks it."""
    if before is None and now is None:
        return Finding(new.row, metric, before, now, "same")
    lost = now is None
    says = f"{metric} is no longer known" if lost else f"{metric} is known now"
    return Finding(new.row, metric, before, now, "worse" if lost else "shown", says)


def _uncompared(metric: str, case: Case, before: Any, now: Any, why: str) -> Finding:
    return Finding(case.row, metric, before, now, "not-compared", why)


def gone(case: Row, what: str, allowed: bool) -> Finding:
    """A case of BASE that NEW lacks: worse, or else a gate would pass without measuring."""
    return Finding(case, "case", what, None, "shown" if allowed else "worse", f"{what} -> not measured")


def added(case: Row, what: str) -> Finding:
    return Finding(case, "case", None, what, "shown", f"new: {what}")
