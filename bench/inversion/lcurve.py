"""How much regularization: the L-curve (Hansen 1992), its corner, and the discrepancy principle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.bench.inversion.objective import noise_level
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

BENT = 3  # points that a curvature needs
STILL = 1e-2  # of log misfit and log Phi together: no way to go on the curve
CLOSE = 0.02  # |S u - d| relative to that of the noise, up to which it is the same


@dataclass(frozen=True)
class Point:
    """The minimum of J at one alpha. Fields are columns of its table."""

    inversion: Inversion
    misfit: float
    phi: float
    curvature: float | None
    discrepancy: float | None
    chosen: str | None = None

    @property
    def converged(self) -> bool:
        """Whether it is a minimum, to the tolerance or to rounding; the curve consists of minima."""
        return self.inversion.end.startswith("converged")

    @property
    def meets_noise(self) -> bool:
        return self.converged and self.discrepancy is not None and self.discrepancy <= 1.0 + CLOSE

    @property
    def row(self) -> Row:
        last = self.inversion.iterates[-1]
        own = {name: getattr(self, name) for name in ("misfit", "phi", "curvature", "discrepancy", "chosen")}
        counts = {"iterations": last.iteration, "forward_solves": self.inversion.forward_solves}
        return self.inversion.shared | own | counts | {"distance": last.distance, "ended": self.inversion.end}


def minima(
    spec: ProblemSpec, route: RouteSpec, engine: Engine, alphas: Sequence[float], at: str = "start"
) -> Iterator[Inversion]:
    """J minimized at every alpha, largest first, each from the minimum before; an interrupted one is the last.

    Raises InputError for a problem without Phi.
    """
    made = spec()
    if made.regularization is None:
        raise InputError(f"invert: {made.name} has no Phi(p) to weight - choose a problem with alpha=")
    p: Array | None = None
    for alpha in sorted(map(float, alphas), reverse=True):
        found = invert(spec, route, engine, at, p, made=made.weighted(alpha))
        yield found
        if found.interrupted:
            return
        p = found.p


def l_curve(found: Sequence[Inversion], between: Sequence[Inversion] = ()) -> list[Point]:
    """The points of the minima, corner and discrepancy marked; those `between` are too close for a curvature."""
    return chosen([_point(each) for each in found], [_point(each) for each in between])


def _point(inversion: Inversion) -> Point:
    last, noise = inversion.iterates[-1], noise_level(inversion.made, inversion.p)
    discrepancy = math.sqrt(last.misfit / noise) if noise else None
    return Point(inversion, last.misfit, last.regularization / inversion.alpha, None, discrepancy)


def chosen(points: Sequence[Point], between: Sequence[Point] = ()) -> list[Point]:
    """With curvatures, corner and discrepancy marked, largest alpha first.

    The corner is the point of largest curvature; the discrepancy principle chooses the largest alpha whose misfit is at
    most that of the noise, up to CLOSE.
    """
    bends = [bend if point.converged else None for bend, point in zip(curvatures(points), points, strict=True)]
    bent = max((bend or 0.0 for bend in bends), default=0.0)
    curved = [
        replace(point, curvature=bend, chosen="corner" if bend and bend == bent else None)
        for bend, point in zip(bends, points, strict=True)
    ]
    ordered = sorted([*curved, *between], key=lambda point: -point.inversion.alpha)
    met = next((point for point in ordered if point.meets_noise), None)
    return [
        replace(point, chosen=", ".join(filter(None, (point.chosen, "discrepancy")))) if point is met else point
        for point in ordered
    ]


def curvatures(points: Sequence[Point]) -> list[float | None]:
    """Of (log misfit, log Phi) over log alpha, by differences; None at the ends, for values <= 0, and where the curve
    stands still.
    """
    if len(points) < BENT or any(point.misfit <= 0.0 or point.phi <= 0.0 for point in points):
        return [None] * len(points)
    t = np.log([point.inversion.alpha for point in points])
    x, y = (np.log([getattr(point, name) for point in points]) for name in ("misfit", "phi"))
    x_1, y_1 = np.gradient(x, t), np.gradient(y, t)
    x_2, y_2 = np.gradient(x_1, t), np.gradient(y_1, t)
    bend = (x_1 * y_2 - x_2 * y_1) / np.maximum((x_1**2 + y_1**2) ** 1.5, 1e-300)
    moves = np.hypot(np.diff(x), np.diff(y)) > STILL
    bends = zip(bend[1:-1].tolist(), moves[1:] | moves[:-1], strict=True)
    return [None, *(value if moved else None for value, moved in bends), None]
