"""Laws of growth as a person reads them: n^1.02 +- 0.03 of what is measured, 2 n + 1 of what is counted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.table import Table
from rich.text import Text

from gradient_routes.bench.render.format import bytes_, number, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.studies.scaling.measure import WORK, Growth, Scaling
from gradient_routes.bench.studies.scaling.power_law import OVERHEAD

MEASURED = {
    "seconds": "time",
    "peak_bytes": "memory",
    "tape_bytes": "tape",
    "factor_bytes": "factors",
    "iterations": "iterations",
}
SHORT = dict(zip(WORK, ("fwd", "fac", "sub", "mv", "again"), strict=True))
LAWS = (
    "+-: 95 % confidence by Student's t, wide where sizes are few (--growth 2 gives more); without +-: exact counts\n"
    f"over: overhead, fitted along and taken away; sizes: those where it is below {100 * OVERHEAD:.0f} %\n"
    "work: fwd forward solves, fac factorizations, sub substitutions, mv products with R_u, again steps marched again"
)
Cells = tuple[str, str, str, str]


def table(done: Scaling) -> Table:
    """Under the line of each route: time, memory and what else it has, then its work, each in n_u, n_p or k."""
    out = tables.columns(("route\n  quantity", 14), ("grows as", 34), "over", ("sizes", 18))
    for growths in _by_route([one for one in done.growths if one.most is not None]):
        first = growths[0]
        title = tables.named("route", {"route": first.route, "route_options": first.route_options})
        over = " over iterations" if first.against == "iterations" else ""
        out.add_row(Text(title + over, style=route_style(first.route)))
        for cells in _rows(growths, symbols(done)):
            out.add_row(*(Text(cell) for cell in cells))
    return out


def _by_route(growths: Sequence[Growth]) -> list[list[Growth]]:
    found: dict[tuple[str, str, bool], list[Growth]] = {}
    for one in growths:
        found.setdefault((one.route, repr(one.route_options), one.against == "iterations"), []).append(one)
    return list(found.values())


def symbols(done: Scaling) -> dict[str, str]:
    """n where n_u and n_p are one number."""
    same = all(row["n_state"] == row["n_param"] for row in done.rows if row["n_state"] is not None)
    return {"n_state": "n" if same else "n_u", "n_param": "n_p", "steps": "T", "iterations": "k"}


def legend(done: Scaling) -> str:
    """What n is, and what cannot be told apart because it grows together."""
    over = {one.against for one in done.growths}
    sizes = {(row["n_state"], row["n_param"]) for row in done.rows if row["n_state"] and row["n_param"]}
    parts = []
    if {"n_state", "n_param"} <= over:
        parts.append("n_u and n_p grow together: a law in one of them is that in the other, seen differently")
    elif "n_state" in over and symbols(done)["n_state"] == "n":
        parts.append("n = n_u = n_p, which grow as one: a law in n is one in both")
    elif "n_state" in over and len({n_p for _, n_p in sizes}) > 1:
        n_u, n_p = next(iter(sizes))
        parts.append(f"n_p = {n_p / n_u:.3g} n_u: exponents in both are the same")
    if "iterations" in over:
        parts.append("k iterations, of all Newton steps together")
    return "\n".join([*parts, LAWS])


def _rows(growths: Sequence[Growth], symbol: dict[str, str]) -> Iterator[Cells]:
    for quantity, title in MEASURED.items():
        of = [one for one in growths if one.quantity == quantity and one.fit.exponent != 0.0]
        if of:
            fitted = [one for one in of if one.fit.law is not None] or of[:1]
            yield f"  {title}", ", ".join(_law(one, symbol) for one in fitted), *_where(fitted[0])
    work = ", ".join(filter(None, (_counts(growths, kind, symbol) for kind in WORK)))
    if work:
        yield "  work", work, "", ""


def _law(one: Growth, symbol: dict[str, str]) -> str:
    fit, x = one.fit, symbol[one.against]
    if fit.law is None:
        return f"no exponent: {fit.no_law}"
    if fit.law == "affine":
        return affine(fit.prefactor or 0.0, fit.constant or 0.0, x)
    within = (fit.exponent_high or 0.0) - (fit.exponent or 0.0)
    return f"{x}^{fit.exponent:.2f} +- {within:.2f}" if within >= 0.005 else f"{x}^{fit.exponent:.4f} +- {within:.1g}"


def affine(slope: float, constant: float, x: str) -> str:
    """`2 n + 1`, `n`, `3`."""
    if slope == 0.0:
        return number(constant, 6)
    line = x if slope == 1.0 else f"{slope:.4g} {x}"
    return line if constant == 0.0 else f"{line} {'+' if constant > 0 else '-'} {abs(constant):.4g}"


def _where(one: Growth) -> tuple[str, str]:
    fit = one.fit
    if fit.fitted_from is None:
        return _overhead(one), ""
    name = "k" if one.against == "iterations" else "sizes"
    return "" if fit.law == "affine" else _overhead(
        one
    ), f"{fit.points} {name}, {fit.fitted_from:.0f} to {fit.fitted_to:.0f}"


def _overhead(one: Growth) -> str:
    constant = one.fit.constant
    if not constant:
        return ""
    return seconds(constant) if one.quantity == "seconds" else bytes_(constant)


def _counts(growths: Sequence[Growth], kind: str, symbol: dict[str, str]) -> str:
    """A kind of work over what it follows exactly; else by a law that sees it grow; else how much there was."""
    of = [one for one in growths if one.quantity == kind]
    lawful = [one for one in of if one.fit.law == "affine"] or [
        one for one in of if (one.fit.exponent_low or 0.0) > 0.0
    ]
    if lawful:
        return f"{_law(lawful[0], symbol)} {SHORT[kind]}"
    if not of:
        return ""
    low, high = of[0].least, of[0].most
    return f"{number(low, 6)} {SHORT[kind]}" if low == high else f"{number(low, 6)} to {number(high, 6)} {SHORT[kind]}"
