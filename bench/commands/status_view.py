"""The table of `routes status`: a row per problem, a column per route."""

from __future__ import annotations

from rich.text import Text

from gradient_routes.bench.cases import registry
from gradient_routes.bench.cases.row import ANSWERED
from gradient_routes.bench.render.terminal.tables import MOST, asked, ends, left_out
from gradient_routes.bench.render.terminal.text_table import TextTable
from gradient_routes.bench.store.status import Standing, counts


def matrix(standing: list[Standing]) -> TextTable:
    """A row per problem and settings, a column per route; variants of one route share a cell."""
    cells: dict[str, dict[str, list[Standing]]] = {}
    for each in standing:
        cells.setdefault(asked(each.row), {}).setdefault(each.row["route"], []).append(each)
    routes = sorted({each.row["route"] for each in standing}, key=registry.place)
    table = TextTable(["problem", *routes])
    rows = [*cells.items()]
    for k in ends(len(rows), MOST):
        if k is None:
            said = f"{left_out(len(rows), MOST)} problems; --json has all"
            table.row(Text(said, style="dim"), [Text("")] * len(routes))
            continue
        problem, found = rows[k]
        table.row(Text(problem), [_cell(found.get(route, [])) for route in routes])
    return table


def _cell(standing: list[Standing]) -> Text:
    if not standing:
        return Text("-", style="dim")
    words = standing[0].word if len(standing) == 1 else counts(standing)
    well = all(each.row["status"] in ANSWERED for each in standing)
    style = "bold red" if not well else "yellow" if any(each.aged for each in standing) else ""
    return Text(words, style=style)
