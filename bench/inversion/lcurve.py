"""How much regularization: the L-curve (Hansen 1992), its corner, and the discrepancy principle."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.inversion.invert import Engine, Inversion, invert
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

BENT = 3  # points that a curvature needs


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


def l_curve(found: Sequence[Inversion]) -> list[Point]:
    """The points of the minima, corner and discrepancy marked."""
    return chosen([_point(each) for each in found])


def _point(inversion: Inversion) -> Point:
    last, problem, p = inversion.iterates[-1], inversion.made, inversion.p
    seen = problem.observation(problem.initial(p), p)  # sigma and the number of data do not depend on the state
    discrepancy = None
    if seen is not None and seen.sigma > 0.0:
        discrepancy = math.sqrt(2.0 * last.misfit) / (seen.sigma * math.sqrt(len(seen.data)))
    return Point(inversion, last.misfit, last.regularization / inversion.alpha, None, discrepancy)


def chosen(points: list[Point]) -> list[Point]:
    """With curvatures, corner and discrepancy marked.

    The corner is the point of largest curvature; the discrepancy principle (Morozov 1966) chooses the largest alpha
    whose misfit is at most that of the noise.
    """
    bends = [bend if point.converged else None for bend, point in zip(curvatures(points), points, strict=True)]
    corner = max(range(len(points)), key=lambda k: bends[k] or 0.0, default=0)
    met = [k for k, p in enumerate(points) if p.converged and p.discrepancy is not None and p.discrepancy <= 1.0]
    marked = []
    for k, (point, bend) in enumerate(zip(points, bends, strict=True)):
        marks = ["corner"] * (k == corner and (bend or 0.0) > 0.0) + ["discrepancy"] * (met[:1] == [k])
        marked.append(replace(point, curvature=bend, chosen=", ".join(marks) or None))
    return marked


def curvatures(points: Sequence[Point]) -> list[float | None]:
    """Of (log misfit, log Phi) over log alpha, by differences; None at the ends and for values <= 0."""
    if len(points) < BENT or any(point.misfit <= 0.0 or point.phi <= 0.0 for point in points):
        return [None] * len(points)
    t = np.log([point.inversion.alpha for point in points])
    x, y = (np.log([getattr(point, name) for point in points]) for name in ("misfit", "phi"))
    x_1, y_1 = np.gradient(x, t), np.gradient(y, t)
    x_2, y_2 = np.gradient(x_1, t), np.gradient(y_1, t)
    bend = (x_1 * y_2 - x_2 * y_1) / np.maximum((x_1**2 + y_1**2) ** 1.5, 1e-300)
    return [None, *bend[1:-1].tolist(), None]
