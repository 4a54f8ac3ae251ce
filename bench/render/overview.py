"""What the store holds at a glance, what failed and why, and the machines it ran on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import ANSWERED, ENVIRONMENTS, STATUSES
from gradient_routes.bench.execution.isolation.stack import without
from gradient_routes.bench.render.figure import Figure, Note, Section, Table
from gradient_routes.bench.render.format import cost, number
from gradient_routes.bench.render.picking import doubt, grouped, in_order, tabulate, text
from gradient_routes.bench.render.source import Source, schema


def section(source: Source) -> Section:
    cases = source.cases
    counts = source.counts
    of_studies = Counter(row["study"] for row in source.studies if row["status"] == "ok")
    facts = (
        (
            str(counts.cases),
            f"{_plural(counts.cases, 'case')}: " + ", ".join(_counts(counts.status)) if cases else "cases",
        ),
        (str(counts.problems), "problems, options apart"),
        (str(counts.routes), "routes"),
        (str(sum(of_studies.values())), "studies" + _listed(of_studies)),
        (str(len(source.environments)), _plural(len(source.environments), "environment")),
    )
    newest = "" if source.kept == counts.cases else f"The newest of {source.kept} runs of {counts.cases} cases."
    says = " ".join(filter(None, (newest, source.thinned, source.note and f"{source.note}.")))
    figures = (matrix(cases),) if cases else ()
    return Section("overview", "At a glance", says, figures, facts)


def _plural(count: int, noun: str) -> str:
    return noun if count == 1 else f"{noun}s"


def _counts(counted: Counter[str]) -> list[str]:
    return [f"{counted[status]} {status}" for status in STATUSES if counted[status]]


def _listed(of: Counter[str]) -> str:
    return ": " + ", ".join(f"{count} {name}" for name, count in of.most_common()) if of else ""


def matrix(cases: Sequence[Row]) -> Figure:
    """Problems down, routes across: what one gradient costs and how wrong it is, or why there is none."""
    routes = in_order(row["by"] for row in cases)
    rows = []
    for of in grouped(cases, lambda row: str(row["problem"])).values():
        cells: dict[str, list[str]] = {}
        for row in of:
            cells.setdefault(row["by"], []).append(_cell(row))
        row = {name: of[0][name] for name in ("problem", "n_state", "n_param")}
        rows.append(row | {name: " | ".join(found) for name, found in cells.items()})
    known = schema("cases")
    columns = [known[name] for name in ("problem", "n_state", "n_param")] + [text(name) for name in routes]
    return Figure(
        "matrix",
        "Every problem by every route",
        "Cost of one gradient / forward solve, and its relative error; or what became of the case. ~: the time is"
        " noisy; unresolved: the cost came out less than the forward solves that it contains.",
        Table.of(columns, rows),
    )


def _cell(row: Row) -> str:
    if row["status"] != "ok":
        return str(row["status"])
    said = cost(row)
    if row["forward_ratio"] is not None:
        said = f"{'~' if doubt(row) else ''}{said}×"
    return f"{said or 'ok'} · {number(row['gradient_error'], 1) or '?'}"


def failures(source: Source) -> Section | None:
    """Every case that gave no gradient, and every study that was ended."""
    rows = [row for row in source.cases if row["status"] != "ok"]
    rows = sorted(rows, key=lambda row: row["status"] in ANSWERED)
    ended = [row for row in source.studies if row["status"] not in ("ok", None)]
    if not rows and not ended:
        return None
    figures = []
    if rows:
        counted = ", ".join(_counts(source.counts.status - Counter({"ok": source.counts.cases})))
        table = tabulate("cases", rows, "problem route status reason predicted_s budget_s timeout_s host started")
        figures.append(Figure("failures", "Cases without a gradient", f"{counted}. {source.thinned}".rstrip(), table))
    if ended:
        says = f"{len(ended)} ended before they were done."
        table = tabulate("studies", ended, "study status reason started")
        figures.append(Figure("ended", "Studies that ended early", says, table))
    notes = tuple(_note(row) for row in rows if row["stderr"] or row["traceback"])
    notes += tuple(_ended(row) for row in ended if row["stderr"])
    says = "Nothing is dropped: skipped and pruned by rule, stopped by a limit, or wrong."
    return Section("failures", "What failed, and why", says, tuple(figures), notes=notes)


def _note(row: Row) -> Note:
    words = (("stderr", without(row["stderr"] or "")), ("traceback", row["traceback"] or ""))
    says = f"{row['status']}: {row['reason'] or ''}"
    return Note(f"{row['route']} on {row['problem']}", says, row["problem"], row["route"], _spoken(words))


def _ended(row: Row) -> Note:
    says = f"{row['status']}: {row['reason'] or ''}"
    return Note(f"study {row['study']}", says, "", "", _spoken((("stderr", without(row["stderr"])),)))


def _spoken(words: tuple[tuple[str, str], ...]) -> tuple[tuple[str, str], ...]:
    return tuple((heading, text) for heading, text in words if text.strip())


def environments(source: Source) -> Section | None:
    if not source.environments:
        return None
    ran = source.counts.environments
    rows = [
        row
        | {name: ", ".join(f"{k} {v}" for k, v in (row[name] or {}).items() if v) for name in ("threads", "versions")}
        | {"cases": ran[row["environment_id"]]}
        for row in source.environments
    ]
    several = len(rows) > 1
    says = "Seconds of different environments are not to be compared; ratios to forward solves are." if several else ""
    names = " ".join(column.name for column in ENVIRONMENTS)
    table = tabulate("environments", rows, f"cases {names}", (text("cases", "cases here that ran on it"),))
    return Section(
        "environments", "Where it ran", says, (Figure("machines", "Machines and their settings", "", table),)
    )
