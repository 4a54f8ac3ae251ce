"""An inversion for a terminal: iteration by iteration as it runs, then what it cost and what it found."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.inversion.history import Iterate
from gradient_routes.bench.inversion.linear_map import SUFFICES
from gradient_routes.bench.inversion.one_shot import OneShot
from gradient_routes.bench.inversion.optimizers import AT_NOISE
from gradient_routes.bench.inversion.result import Inversion
from gradient_routes.bench.render.format import number, seconds
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.palette import route_style
from gradient_routes.bench.render.terminal.plot import Series, marks, plot
from gradient_routes.bench.studies.invert import lcurve_view, march_view
from gradient_routes.bench.studies.invert.messages import (
    Begun,
    Compared,
    Ended,
    Framed,
    LCurve,
    Mapped,
    Taken,
    Trades,
)
from gradient_routes.problems.problem import Array

WIDEST = 100  # columns of a plot
WIDTHS = {"k": 4, "J": 9, "misfit": 9, "alpha Phi": 9, "|dJ/dp|": 9, "|step|": 8, "fwd": 4, "adj": 4, "time": 8}
HEADINGS = " ".join(name.rjust(width) for name, width in WIDTHS.items())
LEGEND = (
    "fwd, adj: forward solves, and linearized or transposed ones, so far; |step|: in natural changes of p;"
    " off: |p - p_true| / |p_0 - p_true|"
)
FIELD = 40  # parameters from which a field on a box is drawn
COORDINATES = ("x", "y", "z")
SAME = 1e-6  # of J
BARS, WIDE = 5, 9  # characters of the longest bar, and of a heading on one line


def show(out: Console, found: object, plots: bool = True) -> None:
    """What `routes invert` finds, as it comes."""
    width = min(out.width, WIDEST)
    match found:
        case Begun(title, truth, noise):
            out.print(title, style="bold", soft_wrap=not out.is_terminal)
            heading(out, truth, noise)
        case Taken(step, noise):
            line(out, step, noise)
        case Ended(inversion, one_shot):
            ended(out, inversion, one_shot)
        case Inversion() if out.is_terminal:
            out.print(lcurve_view.progress(found), style="dim")
        case Compared(inversions):
            out.print()
            if plots:
                out.print(history(inversions, width))
                if march_view.into_noise(inversions[-1]):
                    out.print(march_view.march(inversions[-1], width))
            tables.show(out, costs(inversions))
            tables.say(out, LEGEND, "dim")
            _estimates(out, inversions[-1])
        case LCurve(points, best):
            if plots:
                out.print(lcurve_view.curve(points, width))
            out.print(lcurve_view.table(points))
            for remark in lcurve_view.remarks(points):
                out.print(remark, soft_wrap=not out.is_terminal)
            out.print()
            _estimates(out, best)
        case Trades(trades):
            if plots:
                out.print(lcurve_view.trade_plot(trades, width))
            out.print(lcurve_view.trades(trades))
        case Mapped(inversion, by):
            _estimates(out, inversion)
            tables.say(out, by.described)
        case Framed(estimates_of_frames):
            tables.say(out, estimates_of_frames.described)
        case OneShot() | str():
            out.print(Text(str(found)), soft_wrap=not out.is_terminal)


def _estimates(out: Console, found: Inversion) -> None:
    out.print()
    tables.show(out, estimates(found))
    if found.fit is not None:
        style = "yellow" if found.unexplained else ""
        out.print(Text(found.fit.described), style=style, soft_wrap=not out.is_terminal)
    for remark in found.view.remarks:
        tables.say(out, remark)
    picture = cells(found)
    if picture:
        out.print(picture)


def heading(out: Console, truth: bool, noise: bool = False) -> None:
    names = HEADINGS.replace("alpha Phi", f"{'/ noise':>9}") if noise else HEADINGS
    out.print(Text(names + (f" {'off':>7}" if truth else ""), style="bold"))


def line(out: Console, step: Iterate, noise: bool = False) -> None:
    """One iteration, as soon as it is known; without Phi its column is the misfit against the noise."""
    fourth = step.discrepancy if noise and step.discrepancy is not None else step.regularization
    off = "" if step.distance is None else f" {step.distance:>7.3g}"
    text = (
        f"{step.iteration:>4} {step.objective:>9.4g} {step.misfit:>9.4g} {fourth:>9.3g}"
        f" {step.gradient_norm:>9.3g} {number(step.step_length) or '':>8} {step.forward_solves:>4}"
        f" {step.adjoint_solves:>4} {seconds(step.seconds):>8}{off}"
    )
    out.print(Text(text))
    if step.chosen:
        out.print(Text(f"     {step.chosen}: the data are met to their noise"))
    if step.says:
        out.print(Text(f"     {step.says}", style="yellow"), soft_wrap=not out.is_terminal)


def ended(out: Console, found: Inversion, one_shot: float | None = None) -> None:
    """Why it stopped, and how it stands to the one-shot answer."""
    well = found.end.startswith(("converged", AT_NOISE, SUFFICES))
    out.print(Text(found.end, style="" if well else "yellow"), soft_wrap=not out.is_terminal)
    for said in filter(None, (march_view.says(found), found.linear_regime)):
        out.print(Text(said), soft_wrap=not out.is_terminal)
    out.print(Text(found.scaled, style="dim"), soft_wrap=not out.is_terminal)
    if one_shot is not None:
        above = found.iterates[-1].objective / one_shot - 1.0 if one_shot > 0.0 else 0.0
        stands = (
            "goes below" if above < -SAME else "meets" if above <= SAME else "stays above"
        ) + " the one-shot answer"
        out.print(Text(f"the loop {stands}: J is {above:+.1e} of it away"), soft_wrap=not out.is_terminal)


def costs(done: Sequence[Inversion]) -> Table:
    """What it takes to reach a misfit, route by route: the number a user decides with."""
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    table.add_column("to reach a misfit of")
    for found in done:
        style = route_style(found.route)
        table.add_column(Text(found.label.partition(" by ")[2], style=style), justify="right")
    for level in levels(done):
        table.add_row(f"{level:.3g}", *(_cost(found, level) for found in done))
    return table


def levels(done: Sequence[Inversion]) -> list[float]:
    """Decades of the misfit from the start's down to the least that any reaches."""
    first = max(found.iterates[0].misfit for found in done)
    least = min(step.misfit for found in done for step in found.iterates)
    if not first > 0.0:
        return []
    decades = math.floor(math.log10(first / max(least, 1e-12 * first)))
    every = max(1, math.ceil(decades / 8))
    return [first * 10.0**-k for k in range(every, decades + 1, every)] or [least]


