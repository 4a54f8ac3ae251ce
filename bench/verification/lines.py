"""The lines of a check as cells: one row a line, the same in a terminal and on a page."""

from __future__ import annotations

from collections.abc import Iterator

from gradient_routes.bench.render.format import number
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check

HEADINGS = ("line", "says", "off by", "known to", "slopes", "floor", "at h")
LEGEND = (
    "off by: |gradient - quotient|, known to: what quotients are uncertain by, both relative to the whole gradient,"
    " with * to the component itself; slopes: of the error over h, one-sided, central, round-off; floor: its least,"
    " about the plateau where there is one, at h relative to max(|p_i|, s_i)"
)


def rows(check: Check) -> Iterator[tuple[Reading, tuple[str, ...]]]:
    """Every line, then the tightened ones."""
    for reading in check.readings:
        yield reading, _cells(reading.sweep.line.name, reading)
    for t in check.tightened:
        yield t.reading, _cells(f"{t.reading.sweep.line.name}, tightened x {t.factor:g}", t.reading)


def _cells(name: str, reading: Reading) -> tuple[str, ...]:
    known = reading.level is not None
    curve = reading.central if reading.sweep.two_sided else reading.one_sided
    slopes = (reading.one_sided.slope, reading.central.slope, curve.roundoff)
    return (
        name,
        "not looked at" if not known and not reading.looked_at else reading.says,
        (number(reading.off, 2) + ("*" if reading.own_scale else "")) if known else "",
        number(reading.known_to, 2) if known else "",
        " ".join(number(s, 2) or "-" for s in slopes) if any(slopes) else "",
        number(curve.floor, 2),
        number(curve.best_step, 2),
    )
