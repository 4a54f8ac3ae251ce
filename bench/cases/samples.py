"""Samples of a timing."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median, quantiles

LEAST = 5  # rounds, where --min-time asks for any repeats at all
SPREAD = 0.10  # of the median, between the quartiles: beyond, a timing is not to be relied upon
WAITED = 1.25  # wall time over CPU time: a call that took longer waited for a processor, or for something else


@dataclass(frozen=True)
class Elapsed:
    """Seconds of one call: wall time, and CPU time of all threads and of child processes that have ended."""

    wall: float
    cpu: float

    @property
    def busy(self) -> bool:
        """Whether the call waited, as it does on a loaded machine."""
        return self.wall > WAITED * self.cpu


def impossible(ratio: float, floor: float) -> bool:
    """Whether a gradient came out cheaper than what its counted work contains, `floor` forward solves: by more than
    SPREAD, or than one forward solve at all.
    """
    return ratio < (max(1.0, (1.0 - SPREAD) * floor) if floor > 1.0 else floor)


@dataclass(frozen=True)
class Samples:
    """Seconds of one call: each round's mean over `calls` gradients, and over forward solves."""

    gradient: tuple[float, ...]
    forward: tuple[float, ...]
    calls: int = 1

    @property
    def ratio(self) -> float:
        """Median of the rounds' quotients: what slows the machine down for a while slows both of a round down."""
        return median(g / f for g, f in zip(self.gradient, self.forward, strict=True))

    def resolved(self, floor: float) -> float | None:
        """The ratio; None where it is `impossible`."""
        return None if impossible(self.ratio, floor) else self.ratio

    @property
    def quartiles(self) -> tuple[float, float]:
        """Of the gradient's samples."""
        if len(self.gradient) < 2:
            return self.gradient[0], self.gradient[0]
        lower, _, upper = quantiles(self.gradient, n=4, method="inclusive")
        return lower, upper

    @property
    def unstable(self) -> bool | None:
        """Whether the quartiles are more than SPREAD of the median apart; None where too few to tell."""
        lower, upper = self.quartiles
        return None if len(self.gradient) < LEAST else upper - lower > SPREAD * median(self.gradient)
