"""The table of misjudgements, and the list of boxes that were misjudged."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from benchmarks.boxes.judging import Judged, misjudged

COLUMNS: dict[str, Callable[[Judged], bool]] = {
    "checked": lambda judged: True,
    "acquitted": lambda judged: judged.fault == "acquitted",
    "convicted": lambda judged: judged.fault == "convicted",
    "named": lambda judged: bool(judged.named),
    "open": lambda judged: judged.fault == "open",
    "other": lambda judged: judged.fault == "other",
}
MEANING = (
    "acquitted: told `agrees`, wrongly; convicted: sound, told wrong; named: right components named wrong;\n"
    "open: wrong, and one more point tells, yet no verdict of it; other: any other verdict that is not right"
)


def table(found: Sequence[Judged]) -> Table:
    """A line for every kind of box, and for every family of it with a misjudgement."""
    out = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    out.add_column("family", no_wrap=True)
    for column in COLUMNS:
        out.add_column(column, justify="right", no_wrap=True)
    for kind in dict.fromkeys(judged.kind for judged in found):
        of_kind = [judged for judged in found if judged.kind == kind]
        out.add_row(*_line(kind, of_kind), style="bold")
        for family in dict.fromkeys(judged.family for judged in misjudged(of_kind)):
            out.add_row(*_line(f"  {family}", [judged for judged in of_kind if judged.family == family]))
    out.add_row(*_line("all", found), style="bold")
    return out


def _line(name: str, found: Sequence[Judged]) -> Iterator[str]:
    yield name
    for number, holds in enumerate(COLUMNS.values()):
        count = sum(map(holds, found))
        yield str(count) if count or number == 0 else ""


def show(out: Console, found: Sequence[Judged]) -> None:
    """The table, totals, calls, and every misjudged box with its verdict and what is expected."""
    out.print(table(found))
    out.print(Text(MEANING, style="dim"))
    for truth in dict.fromkeys(judged.truth for judged in found):
        of = [judged for judged in found if judged.truth == truth]
        out.print(f"{truth}: {len(of)} checks, {sum(bool(judged.fault) for judged in of)} misjudged")
    for what, numbers in (
        ("J", [judged.calls for judged in found]),
        ("gradient", [judged.gradients for judged in found]),
    ):
        out.print(f"calls of {what}: mean {np.mean(numbers):.4g}, most {max(numbers)}")
    for judged in misjudged(found):
        what = judged.fault or "named"
        expected = " | ".join(judged.expect)
        named = f" named p_{', p_'.join(str(i + 1) for i in judged.named)};" if judged.named else ""
        line = f"{what} {judged.id}: {judged.verdict}, right: {expected};{named} {judged.says}"
        out.print(Text(line, style="red" if judged.fault == "acquitted" else ""), soft_wrap=True)


def write(found: Sequence[Judged], path: Path) -> None:
    """One object for every check."""
    rows = [asdict(judged) | {"id": judged.id, "fault": judged.fault} for judged in found]
    path.write_text(json.dumps(rows, indent=1) + "\n")
