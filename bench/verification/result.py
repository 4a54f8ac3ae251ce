"""The answer to "is this gradient right?": a verdict, what it rests on, what to do next."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.locate import Located
from gradient_routes.bench.verification.reading import Reading

Verdict = Literal[
    "agrees",
    "wrong-gradient",
    "inconsistent-discretization",
    "solver-limited",
    "non-smooth",
    "noise-limited",
    "undetermined",
]
EXIT = {"agrees": 0, "wrong-gradient": 1, "inconsistent-discretization": 1}
INCONCLUSIVE = 3
MEANING: dict[Verdict, str] = {
    "agrees": "the gradient and the difference quotients differ by no more than the quotients are uncertain by",
    "wrong-gradient": "a difference that no step removes and no tighter forward solve reduces; where the solve cannot"
    " be tightened, a difference of 1 % or more",
    "inconsistent-discretization": "a difference that shrinks like h^k with the mesh size: the adjoint equation was"
    " discretized on its own",
    "solver-limited": "a difference, or noise, that falls when the forward solve is tightened",
    "non-smooth": "one-sided quotients converge to different numbers, or active sets change between the points",
    "noise-limited": "the noise of J leaves no usable step",
    "undetermined": "none of these could be established; the sentence says why",
}


@dataclass(frozen=True)
class Tightened:
    """The line of the plateau again, the forward solve's tolerance times `factor`.

    gradient_moved, quotient_moved  by how much both sides moved from before, relative
    moved  whether tightening has changed J(p) or the gradient in any digit
    """

    factor: float
    reading: Reading
    gradient_moved: float
    quotient_moved: float
    moved: bool


@dataclass(frozen=True)
class Refined:
    """|(g - exact) w| / |exact w| before and after the mesh size was halved, and the order between."""

    before: float
    after: float
    order: float


@dataclass(frozen=True)
class Check:
    """verdict, says: why, with numbers; todo: the next thing to do.

    readings   every line looked at; deciding: the one the verdict rests on
    culprit    the factor, component or functional that is wrong, where it could be told
    not_done   what would have told more, and why it was not done
    calls      of the objective, tightened and refined ones included; gradients likewise
    """

    name: str
    verdict: Verdict
    says: str
    todo: str
    readings: tuple[Reading, ...] = ()
    deciding: Reading | None = None
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

    @property
    def findings_of_factors(self) -> bool:
        """Whether the gradient was taken apart."""
        return any(f.name.startswith("dR/dp") for f in self.findings)

    @property
    def plateau(self) -> float | None:
        """Relative difference of gradient and differences that does not depend on the step."""
        if self.deciding is None or self.deciding.says != "plateau":
            return None
        return self.deciding.off

    @property
    def tightened_plateau(self) -> float | None:
        last = self.tightened[-1].reading if self.tightened else None
        return last.off if last is not None and last.level is not None else None

    def as_dict(self) -> dict[str, Any]:
        """What --json prints."""
        line = self.deciding
        curve = None if line is None else line.central if line.sweep.two_sided else line.one_sided
        return {
            "name": self.name,
            "verdict": self.verdict,
            "says": self.says,
            "next": self.todo,
            "floor": None if curve is None else curve.floor,
            "best_step": None if curve is None else curve.best_step,
            "slope_one_sided": None if line is None else line.one_sided.slope,
            "slope_central": None if line is None else line.central.slope,
            "roundoff_slope": None if curve is None else curve.roundoff,
            "window": None if curve is None else curve.window,
            "noise": self.noise,
            "plateau": self.plateau,
            "tightened_plateau": self.tightened_plateau,
            "refined_plateau": None if self.refined is None else self.refined.after,
            "order_in_mesh_size": None if self.refined is None else self.refined.order,
            "active_set_changes": None if line is None else line.inside,
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
