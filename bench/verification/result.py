"""The answer to "is this gradient right?": a verdict, what it rests on, what to do next."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.locate import Located
from gradient_routes.bench.verification.reading import Reading
from gradient_routes.bench.verification.segment import Segment

Verdict = Literal[
    "agrees",
    "wrong-gradient",
    "inconsistent-discretization",
    "solver-limited",
    "non-smooth",
    "noise-limited",
    "unrepeatable",
    "undetermined",
]
EXIT = {"agrees": 0, "wrong-gradient": 1, "inconsistent-discretization": 1, "unrepeatable": 1}
INCONCLUSIVE = 3
FRESH_J = "J against fresh J"
BY_SOLVE = "error that the forward solve leaves, estimated"
SHRINKS = 0.6  # order in the mesh size from which on a plateau is one of the discretization
STAYS, SEVERAL = 0.3, 3  # order up to which it is not, on so many meshes
MEANING: dict[Verdict, str] = {
    "agrees": "the gradient and the difference quotients differ by no more than the quotients are uncertain by",
    "wrong-gradient": "a difference that no step removes and no tighter forward solve reduces; where the solve cannot"
    " be tightened, a difference of 1 % or more",
    "inconsistent-discretization": "a difference that shrinks like h^k with the mesh size: the adjoint equation was"
    " discretized on its own",
    "solver-limited": "a difference, or noise, that falls when the forward solve is tightened",
    "non-smooth": "one-sided quotients converge to different numbers, or J jumps at p, or its slope there is infinite",
    "noise-limited": "the noise of J leaves no usable step",
    "unrepeatable": "J or the gradient is another one when it is asked for again at the same point",
    "undetermined": "none of these could be established; the sentence says why",
}


@dataclass(frozen=True)
class Tightened:
    """Lines again, the forward solve's tolerance times `factor`; `reading` is the deciding one.

    gradient_moved, quotient_moved  relative change of both sides
    moved  whether J(p) or the gradient changed in any digit
    """

    factor: float
    reading: Reading
    readings: tuple[Reading, ...]
    gradient_moved: float
    quotient_moved: float
    moved: bool

    @property
    def plateaus(self) -> list[Reading]:
        return [r for r in self.readings if r.says == "plateau"]

    @property
    def sound(self) -> bool:
        """Whether the whole gradient agrees now, and no line contradicts it."""
        whole = [r for r in self.readings if r.quotients.line.whole]
        return not self.plateaus and any(r.says == "agrees" for r in whole)


@dataclass(frozen=True)
class Refined:
    """|(g - exact) w| / |exact w| on the mesh and on meshes of half the size each; the order between the last two."""

    errors: tuple[float, ...]

    @property
    def before(self) -> float:
        return self.errors[0]

    @property
    def after(self) -> float:
        return self.errors[-1]

    @property
    def order(self) -> float:
        """log2 of the ratio of the last two."""
        return math.log2(self.errors[-2] / max(self.errors[-1], float(np.finfo(np.float64).tiny)))

    @property
    def shrinks(self) -> bool:
        return self.order >= SHRINKS

    @property
    def stays(self) -> bool:
        """Whether the error stays on several meshes: on one it may be that of a mesh too coarse for any rate."""
        return len(self.errors) >= SEVERAL and self.order <= STAYS


@dataclass(frozen=True)
class Check:
    """verdict; says: the reason, with numbers; todo: what to do next.

    readings   every line; deciding: the one the verdict rests on
    elsewhere  a line through a second point; moved: why a second point was judged instead of p
    unrepeatable  what differed when it was asked for again
    segment    the gradient integrated along the deciding line
    compared   what a comparison with a second point proves
    culprit    the factor, component or functional that is wrong, where it is known
    not_done   tests that were not possible, and why
    calls      objective calls, those of tightened and refined versions included; gradients likewise
    """

    name: str
    verdict: Verdict = "undetermined"
    says: str = ""
    todo: str = ""
    readings: tuple[Reading, ...] = ()
    deciding: Reading | None = None
    elsewhere: Reading | None = None
    moved: str | None = None
    unrepeatable: str | None = None
    segment: Segment | None = None
    compared: str | None = None
    tightened: tuple[Tightened, ...] = ()
    refined: Refined | None = None
    located: Located | None = None
    findings: tuple[Finding, ...] = ()
    culprit: str | None = None
    noise: float | None = None
    not_done: tuple[str, ...] = ()
    calls: int = 0
    gradients: int = 0
    remarks: tuple[str, ...] = ()

    @property
    def exit_code(self) -> int:
        """0 agrees, 1 wrong, 3 inconclusive."""
        return EXIT.get(self.verdict, INCONCLUSIVE)

    def __str__(self) -> str:
        return f"{self.name}: {self.verdict}: {self.says} - {self.todo}"

    def __repr__(self) -> str:
        return f"<Check {self}>"

    def _repr_html_(self) -> str:
        """In a notebook."""
        from gradient_routes.bench.verification import page

        return page.fragment(self)

    @property
    def proof(self) -> Finding | None:
        """The first finding that proves a part of the gradient wrong."""
        return next((f for f in self.findings if f.culprit is not None), None)

    @property
    def recorded(self) -> Finding | None:
        """The finding that J is not what its author computes anew, whatever the gradient agrees with."""
        return next((f for f in self.findings if f.name == FRESH_J and f.sound is False), None)

    @property
    def by_solve(self) -> float | None:
        """The error of an exact adjoint at the state of the route, estimated, where it is more than agreement."""
        return next((f.value for f in self.findings if f.name == BY_SOLVE and f.sound is False), None)

    @property
    def moves(self) -> bool:
        """Whether J changes at all."""
        return any(r.moves for r in self.readings)

    @property
    def factors_tested(self) -> bool:
        """Whether the gradient was tested factor by factor."""
        return any(f.name.startswith("dR/dp") for f in self.findings)

    @property
    def plateau(self) -> float | None:
        """Relative difference of gradient and quotients, where it does not depend on the step."""
        return self.deciding.off if self.deciding is not None and self.deciding.says == "plateau" else None

    @property
    def tightened_plateau(self) -> float | None:
        last = self.tightened[-1].reading if self.tightened else None
        return last.off if last is not None and last.level is not None else None

    def as_dict(self) -> dict[str, Any]:
        """What --json prints."""
        line = self.deciding
        return {
            "name": self.name,
            "verdict": self.verdict,
            "says": self.says,
            "next": self.todo,
            "floor": line and line.curve.floor,
            "best_step": line and line.curve.best_step,
            "slope_one_sided": line and line.one_sided.slope,
            "slope_central": line and line.central.slope,
            "roundoff_slope": line and line.curve.roundoff,
            "window": line and line.curve.window,
            "noise": self.noise,
            "plateau": self.plateau,
            "tightened_plateau": self.tightened_plateau,
            "refined_plateau": self.refined and self.refined.after,
            "order_in_mesh_size": self.refined and self.refined.order,
            "active_set_changes": line and line.inside,
            "culprit": self.culprit,
            "worst_components": [
                {"name": w.name, "index": w.index, "given": w.given, "found": w.found, "factor": w.factor}
                for w in (self.located.worst if self.located is not None else ())
            ],
            "findings": [vars(f) | {"sound": f.sound} for f in self.findings],
            "calls": self.calls,
            "gradient_calls": self.gradients,
            "remarks": [*self.not_done, *self.remarks],
        }


def rows(check: Check, what: Row) -> dict[str, list[Row]]:
    """Tidy rows of the tables `checks` and `points`; `what` holds problem, route and at."""
    readings = [(1.0, r) for r in check.readings]
    readings += [] if check.elsewhere is None else [(1.0, check.elsewhere)]
    readings += [(t.factor, t.reading) for t in check.tightened]
    points = [what | point for factor, reading in readings for point in _points(factor, reading)]
    verdict = {name: value for name, value in check.as_dict().items() if name != "name"}  # whose code: in `what`
    return {"checks": [what | verdict], "points": points}


def _points(factor: float, reading: Reading) -> Iterator[Row]:
    """One row for every step of a line."""
    q, scale = reading.quotients, reading.scale or 1.0
    fixed = {
        "line": reading.name,
        "line_says": reading.says,
        "tightened": factor,
        "slope": reading.slope,
        "scale": reading.scale,
    }
    with np.errstate(invalid="ignore"):
        columns = {
            "step": q.h,
            "quotient_one_sided": q.forward,
            "quotient_central": q.central,
            "error_one_sided": np.abs(q.off_forward) / scale,
            "error_central": np.abs(q.off_central) / scale,
        }
    for values in zip(*columns.values(), strict=True):
        yield fixed | dict(zip(columns, map(float, values), strict=True))
