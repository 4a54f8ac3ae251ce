"""The tables of a check as cells, the same in a terminal and in a report."""

from __future__ import annotations

from collections.abc import Iterator

from gradient_routes.bench.render.format import number
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.result import Check

HEADINGS = ("line", "result", "error", "+/-", "slopes", "floor", "at h")
LEGEND = (
    "error: |gradient - quotient|, +/-: its uncertainty, both relative to the whole gradient, with * to the component;"
    " slopes: of the quotient error over h, one-sided, central, round-off; floor: least quotient error, on a plateau"
    " without the plateau, at the step h relative to max(|p_i|, s_i)"
)


def rows(check: Check) -> Iterator[tuple[Reading, tuple[str, ...]]]:
    """Every line, one at a second point, then the tightened ones: the deciding one, or the worst that is left."""
    for reading in check.readings:
        yield reading, _cells(reading.name, reading)
    if check.elsewhere is not None:
        yield check.elsewhere, _cells(check.elsewhere.name, check.elsewhere)
    for t in check.tightened:
        reading = max(t.plateaus, key=lambda r: r.off, default=t.reading)
        yield reading, _cells(f"{reading.name}, tightened x {t.factor:g}", reading)


def _cells(name: str, reading: Reading) -> tuple[str, ...]:
    known = reading.level is not None
    slopes = (reading.one_sided.slope, reading.central.slope, reading.curve.roundoff)
    return (
        name,
        reading.says if known or reading.sampled else "not sampled",
        (number(reading.off, 2) + ("*" if reading.own_scale else "")) if known else "",
        number(reading.known_to, 2) if known else "",
        " ".join(number(s, 2) or "-" for s in slopes) if any(slopes) else "",
        number(reading.curve.floor, 2),
        number(reading.curve.best_step, 2),
    )
