"""Rows of `routes invert` as the columns of figures and tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.lab.numbers import number, table

NOTHING = float("nan")
SHOWN = {"E": "E", "strain": "eps[u]", "adjoint_strain": "eps[lam]"}  # column -> what `view` of a row calls it
HEAD = ("element", "truth", "estimate", "dJ/d log E", "strain of u", "strain of λ", "product")


def elements(estimates: Sequence[Row]) -> dict[str, list[Any]]:
    """Element by element; `product` is A L_e E_e eps_e(u) eps_e(lam), the share of the data in dJ/d log E_e."""
    views = [row["view"] for row in estimates]
    columns = {name: [view.get(called, NOTHING) for view in views] for name, called in SHOWN.items()}
    return {
        "e": [*range(1, len(estimates) + 1)],
        **{name: [row[name] for row in estimates] for name in ("estimate", "truth", "gradient")},
        **columns,
        "product": [view.get("E", NOTHING) * view.get("A L_e eps eps", NOTHING) for view in views],
        "blind": ["blind" if row["blind"] else "" for row in estimates],
        "hatch": ["right_diagonal_line" if row["blind"] else "blank" for row in estimates],
    }


def blind(estimates: Sequence[Row]) -> dict[str, list[float]]:
    """The strips of blind elements."""
    at = [e for e, row in enumerate(estimates, 1) if row["blind"]]
    return {"left": [e - 0.5 for e in at], "right": [e + 0.5 for e in at]}


def bars(estimates: Sequence[Row], trade: Row | None) -> dict[str, list[float]]:
    """A standard deviation on both sides of estimates where the command knows it, or of the mean of redrawn ones."""
    known = [row["sd"] for row in estimates] if trade is None else trade["sd"]
    centre = [row["estimate"] for row in estimates] if trade is None else trade["mean"]
    at = [k for k, sd in enumerate(known) if sd is not None]
    return {
        "e": [k + 1 for k in at],
        "centre": [centre[k] for k in at],
        "low": [centre[k] - known[k] for k in at],
        "high": [centre[k] + known[k] for k in at],
    }


def path(steps: Sequence[Row]) -> dict[str, list[float]]:
    """Misfit against solves, both kinds together; zeros have no place on a logarithmic axis."""
    seen = [row for row in steps if row["misfit"] > 0.0]
    return {
        "solves": [row["forward_solves"] + row["adjoint_solves"] for row in seen],
        **{name: [row[name] for row in seen] for name in ("misfit", "iteration", "forward_solves", "adjoint_solves")},
    }


def tradeoff(trades: Sequence[Row]) -> dict[str, list[float]]:
    """Bias, variance and their sum against alpha."""
    rows = sorted(trades, key=lambda row: float(row["alpha"]))
    return {name: [row[name] for row in rows] for name in ("alpha", "bias", "variance", "total")}


def nearest(trades: Sequence[Row], alpha: float) -> Row | None:
    """The row whose alpha is closest by its logarithm, the least for alpha = 0; None where there are no rows."""
    if not trades:
        return None
    return min(trades, key=lambda row: abs(math.log(row["alpha"] / alpha)) if alpha else row["alpha"])


def numbers(estimates: Sequence[Row], trade: Row | None) -> str:
    """The same as a table."""
    columns, spread = elements(estimates), bars(estimates, trade)
    order = ("truth", "estimate", "gradient", "strain", "adjoint_strain", "product")
    more = {} if trade is None else {"mean of draws": trade["mean"], "sd of draws": trade["sd"]}
    if trade is None and len(spread["e"]) == len(estimates):
        more = {"sd": [row["sd"] for row in estimates]}
    return table(
        [*HEAD, *more, ""],
        [
            [str(e), *map(number, row), mark]
            for e, *row, mark in zip(
                columns["e"], *(columns[name] for name in order), *more.values(), columns["blind"], strict=True
            )
        ],
    )


def meter(steps: Sequence[Row]) -> str:
    """What has been paid, and what for; as a list of terms."""
    last = steps[-1]
    ending, noise, off = last["ending_solves"], last["discrepancy"], last["distance"]
    told = {
        "forward solves": str(last["forward_solves"]),
        "adjoint solves": str(last["adjoint_solves"]),
        "to confirm the end": f"{ending or 0} forward",
        "iteration": str(last["iteration"]),
        "misfit [m²]": number(last["misfit"]),
        "α Φ": number(last["regularization"]),
        "|dJ/dp|": number(last["gradient_norm"]),
        **({} if noise is None else {"misfit / noise": number(noise)}),
        **({} if off is None else {"off (start: 1)": number(off)}),
    }
    terms = "".join(f"<div><dt>{name}</dt><dd>{value}</dd></div>" for name, value in told.items())
    return f'<dl class="meter">{terms}</dl>'
