"""What the page of an advice is made of: the job that computes it, and its HTML."""

from __future__ import annotations

import html
import json
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.bench.advice.advise import advise
from gradient_routes.bench.advice.answers import Answers
from gradient_routes.bench.advice.bill import bills
from gradient_routes.bench.advice.glossary import GLOSSARY
from gradient_routes.bench.advice.literature import SOURCES
from gradient_routes.bench.advice.wording import plain
from gradient_routes.bench.cases.row import as_json
from gradient_routes.bench.execution.cost_model import LEGEND, summary
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.lab.drawing import swatch
from gradient_routes.bench.lab.numbers import table
from gradient_routes.bench.lab.shell import Row
from gradient_routes.bench.render.format import ratio
from gradient_routes.bench.units import duration, size
from gradient_routes.routes.tally import Work

POINTS = 28  # of a curve, over nine decades of parameters


@dataclass(frozen=True)
class Curves:
    """Seconds over numbers of parameters n_p, by route; NaN where it is not possible."""

    n_p: list[int]
    seconds: dict[str, list[float]]


@dataclass(frozen=True)
class Advise:
    """`routes advise --json`, and the bills for other numbers of parameters."""

    answers: Answers
    name: str = "advise"

    def __call__(self, channel: Channel) -> None:
        channel.say(Row(json.loads(as_json(plain(advise(self.answers))))))
        n_p = np.unique(np.logspace(0, 9, POINTS).round().astype(int)).tolist()
        seconds: dict[str, list[float]] = {}
        for k, n in enumerate(n_p):
            for bill in bills(replace(self.answers, n_p=n)):
                least = seconds.setdefault(bill.route.name, [math.nan] * len(n_p))
                if bill.objection is None:
                    least[k] = min(bill.seconds, least[k]) if math.isfinite(least[k]) else bill.seconds
        channel.say(Curves(n_p, seconds))


def answer(advice: dict[str, Any]) -> str:
    """The recommended route and the reasons, each with its sources."""
    best = advice["routes"][0]
    reasons = "".join(
        f"<li>{html.escape(reason['text'])}{sources(reason['sources'])}</li>" for reason in advice["reasons"]
    )
    if advice["recommended"] is None:
        return f'<h2 class="bad">No route is possible</h2><ul>{reasons}</ul>'
    bill = (
        f"{duration(best['seconds'])}, {ratio(best['forward_ratio'])} forward solves: {summary(Work(**best['work']))}"
    )
    return f"<h2>{swatch(best['route'])}</h2><p>{bill}</p><ul>{reasons}</ul>"


def sources(keys: list[str]) -> str:
    """Links to what a statement cites."""
    links = ", ".join(f'<a href="{SOURCES[key].link}" rel="noopener">{html.escape(key)}</a>' for key in keys)
    return f" ({links})" if links else ""


def bill_table(advice: dict[str, Any]) -> str:
    """Every route, the best first; of those that are not possible, why."""
    head = ["route", "error", "time", "cost / forward solve", "work", "holds"]
    rows = [
        (
            swatch(row["route"]),
            f"{row['error']:.1g}",
            duration(row["seconds"]),
            ratio(row["forward_ratio"]),
            summary(Work(**row["work"])),
            size(row["held_bytes"]) if row["held_bytes"] else "",
        )
        for row in advice["routes"]
        if row["possible"]
    ]
    others = [f"{row['route']}: {row['reason']}" for row in advice["routes"] if not row["possible"]]
    not_possible = "".join(f"<li>{html.escape(line)}</li>" for line in others)
    return (
        table(head, rows)
        + f'<p class="quiet">error: to be expected on a well-scaled problem; work: {html.escape(LEGEND)}</p>'
        + (
            f'<details><summary>not possible: {len(others)}</summary><ul class="quiet">{not_possible}</ul></details>'
            * bool(others)
        )
    )


def glossary() -> str:
    """The words, and the literature."""
    terms = "".join(
        f"<dt>{html.escape(t.name)}</dt><dd>{html.escape(t.meaning)}{sources([*t.sources])}</dd>" for t in GLOSSARY
    )
    books = "".join(f'<li><a href="{s.link}" rel="noopener">{html.escape(s.text)}</a></li>' for s in SOURCES.values())
    return (
        f"<details><summary>The words</summary><dl>{terms}</dl></details>"
        f"<details><summary>The literature</summary><ul>{books}</ul></details>"
    )
