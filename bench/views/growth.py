"""Laws of growth as a person reads them: time ~ n^1.02 +- 0.03, 9 fwd = n + 1."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.table import Table
from rich.text import Text

from bench.studies.power_law import OVERHEAD
from bench.studies.scaling import WORK, Growth, Scaling
from bench.views import tables
from bench.views.format import bytes_, number, seconds
from bench.views.palette import route_style

MEASURED = {
    "seconds": "time",
    "peak_bytes": "memory",
    "tape_bytes": "tape",
    "factor_bytes": "factors",
    "iterations": "iterations",
}
SHORT = dict(zip(WORK, ("fwd", "fac", "sub", "mv"), strict=True))
LAWS = (
    "+-: 95 % confidence by Student's t, wide where sizes are few; over: overhead, fitted along and taken away; sizes:"
    f" those where it is below {100 * OVERHEAD:.0f} %\nwithout +-: exact counts; work: fwd forward solves, fac"
    " factorizations, sub substitutions, mv products with R_u"
)


def table(done: Scaling) -> Table:
    """Under the line of each route: time, memory and what else it has, then its work, each in n_u, n_p or k."""
    out = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    out.add_column("route\n  quantity", min_width=14, overflow="fold")
    out.add_column("grows as", overflow="fold", min_width=24)
    out.add_column("over", justify="right", no_wrap=True)
    out.add_column("sizes", overflow="fold", min_width=16)
    for (route, _, iterated), of in _by_route(done.growths).items():
        suffix = " over iterations" if iterated else ""
        title = tables.named("route", {"route": route, "route_options": of[0].route_options})
        out.add_row(Text(f"{title}{suffix}", style=route_style(route)))
        for cells in _rows(of, symbols(done)):
            out.add_row(*(Text(cell) for cell in cells))
    return out


def _by_route(growths: Sequence[Growth]) -> dict[tuple[str, str, bool], list[Growth]]:
    found: dict[tuple[str, str, bool], list[Growth]] = {}
    for one in growths:
        found.setdefault((one.route, repr(one.route_options), one.against == "iterations"), []).append(one)
    return found


def symbols(done: Scaling) -> dict[str, str]:
    """n where n_u and n_p are one number."""
    same = all(row["n_state"] == row["n_param"] for row in done.rows if row["n_state"] is not None)
    return {"n_state": "n" if same else "n_u", "n_param": "n_p", "iterations": "k"}


def legend(done: Scaling) -> str:
    """What n is, and that exponents in n_u and in n_p are one and the same finding where both grow."""
    over = {one.against for one in done.growths}
    grown = [row for row in done.rows if row["n_state"] and row["n_param"]]
    parts = []
    if symbols(done)["n_state"] == "n" and "n_state" in over:
        parts.append("n = n_u = n_p, which grow as one: nothing is said about one of them alone")
    elif {"n_state", "n_param"} <= over:
        parts.append("n_u and n_p grow together: exponents in one are those in the other seen differently")
    elif "n_state" in over and len({row["n_param"] for row in grown}) > 1:
        times = grown[0]["n_param"] / grown[0]["n_state"]
        parts.append(f"n_p = {times:.3g} n_u: exponents in both are the same")
    if "iterations" in over:
        parts.append("k iterations, of all Newton steps together")
    return "\n".join([*parts, LAWS])


def _rows(growths: Sequence[Growth], symbol: dict[str, str]) -> Iterator[tuple[str, ...]]:
    for quantity, title in MEASURED.items():
        of = [one for one in growths if one.quantity == quantity and one.fit.exponent != 0.0]
        if of:
            yield (f"  {title}", ", ".join(dict.fromkeys(_law(one, symbol) for one in of)), *_where(of[0]))
    work = ", ".join(filter(None, (_counts(growths, kind, symbol) for kind in WORK)))
    if work:
        yield f"  {'work'}", work, "", ""


def _law(one: Growth, symbol: dict[str, str]) -> str:
    fit, x = one.fit, symbol[one.against]
    if fit.law is None:
        return f"no exponent: {fit.no_law}"
    if fit.law == "affine":
        return affine(fit.prefactor or 0.0, fit.constant or 0.0, x)
    within = (fit.exponent_high or 0.0) - (fit.exponent or 0.0)
    return f"{x}^{fit.exponent:.2f} +- {within:.1g}" if within < 0.095 else f"{x}^{fit.exponent:.2f} +- {within:.2f}"


def affine(slope: float, constant: float, x: str) -> str:
    """`2 n + 1`, `n`, `3`."""
    if slope == 0.0:
        return number(constant, 6)
    line = x if slope == 1.0 else f"{slope:.4g} {x}"
    return line if constant == 0.0 else f"{line} {'+' if constant > 0 else '-'} {abs(constant):.4g}"


def _where(one: Growth) -> tuple[str, str]:
    fit = one.fit
    if fit.law is None or fit.fitted_from is None:
        return _amount(one), ""
    counted = f"{fit.points} sizes" if one.against != "iterations" else f"{fit.points} k"
    over = "" if fit.law == "affine" else _amount(one)
    return over, f"{counted}, {fit.fitted_from:.0f} to {fit.fitted_to:.0f}"


def _amount(one: Growth) -> str:
    if not one.fit.constant:
        return ""
    return seconds(one.fit.constant) if one.quantity == "seconds" else bytes_(one.fit.constant)


def _counts(growths: Sequence[Growth], kind: str, symbol: dict[str, str]) -> str:
    """One kind of work over what it follows exactly, if anything."""
    of = [one for one in growths if one.quantity == kind]
    if not of:
        return ""
    exact = next((one for one in of if one.fit.law == "affine"), None)
    if exact is not None:
        return f"{_law(exact, symbol)} {SHORT[kind]}"
    return f"{SHORT[kind]} {' or '.join(dict.fromkeys(_law(one, symbol) for one in of))}"
