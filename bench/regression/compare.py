"""The comparison: pairs of cases, the findings of every rule, notes on libraries that differ."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

from gradient_routes.bench.cases.declared import undeclared
from gradient_routes.bench.cases.expected import Expectation, judged
from gradient_routes.bench.regression import rules
from gradient_routes.bench.regression.finding import JUDGEMENTS, Finding, Judgement
from gradient_routes.bench.regression.machines import library_differences
from gradient_routes.bench.regression.measured import Case, Measured
from gradient_routes.bench.regression.times import FACTOR, TimeRule
from gradient_routes.problems.errors import InputError

Pair = tuple[Case, Case]
UNMEASURED = ("skipped", "pruned")
Rule = Callable[[Case, Case], Finding]
HELD = ("tape_bytes", "factor_bytes")
RULES: tuple[Rule, ...] = (rules.work, rules.gradient_error, rules.peak_bytes, *(partial(rules.held, m) for m in HELD))


@dataclass(frozen=True)
class Comparison:
    """Findings case by case, and notes on the whole."""

    base: str
    new: str
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]

    def count(self, judgement: Judgement) -> int:
        return self.counts[judgement]

    @cached_property
    def counts(self) -> dict[Judgement, int]:
        found = Counter(finding.judgement for finding in self.findings)
        return {judgement: found[judgement] for judgement in JUDGEMENTS}

    @cached_property
    def cases(self) -> int:
        """Number of cases of both sides."""
        return sum(finding.metric == "status" for finding in self.findings)

    @cached_property
    def by_numbers(self) -> int:
        """Number of cases that are ok on both sides, so that numbers are compared."""
        return sum(f.metric == "status" and f.base == f.new == "ok" for f in self.findings)

    @property
    def by_status(self) -> int:
        """Number of other cases of both sides, of which only the status is compared."""
        return self.cases - self.by_numbers

    @property
    def worse(self) -> bool:
        return self.counts["worse"] > 0


def compare(
    base: Measured,
    new: Measured,
    expectations: Sequence[Expectation] = (),
    factor: float = FACTOR,
    subset: bool = False,
) -> Comparison:
    """Apply every rule to every case of both sides; a case that only BASE has is worse unless `subset`.

    Raises InputError where nothing can be compared.
    """
    pairs, gone, added = paired(base.cases, new.cases)
    verdicts = list(_verdicts(base, new, subset))
    common = any(finding.metric == "verdict" for finding in verdicts)
    if not pairs and not common:
        raise InputError(
            f"compare: of {len(base.cases)} cases in {base.source} and {len(new.cases)} in {new.source} none is in both"
            " - run the same problems and routes"
        )
    time = TimeRule(factor, sum(bool(b.ratios and n.ratios) for b, n in pairs))
    findings = [finding for b, n in pairs for finding in of_case(b, n, expectations, time, subset)]
    _check_measured(base, new, pairs, findings)
    findings += [rules.gone(case.row, case.row["status"], subset or not case.ok) for case in gone]
    findings += [rules.added(case.row, case.row["status"]) for case in added]
    findings += verdicts
    return Comparison(
        base.source, new.source, tuple(findings), (*_libraries(pairs), *_idle(new, expectations), *_old(base, new))
    )


def _check_measured(base: Measured, new: Measured, pairs: Sequence[Pair], findings: Sequence[Finding]) -> None:
    """Raise InputError where no numbers are compared, unless a case that was run is a regression."""
    ran = any(n.row["status"] not in UNMEASURED for _, n in pairs)
    if not pairs or any(b.ok and n.ok for b, n in pairs) or (ran and _any_worse(findings)):
        return
    before, now = (Counter(pair[side].row["status"] for pair in pairs) for side in (0, 1))
    raise InputError(
        f"compare: no numbers to compare in {len(pairs)} cases in both, {_counted(before)} in {base.source},"
        f" {_counted(now)} in {new.source} - measure at least one that is ok in both, or raise --budget"
    )


def _counted(statuses: Counter[str]) -> str:
    return " and ".join(f"{count} {status}" for status, count in statuses.items())


def paired(base: Sequence[Case], new: Sequence[Case]) -> tuple[list[Pair], list[Case], list[Case]]:
    """Pairs of the same key or, for rows of older versions, of the same name; and the cases left over on each side."""
    pairs, left, over = _paired(base, new, "key")
    more, left, over = _paired(left, over, "name", keyed=False)
    return pairs + more, left, over


def _paired(
    base: Sequence[Case], new: Sequence[Case], by: str, keyed: bool = True
) -> tuple[list[Pair], list[Case], list[Case]]:
    known = {getattr(case, by): case for case in base}
    pairs = []
    for case in new:
        other = known.get(getattr(case, by))
        if other is not None and (keyed or not (other.row["case_key"] and case.row["case_key"])):
            pairs.append((other, case))
            del known[getattr(case, by)]
    there, here = ({id(pair[side]) for pair in pairs} for side in (0, 1))
    return pairs, [case for case in base if id(case) not in there], [case for case in new if id(case) not in here]


def of_case(
    base: Case, new: Case, expectations: Sequence[Expectation], time: TimeRule, subset: bool = False
) -> Iterator[Finding]:
    """The findings of one case: its status and, where both are ok, its numbers."""
    ended, expected = rules.status(base, new, subset), judged(new.row, expectations)
    if expected is not None:
        ended = Finding(ended.case, ended.metric, ended.base, ended.new, "shown", f"{ended.new}, {expected.says}")
    yield ended
    if base.ok and new.ok:
        every: tuple[Rule, ...] = (*RULES, time, rules.seconds)
        yield from (rule(base, new) for rule in every)


def _verdicts(base: Measured, new: Measured, subset: bool) -> Iterator[Finding]:
    before, now = ({verdict.key: verdict for verdict in side.verdicts} for side in (base, new))
    for key, verdict in before.items():
        if key in now:
            yield rules.verdict(verdict, now[key])
        else:
            yield rules.gone(verdict.case, verdict.verdict, subset)
    yield from (rules.added(verdict.case, verdict.verdict) for key, verdict in now.items() if key not in before)


def _any_worse(findings: Sequence[Finding]) -> bool:
    return any(finding.judgement == "worse" for finding in findings)


def _libraries(pairs: Sequence[Pair]) -> Iterator[str]:
    """Each difference once, with the number of cases; numbers are compared in any case."""
    found = Counter(tuple(library_differences(base, new)) for base, new in pairs)
    for one, count in found.items():
        if one:
            yield f"libraries differ in {count} of {len(pairs)} cases: {'; '.join(one)}"


def _old(*sides: Measured) -> Iterator[str]:
    for side in sides:
        if note := undeclared(case.row for case in side.cases):
            yield f"{side.source}: {note}"


def _idle(new: Measured, expectations: Sequence[Expectation]) -> Iterator[str]:
    """Expectations that name no case: they may be mistyped."""
    for e in expectations:
        if not any(e.matches(case.row) for case in new.cases):
            yield f"expected {e.status} of {e.route} on {e.problem}: no such case in {new.source}"
