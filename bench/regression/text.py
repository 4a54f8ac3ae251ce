"""A comparison as Markdown, for a pull request, and as JSON."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from gradient_routes.bench.cases.row import clean
from gradient_routes.bench.regression.compare import Comparison
from gradient_routes.bench.regression.finding import Finding
from gradient_routes.bench.regression.view import LEGEND, METRICS, cell, conclusion, lines, names, overview
from gradient_routes.bench.sanitize import plain

FIELDS = [field.name for field in fields(Finding) if field.name != "case"]
SIGNS = {"worse": "❌", "better": "✅", "shown": "•", "not-compared": "◌"}


def markdown(comparison: Comparison) -> str:
    """The conclusion as a heading, a list of findings, and a folded table of all cases."""
    written = [f"### Gradient routes: {_safe(conclusion(comparison))}", ""]
    written += [f"- {SIGNS.get(judgement, '')} {_safe(line)}" for judgement, line in lines(comparison)]
    written += [f"- note: {_safe(note)}" for note in comparison.notes]
    cases = overview(comparison)
    if cases:
        written += ["", f"<details><summary>every case: {LEGEND.replace('->', '→')}</summary>", ""]
        written += [f"| problem | route | {' | '.join(METRICS.values())} |", "|---" * (2 + len(METRICS)) + "|"]
        written += [_row(problem, route, by_metric) for problem, route, by_metric in cases]
        written += ["", "</details>"]
    return "\n".join(written) + "\n"


def _row(problem: str, route: str, by_metric: dict[str, Finding]) -> str:
    cells = [_safe(problem), _safe(route)]
    for metric in METRICS:
        finding = by_metric.get(metric)
        text = _safe(cell(finding, metric)[0])
        loud = finding is not None and finding.judgement in ("worse", "better")
        cells.append(f"**{text}** {SIGNS[finding.judgement]}" if loud and finding else text)
    return f"| {' | '.join(cells)} |"


def _safe(text: str) -> str:
    """One line with the characters of Markdown and HTML escaped."""
    escaped = plain(" ".join(text.split())).replace("&", "&amp;").replace("<", "&lt;").replace(" -> ", " → ")
    return "".join(f"\\{c}" if c in "|*_`[]" else c for c in escaped)


def as_json(comparison: Comparison) -> str:
    """One JSON object with a finding per metric and case."""
    content = {
        "base": comparison.base,
        "new": comparison.new,
        "worse": comparison.worse,
        "by_numbers": comparison.by_numbers,
        "by_status": comparison.by_status,
        "counts": comparison.counts,
        "notes": list(comparison.notes),
        "findings": [_finding(finding) for finding in comparison.findings],
    }
    return json.dumps(clean(content), allow_nan=False) + "\n"


def _finding(finding: Finding) -> dict[str, Any]:
    problem, route = names(finding.case)
    named = {"problem": problem, "route": route, "at": finding.case["at"]}
    return named | {name: getattr(finding, name) for name in FIELDS}
