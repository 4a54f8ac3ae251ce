"""Whether a ratio can be relied upon: the same cases again and again, and how far their times in forward solves differ.

python -m benchmarks.repeat
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.sweep import How, run
from gradient_routes.bench.render.format import ratio
from gradient_routes.bench.render.terminal.tables import console

PROBLEMS = ("bar[n=1000]", "block")
ROUTES = ("tangent", "adjoint", "implicit-ad")
TIMES = 7
WITHIN = 0.10


@dataclass(frozen=True)
class Repeated:
    """Times in forward solves of one case, run by run."""

    problem: str
    route: str
    ratios: tuple[float, ...]

    @property
    def spread(self) -> float:
        """Largest over smallest, less one."""
        return max(self.ratios) / min(self.ratios) - 1.0


def repeat(problem: str, routes: Sequence[str], times: int = TIMES, min_time: float = 0.5) -> list[Repeated]:
    """Every route so often, each time in processes of their own."""
    ratios: dict[str, list[float]] = {}
    for _ in range(times):
        for outcome in run(case.problems([problem]), case.routes(routes), Settings(min_time=min_time), How()):
            assert outcome.samples is not None, outcome.row["reason"]
            ratios.setdefault(outcome.row["route"], []).append(outcome.samples.ratio)
    return [Repeated(problem, route, tuple(found)) for route, found in ratios.items()]


def main() -> None:
    out = console()
    for problem in PROBLEMS:
        for found in repeat(problem, ROUTES):
            shown = " ".join(map(ratio, found.ratios))
            out.print(
                f"{found.route} on {problem}: {shown} forward solves, {100 * found.spread:.1f} % apart"
                f" (<= {100 * WITHIN:g} %)",
                soft_wrap=True,
            )


if __name__ == "__main__":
    main()
