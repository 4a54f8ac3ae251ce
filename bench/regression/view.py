"""A comparison in a terminal: a table of all cases, then findings in sentences."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import Any

from rich.console import Console
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.execution.cost_model import summary
from gradient_routes.bench.regression.compare import Comparison
from gradient_routes.bench.regression.finding import JUDGEMENTS, Finding, Judgement
from gradient_routes.bench.render.format import bytes_, number, ratio, seconds
from gradient_routes.bench.render.terminal.tables import MOST, RESOLUTION, named, say, show, titled
from gradient_routes.bench.render.terminal.text_table import TextTable
from gradient_routes.routes.tally import Work

METRICS = {
    "status": "status",
    "work": "work",
    "gradient_error": "error",
    "peak_bytes": "memory",
    "tape_bytes": "tape",
    "time": "cost / forward solve",
    "seconds": "seconds",
}
LEGEND = (
    "before -> now; cost / forward solve: time over that of a forward solve in the same run; seconds are not judged"
)
STYLES: dict[Judgement, str] = {"worse": "bold red", "better": "green", "not-compared": "dim"}
FEW = 3  # cases that a line names


def show_comparison(out: Console, comparison: Comparison) -> None:
    """Print the table, the sentences and, last, the conclusion."""
    cases = overview(comparison)
    if cases:
        show(out, _table(cases))
        if (every := comparison.cases) > len(cases):
            say(out, f"{len(cases)} of {every} cases, those that changed first; --format json has all", "dim")
        say(out, LEGEND, "dim")
    for judgement, line in lines(comparison):
        say(out, line, STYLES.get(judgement, ""))
    for note in comparison.notes:
        say(out, f"note: {note}", "italic")
    say(out, conclusion(comparison), "bold red" if comparison.worse else "bold green")


def _table(cases: Sequence[tuple[str, str, dict[str, Finding]]]) -> TextTable:
    table = TextTable(["problem\n  route", *(heading.replace(" / ", " /\n") for heading in METRICS.values())])
    before = None
    for problem, route, by_metric in cases:
        if problem != before:
            table.title(problem)
            before = problem
        table.row(Text(route), [Text(*cell(by_metric.get(metric), metric)) for metric in METRICS])
    return table


def overview(comparison: Comparison) -> list[tuple[str, str, dict[str, Finding]]]:
    """Problem, route and findings by metric of every case of both sides; of many, first those that changed."""
    shown = [finding for finding in comparison.findings if finding.metric in METRICS]
    cases = [*dict.fromkeys(id(finding.case) for finding in shown)]
    if len(cases) > MOST:
        first = {id(finding.case) for finding in shown if changed(finding)}
        cases = sorted(cases, key=lambda case: case not in first)[:MOST]
    grouped: dict[int, dict[str, Finding]] = {case: {} for case in cases}
    for finding in shown:
        if id(finding.case) in grouped:
            grouped[id(finding.case)][finding.metric] = finding
    return [(*names(next(iter(by_metric.values())).case), by_metric) for by_metric in grouped.values()]


def changed(finding: Finding) -> bool:
    return finding.judgement in ("worse", "better")


def names(case: Row) -> tuple[str, str]:
    """Problem and route as selectors, which those of a verdict already are."""
    if "problem_options" not in case:
        return case["problem"], case["route"]
    return titled(case), named("route", case)


def cell(finding: Finding | None, metric: str) -> tuple[str, str]:
    """`before -> now`, or one value if they are equal, and its style."""
    if finding is None:
        return "", ""
    before, now = (_value(metric, value) for value in (finding.base, finding.new))
    style = STYLES.get(finding.judgement, "dim" if metric == "seconds" else "")
    return now if before == now else f"{before or '?'} -> {now or '?'}", style


def _value(metric: str, value: Any) -> str:
    if value is None:
        return ""
    if metric == "work":
        return summary(Work(**value))
    if metric.endswith("_bytes"):
        return bytes_(value, RESOLUTION if metric == "peak_bytes" else 0)
    if metric == "gradient_error":
        return number(value, 2)
    return {"time": ratio, "seconds": seconds}.get(metric, str)(value)


def lines(comparison: Comparison) -> Iterator[tuple[Judgement, str]]:
    """A sentence per finding, the worse ones first; cases with the same sentence share it. Of many, the first."""
    said = every_line(comparison)
    yield from islice(said, MOST)
    if left := sum(1 for _ in said):
        yield "shown", f"... {left} more sentences; --format json has all"


def every_line(comparison: Comparison) -> Iterator[tuple[Judgement, str]]:
    """A sentence per finding, the worse ones first; cases with the same sentence share it."""
    for judgement in JUDGEMENTS:
        shared: defaultdict[str, list[Finding]] = defaultdict(list)
        for finding in comparison.findings:
            if finding.judgement == judgement and finding.says:
                shared[finding.says].append(finding)
        for says, findings in shared.items():
            yield judgement, f"{judgement.replace('-', ' ')}: {_whose(findings)}: {says}"


def _whose(findings: Sequence[Finding]) -> str:
    if len(findings) > FEW and findings[0].judgement != "worse":
        return f"{len(findings)} cases"
    whose = [names(finding.case) for finding in findings[:MOST]]
    more = f" and {len(findings) - MOST} more" if len(findings) > MOST else ""
    return ", ".join(f"{route} on {problem}" if route else problem for problem, route in whose) + more


def conclusion(comparison: Comparison) -> str:
    """Whether there is a regression, the number of cases compared, and the number of findings of each kind."""
    verdicts = sum(finding.metric == "verdict" for finding in comparison.findings)
    compared = [_cases(comparison)] if comparison.by_numbers or comparison.by_status else []
    compared += [f"{verdicts} verdict{'s' if verdicts > 1 else ''}"] if verdicts else []
    counts = {j: comparison.count(j) for j in ("worse", "better")}
    said = ", ".join(f"{n} {judgement}" for judgement, n in counts.items() if n)
    word = "a regression" if comparison.worse else "no regression"
    return f"{word}: {' and '.join(compared)}, {said or 'nothing better or worse'}"


def _cases(comparison: Comparison) -> str:
    numbers, status = comparison.by_numbers, comparison.by_status
    return f"{numbers} case{'' if numbers == 1 else 's'} compared by numbers, {status} by status only"
