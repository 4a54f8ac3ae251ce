"""A kink for a person: the event in a sentence, routes on both sides of it, stencils over it, the curves."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.panel import panel
from gradient_routes.bench.render.terminal.tables import columns, show
from gradient_routes.bench.studies.kink.event import EXACT, NEAR, Kink, Slope, in_words
from gradient_routes.bench.studies.kink.rounding import Trade

WIDEST = 100  # columns of a plot
ROUNDED = 1.0 + 1e-9  # s is


def show_study(out: Console, found: tuple[str, Kink, Trade | None], plots: bool = True) -> None:
    """The selector of the problem, what was found on it, and what a rounded law costs where there is one."""
    problem, kink, trade = found
    show_kink(out, kink, problem, plots)
    if trade is not None:
        from gradient_routes.bench.studies.kink.rounding_view import show_trade

        show_trade(out, trade, plots)


def show_kink(out: Console, kink: Kink, problem: str, plots: bool = True) -> None:
    """The sentence first; then what it rests on."""
    wrap = not out.is_terminal
    out.print(Text.assemble((problem, "bold"), ": ", kink.says), soft_wrap=wrap)
    if kink.event is not None:
        if kink.routes:
            out.print()
            show(out, sides(kink))
        for line in judged(kink):
            out.print(Text(line), soft_wrap=wrap)
        out.print()
        show(out, stencils(kink))
        out.print(Text(over(kink)), soft_wrap=wrap)
        if plots:
            out.print()
            out.print(curves(kink, min(out.width, WIDEST)))
    elif kink.rounded and kink.routes:
        out.print()
        show(out, swept(kink))
    for line in remarks(kink):
        out.print(Text(line, style="dim"), soft_wrap=wrap)


def sides(kink: Kink) -> Table:
    """One row a route: dJ/ds just beside the event and how wrong the gradient is, there and over the sweep."""
    table = columns(("route", 14), "dJ/ds left", "dJ/ds right", "error left", "error right")
    table.add_column("worst in the sweep", justify="right", overflow="fold", min_width=8)
    for spec in kink.routes:
        left, right = (next(s for s in kink.on(side) if s.route == spec) for side in ("left", "right"))
        errors = [s.error for s in kink.slopes if s.route == spec and s.side is None and s.error is not None]
        cells = [_slope(left), _slope(right), _error(left), _error(right), number(max(errors, default=None), 2)]
        table.add_row(Text(spec.selector), *cells, style=route_style(spec.route.name))
    event = kink.event
    assert event is not None
    table.add_row("differences of J", number(event.left.backward, 6), number(event.right.forward, 6), style="dim")
    return table


def swept(kink: Kink) -> Table:
    """One row a route: dJ/ds at both ends of a sweep without event, and where its gradient is most wrong."""
    solved = [v for v in kink.visits if v.reason is None]
    ends = (solved[0], solved[-1])
    table = columns(("route", 14), *(f"dJ/ds at s = {v.s:g}" for v in ends), "worst in the sweep", "at s")
    for spec in kink.routes:
        of = {s.s: s for s in kink.slopes if s.route == spec}
        judged = [s for s in of.values() if s.error is not None]
        worst = max(judged, key=lambda s: s.error or 0.0, default=None)
        cells = [_slope(of[v.s]) for v in ends] + (
            ["unknown"] if worst is None else [number(worst.error, 2), f"{worst.s:.4g}"]
        )
        table.add_row(Text(spec.selector), *cells, style=route_style(spec.route.name))
    table.add_row("differences of J", *(number(q, 6) for q in (ends[0].forward, ends[1].backward)), style="dim")
    return table


def _slope(slope: Slope) -> str:
    if slope.slope is None:
        return "failed"
    return in_words(slope.slope, slope.size)


def _error(slope: Slope) -> str:
    return "" if slope.reason is not None else number(slope.error, 2) or "unknown"


def judged(kink: Kink) -> list[str]:
    """Who is exact on both branches, and who is not."""
    worst = {
        spec.selector: max(
            (s.error if s.error is not None else float("inf")) for s in kink.slopes if s.route == spec and s.side
        )
        for spec in kink.routes
    }
    references = dict.fromkeys(s.reference for s in kink.slopes if s.side and s.error is not None)
    exact = [name for name, error in worst.items() if error <= EXACT]
    others = [f"{name} ({error:.2g})" for name, error in worst.items() if EXACT < error < float("inf")]
    against = " and ".join(str(r) for r in references)
    lines = [f"exact on either branch, to {EXACT:.0e} against the {against}: {', '.join(exact)}"] if exact else []
    if others:
        lines.append(
            f"not exact beside the event, worst error: {', '.join(others)}; steps of differences reach over it"
        )
    return lines


def stencils(kink: Kink) -> Table:
    """Central quotients over the event at decreasing steps."""
    table = columns("h / s", "central quotient over it", "off the left", "off the right")
    for one in kink.stencils:
        cells = (f"{one.step:.0e}", number(one.quotient, 6), number(one.off_left, 3), number(one.off_right, 3))
        table.add_row(*cells) if one.reason is None else table.add_row(cells[0], "failed")
    return table


def over(kink: Kink) -> str:
    event = kink.event
    if event is None or event.jump is None or event.slope_left is None:
        return "which of the two they come near is not known"
    mean, half = event.slope_left + 0.5 * event.jump, abs(0.5 * event.jump)
    return f"no step helps: they tend to the mean of the two slopes, {mean:.6g}, which is {half:.6g} off either"


def curves(kink: Kink, width: int) -> Text:
    """J and dJ/ds over s near the event, marked by the first letter of the active set."""
    event = kink.event
    assert event is not None
    visits = [
        v
        for v in kink.visits
        if v.objective is not None and event.s / NEAR <= v.s * ROUNDED and v.s <= event.s * NEAR * ROUNDED
    ]
    visits = sorted([*visits, event.left, event.right], key=lambda v: v.s)
    shown = {v.s: str(v.active_set)[:1] for v in visits}
    J = [(v.s, v.objective, shown[v.s]) for v in visits if v.objective is not None]
    text = panel(J, f"J, {_marks(kink)}", "s", width, wall=event.s)
    best = next((spec for spec in kink.routes if spec.route.accuracy == 0.0), None)
    slopes = [s for s in kink.slopes if s.route == best and s.s in shown and s.slope is not None]
    if slopes:
        found = [(s.s, s.slope, shown[s.s]) for s in slopes if s.slope is not None]
        text.append("\n\n")
        text.append(panel(found, f"dJ/ds by {slopes[0].route.route.name}", "s", width, 13, event.s))
    return text


def _marks(kink: Kink) -> str:
    assert kink.event is not None
    names = [str(v.active_set) for v in (kink.event.left, kink.event.right)]
    return ", ".join(f"{name[:1]} {name}" for name in names)


def remarks(kink: Kink) -> list[str]:
    """Why routes and points are missing, each reason once a route."""
    lines = [f"skipped: {spec.selector}: {why}" for spec, why in kink.skipped]
    failed = [v for v in kink.visits if v.reason is not None]
    if failed:
        lines.append(f"failed: {len(failed)} of {len(kink.visits)} s, first {failed[0].s:g}: {failed[0].reason}")
    for spec in kink.routes:
        missing = [s for s in kink.slopes if s.route == spec and s.reason is not None]
        if missing:
            where = f"{len(missing)} s, first {missing[0].s:g}"
            lines.append(f"failed: {spec.selector} at {where}: {missing[0].reason}")
    return lines