def _cost(found: Inversion, level: float) -> str:
    step = next((step for step in found.iterates if step.misfit <= level), None)
    if step is None:
        return "not reached"
    adjoint = f" + {step.adjoint_solves} adj" if step.adjoint_solves else ""
    return f"{step.forward_solves} fwd{adjoint}, {seconds(step.seconds)}"


def estimates(found: Inversion) -> Table:
    """Parameter by parameter: start, estimate, truth, the gradient that is left, beside it what the problem shows (of
    the bar the two strains it is the product of); blind ones hatched."""
    q, beside = found.made.parameters, {k: v for k, v in found.view.columns.items() if k not in COORDINATES}
    truth = [] if found.truth is None else ["truth"]
    two_lines = [
        " ".join(name.split()[:-2]) + "\n" + " ".join(name.split()[-2:]) if len(name) > WIDE else name
        for name in beside
    ]
    sd = [] if found.fit is None or np.isnan(found.fit.sd).all() else [found.fit.sd]
    bars = ["+-"] * len(sd)
    table = tables.columns(("p", None), "start", "estimate", *bars, *truth, "dJ/dp", *two_lines, ("", None))
    units = list(dict.fromkeys(map(q.unit_of, range(found.n_param))))
    table.title_justify, one = "left", units[0] if len(units) == 1 else None
    table.title = Text(f"{found.label}, p in {one}" if one else found.label, style="bold")
    n, largest = found.n_param, float(np.abs(found.p).max()) or 1.0
    for i in tables.ends(n):
        if i is None:
            table.add_row(tables.left_out(n), style="dim")
            continue
        hidden = found.view.blind is not None and bool(found.view.blind[i])
        values = [
            found.start[i],
            found.p[i],
            *(bar[i] for bar in sd),
            *([] if found.truth is None else [found.truth[i]]),
            found.gradient[i],
        ]
        values += [column[i] for column in beside.values()]
        bar = "blind" if hidden else "#" * round(BARS * abs(float(found.p[i])) / largest)
        label = q.label(i) if one else f"{q.label(i)} [{q.unit_of(i)}]"
        table.add_row(Text(label), *(f"{v:.4g}" for v in values), bar, style="dim" if hidden else None)
    return table


