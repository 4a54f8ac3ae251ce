"""What the data can say, for a terminal: spectra with the noise, parameters one by one, experiments, sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.format import number
from gradient_routes.bench.render.terminal import tables
from gradient_routes.bench.render.terminal.plot import Series, marks, plot
from gradient_routes.bench.studies.identify.identifiability import Identified
from gradient_routes.bench.studies.identify.measure import Determined
from gradient_routes.bench.studies.identify.placement import Placement

WIDEST = 100  # columns of a plot
KINDS = {"seen": "#", "weak": "-", "blind": "o"}
STYLES = {"seen": "", "weak": "yellow", "blind": "dim"}
LEGEND = (
    "|H e|: what a natural change of the parameter does to the data; blind: exactly nothing, weak: less than the noise"
    "\nnull share: of the parameter in directions that are not identifiable; sd: after the data, Gaussian,"
    " none where unbounded"
)


def show(out: Console, done: Determined, plotted: bool = True) -> None:
    found, rows, placement = done.experiments, done.tables, done.placement
    first = found[0]
    wrap = not out.is_terminal
    if plotted:
        out.print(spectra(found, min(out.width, WIDEST)))
        out.print()
    for line in says(first):
        out.print(line, soft_wrap=wrap)
    if _in_a_row(first):
        out.print(elements(first, out.width), soft_wrap=wrap)
    out.print()
    tables.show(out, parameters(first, [row for row in rows["identified"] if row["experiment"] == first.spec.selector]))
    out.print(Text(LEGEND, style="dim"), soft_wrap=wrap)
    if len(found) > 1:
        out.print()
        tables.show(out, experiments(rows["experiments"]))
        out.print(Text(bought(rows["experiments"])), soft_wrap=wrap)
    if placement is not None:
        out.print()
        tables.show(out, proposal(placement, rows["placement"]))
        for note in placement.notes:
            out.print(Text(note, style="dim"), soft_wrap=wrap)


def spectra(found: Sequence[Identified], width: int) -> Text:
    """Singular values against their number, and the noise as a line."""
    names = [one.spec.selector for one in found]
    longest = max(len(one.svd.s) for one in found)
    series = [
        Series(name, [float(k) for k in range(1, 1 + len(one.svd.s))], one.svd.s.tolist(), mark)
        for name, one, mark in zip(names, found, marks(names), strict=True)
    ]
    across = [longest ** (i / width) for i in range(width + 1)]
    noises = sorted({one.sigma for one in found if one.sigma})
    series += [Series(f"noise {noise:.2g}", across, [noise] * len(across), "-", "dim") for noise in noises]
    return plot(series, "k", f"{names[0]}: singular values of H", width)


def says(one: Identified) -> Iterator[Text]:
    """The rank in a sentence, and what must be read beside it."""
    kinds, n_p = one.kinds, len(one.state.p)
    least = "" if one.complete else "at least "
    weight = one.products.seen.weight
    weighted = "" if weight == 1.0 else f" ({one.sigma / weight:.2g} of a reading, weighted as in J)"
    above_rounding = one.sigma and one.threshold == one.sigma
    floor = f"noise {one.sigma:.2g}{weighted}" if above_rounding else f"rounding {one.threshold:.2g}"
    counts = ", ".join(f"{int((kinds == kind).sum())} {kind}" for kind in KINDS)
    ratio = f"; singular values {one.svd.s[0]:.3g} to {one.svd.s[-1]:.2g}" if len(one.svd.s) else ""
    yield Text.assemble(
        (one.spec.selector, "bold"),
        f": {least}{one.rank} of {n_p} directions identifiable from {one.data} data, above the {floor}{ratio};"
        f" parameters: {counts}",
    )
    for note in one.notes:
        yield Text(f"note: {note}", style="dim")


def _in_a_row(one: Identified) -> bool:
    x = one.problem.parameters.position
    return x is not None and x.shape[1] == 1


def elements(one: Identified, width: int) -> Text:
    """One mark an element; where there are more than columns, runs of a kind by number."""
    kinds = one.kinds
    text = Text("elements ")
    if len(kinds) <= width - len("elements "):
        for kind in kinds:
            text.append(KINDS[kind], style=STYLES[kind])
    else:
        ends = [i for i in range(1, len(kinds)) if kinds[i] != kinds[i - 1]]
        runs = zip([0, *ends], [*ends, len(kinds)], strict=True)
        text.append(", ".join(f"{start + 1}..{end} {kinds[start]}" for start, end in [*runs][: tables.LONGEST]))
    return text.append("   " + ", ".join(f"{mark} {kind}" for kind, mark in KINDS.items()), style="dim")


def parameters(one: Identified, rows: Sequence[Row]) -> Table:
    """One line a parameter, both ends where there are many."""
    axes = [axis for axis in "xyz" if rows[0][axis] is not None]
    prior = any(row["prior_sd"] is not None for row in rows)
    before = ["sd before"] if prior else []
    out = tables.columns(("p", None), *axes, "|H e|", "null share", "sd", *before, ("", None))
    n = len(rows)
    for i in tables.ends(n):
        if i is None:
            out.add_row(tables.left_out(n), style="dim")
            continue
        row = rows[i]
        cells = [number(row[axis]) for axis in axes]
        cells += [number(row["column_norm"]), f"{row['null_share']:.2f}", number(row["posterior_sd"])]
        cells += [number(row["prior_sd"])] if prior else []
        kind = row["kind"]
        label = Text(f"{row['parameter']} [{one.problem.parameters.unit_of(i)}]")
        out.add_row(label, *cells, "" if kind == "seen" else kind, style=STYLES[kind] or None)
    return out


def experiments(rows: Sequence[Row]) -> Table:
    """One line an experiment, the first being what the others are compared with."""
    out = tables.columns(("experiment", 14), "data", "n_p", "noise", "rank", "blind", "weak", "gained")
    for row in rows:
        cells = [str(row["data"]), str(row["n_param"]), number(row["sigma"], 2)]
        cells += [str(row[name]) for name in ("rank", "blind", "weak")]
        out.add_row(Text(row["experiment"]), *cells, "" if row is rows[0] else f"{row['gained']:+d}")
    return out


def bought(rows: Sequence[Row]) -> str:
    """Which change buys most, and which lets the data depend on more."""
    first, others = rows[0], rows[1:]
    most = max(row["gained"] for row in others)
    best = [row["experiment"] for row in others if row["gained"] == most]
    said = "no change makes more directions identifiable"
    if most > 0:
        said = f"{' and '.join(best)} {'buys' if len(best) == 1 else 'buy'} most: {most} more identifiable directions"
    fewer = [(row["experiment"], first["blind"] - row["blind"]) for row in others if row["blind"] < first["blind"]]
    return "; ".join([said, *(f"{name} leaves {count} fewer blind" for name, count in fewer)])


def proposal(placement: Placement, rows: Sequence[Row]) -> Table:
    """The sensors in the order they were chosen."""
    what = "log det(I + H Gamma H^T)" if placement.criterion == "D" else "trace of the covariance"
    out = tables.columns("step", ("sensor", None), what, "rank")
    out.title = Text(f"{len(rows)} of {placement.candidates} sensors, {placement.criterion}-optimal one by one")
    out.title_justify, out.title_style = "left", "bold"
    out.add_row("0", "", number(placement.before, 4), "", style="dim")
    for row in rows:
        out.add_row(str(row["step"]), Text(row["sensor"]), number(row["value"], 4), str(row["rank"]))
    return out
