"""Tables and their columns: declared once, read by the store, tables, CSV files, reports and the documentation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Row = dict[str, Any]


@dataclass(frozen=True)
class Column:
    """`type` is SQLite's; a `json` column is text in the store, an object in rows; `unit` is "1" for pure numbers."""

    name: str
    type: str
    unit: str
    meaning: str
    json: bool = False


@dataclass(frozen=True)
class Table:
    """Columns, and those of them that name the question: a report shows the newest answer to each."""

    columns: tuple[Column, ...]
    question: tuple[str, ...] = ("problem", "route")


# of what is named by code rather than by an entry point: see bench.cases.declared
DECLARED = "of a {} named by FILE.py:NAME or module:NAME: defaults of its options, its file and module; else NULL"


def declared(column: str, kind: str) -> Column:
    return Column(f"{column}_declared", "TEXT", "", DECLARED.format(kind), json=True)


# columns that several studies have
ESTIMATE = "what the solves leave in g, estimated: |g - g'|_2 / |g'|_2, g' of adjoint[correct=yes] from its state"
WHAT = (
    Column("problem", "TEXT", "", "selector of the problem, or whose code was checked"),
    Column("route", "TEXT", "", "selector of the route that gave the gradient; NULL for other people's code"),
    Column("at", "TEXT", "", "the p it was asked at: start, true, values or a file"),
)
PROBLEM = (
    Column("problem", "TEXT", "", "name of the problem"),
    Column("problem_options", "TEXT", "", "its options, defaults included", json=True),
    Column("at", "TEXT", "", "the p it was studied at: start, true, values or a file"),
    Column("n_state", "INTEGER", "1", "n_u, free unknowns"),
    Column("n_param", "INTEGER", "1", "n_p, parameters"),
)
JUDGED = (
    Column("status", "TEXT", "", "ok, skipped or failed"),
    Column("reason", "TEXT", "", "why it was skipped or failed"),
    Column("objective", "REAL", "problem's", "J"),
    Column("objective_error", "REAL", "1", "|J - J_ref| / |J_ref|, J_ref solved for directly to 1e-13"),
    Column("gradient_error", "REAL", "1", "|g - g_ref|_2 / |g_ref|_2, where judged in directions V: of V^T g"),
    Column("reference", "TEXT", "", "where g_ref comes from"),
    Column("gradient_error_estimate", "REAL", "1", ESTIMATE),
    Column("residual", "REAL", "1", "|R(u, p)|_inf / |R(u_0, p)|_inf achieved"),
)
PLACE = tuple(Column(axis, "REAL", "m", "where it lives") for axis in "xyz")