def cells(found: Inversion) -> Text:
    """The estimate of a field on a box in its middle slice, cell by cell, beside the truth; blind cells masked."""
    position, p = found.made.parameters.position, found.p
    if position is None or position.shape[1] != 3 or found.n_param < FIELD or not np.isfinite(p).all():
        return Text()
    middle = np.unique(position[:, 1].round(9))
    at = np.flatnonzero(np.isclose(position[:, 1], middle[len(middle) // 2]))
    if len(at) != len(np.unique(position[at, 0].round(9))) * len(np.unique(position[at, 2].round(9))):
        return Text()  # no grid, or several parameters in one place
    blind = found.view.blind
    masked = p if blind is None else np.where(blind, np.nan, p)
    shades = [("estimate", masked)] + ([] if found.truth is None else [("truth", found.truth)])
    low, high = (float(f(np.concatenate([v[at] for _, v in shades]))) for f in (np.nanmin, np.nanmax))
    pictures = [_picture(position[at][:, [0, 2]], values[at], low, high) for _, values in shades]
    width = max(map(len, pictures[0]))
    rows = ["  ".join(name.ljust(width) for name, _ in shades)]
    rows += ["  ".join(parts) for parts in zip(*pictures, strict=True)]
    y = middle[len(middle) // 2]
    mask = "" if blind is None or not blind.any() else ", / blind"
    return Text(f"slice y = {y:.3g}, x to the right, z up; ' ' {low:.3g} to '@' {high:.3g}{mask}\n" + "\n".join(rows))


def _picture(xz: Array, values: Array, low: float, high: float) -> list[str]:
    tones = " .:-=+*#%@"
    xs, zs = (np.unique(xz[:, k].round(9)) for k in (0, 1))
    grid = np.full((len(zs), len(xs)), np.nan)
    grid[np.searchsorted(zs, xz[:, 1].round(9)), np.searchsorted(xs, xz[:, 0].round(9))] = values
    span = (high - low) or 1.0

    def tone(value: float) -> str:
        return "/" if not np.isfinite(value) else tones[min(len(tones) - 1, int((value - low) / span * len(tones)))]

    return ["".join(2 * tone(value) for value in row) for row in grid[::-1]]


def history(done: Sequence[Inversion], width: int) -> Text:
    """Misfit against forward solves, each route."""
    names = [found.label.partition(" by ")[2] for found in done]
    letters = marks([found.route for found in done])
    drawn = [
        Series(name, *_paid(found), mark, route_style(found.route))
        for name, mark, found in zip(names, letters, done, strict=True)
    ]
    return plot(drawn, "forward solves", "misfit", width)


def _paid(found: Inversion) -> tuple[list[float | None], list[float | None]]:
    return [step.forward_solves for step in found.iterates], [step.misfit for step in found.iterates]
