"""The march into the noise: without regularization an iteration first fits the data, then their noise."""

from __future__ import annotations

from rich.text import Text

from gradient_routes.bench.inversion.result import Inversion
from gradient_routes.bench.render.terminal.plot import Series, plot


def into_noise(found: Inversion) -> bool:
    """Whether nothing but its end keeps an inversion from fitting noise that is known."""
    return found.alpha == 0.0 and found.iterates[-1].discrepancy is not None


def says(found: Inversion) -> str | None:
    """What came after the iterate where the data are met to their noise; None where there is none or it is the last."""
    met, last = next((step for step in found.iterates if step.chosen), None), found.iterates[-1]
    if not into_noise(found) or met is None or met is last:
        return None
    said = (
        f"the data are met to their noise after {met.iteration} of {last.iteration} iterations, what follows fits noise"
    )
    if met.distance is None or last.distance is None:
        return f"{said}: --stop-at-noise ends there, alpha= weighs it down"
    return f"{said}: off goes from {met.distance:.3g} to {last.distance:.3g}"


def march(found: Inversion, width: int) -> Text:
    """Misfit over noise and the distance to the truth, against iterations; where the discrepancy principle stops."""
    steps = found.iterates[1:]  # an axis of logarithms has no place for the start
    k = [float(step.iteration) for step in steps]
    stops = [(float(step.iteration), step.discrepancy) for step in steps if step.chosen]
    drawn = [
        Series("misfit / noise", k, [step.discrepancy for step in steps], "n"),
        Series("off: |p - p_true| / |p_0 - p_true|", k, [step.distance for step in steps], "o"),
        Series("discrepancy principle", [x for x, _ in stops], [y for _, y in stops], "D"),
    ]
    return plot([series for series in drawn if series.points], "iterations", "into the noise", width)
