"""How far is the bar's adjoint from the physical limit, the time and the memory of copying one array?

    python -m benchmarks.bar_limits

prints, for growing N, forward + gradient in copies of one float64 array of N entries timed in the same rounds, the
peak memory in such arrays, and the exponent of time in N; then the wall time of the commands people wait for.
"""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import numpy as np
from rich.table import Table

from gradient_routes.bench.execution.memory import peak_of
from gradient_routes.bench.execution.timing import rounds, seconds_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.problems.bar import Bar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model

SIZES = (10_000, 100_000, 1_000_000)
COMMANDS = (("--help",), ("list",), ("run", "--no-store", "--problem", "bar", "--route", "adjoint"))
LIMITS = {"copies": 150.0, "arrays": 40.0, "--help": 0.35, "list": 0.35, "run": 1.2}


@dataclass(frozen=True)
class Distance:
    """Of one N: seconds of forward + gradient, the same in copies of an array, peak memory in arrays."""

    n: int
    seconds: float
    copies: float
    arrays: float


def distance(n: int, min_time: float = 1.0) -> Distance:
    """Measure the adjoint of the bar with N = n against copying one array."""
    problem = Bar(n=n)
    p, source, target = problem.parameters.start, np.ones(n), np.ones(n)
    gradient = adjoint.prepare(Model(problem), p)
    samples = rounds(lambda: gradient(p), lambda: np.copyto(target, source), min_time)
    peak, _ = peak_of(lambda: gradient(p))
    return Distance(n, median(samples.gradient), samples.ratio, peak / source.nbytes)


def exponent(distances: list[Distance]) -> float:
    """Slope of log time over log N."""
    return float(np.polyfit(np.log([d.n for d in distances]), np.log([d.seconds for d in distances]), 1)[0])


def wall_seconds(arguments: tuple[str, ...], repeats: int = 5) -> float:
    """Median wall time of a `routes` command as a fresh process, after one to warm the disk."""
    command = [str(Path(sys.executable).with_name("routes")), *arguments]

    def run() -> object:
        return subprocess.run(command, capture_output=True, check=True)

    run()
    return median(seconds_of(run)[0] for _ in range(repeats))


def main() -> None:
    out = console()
    distances = [distance(n) for n in SIZES]
    table = Table(box=None, pad_edge=False, title="bar, adjoint: forward + gradient", title_justify="left")
    for name in ("N", "seconds", "copies of one array", "peak memory in arrays"):
        table.add_column(name, justify="right")
    for d in distances:
        table.add_row(str(d.n), f"{d.seconds:.3g}", f"{d.copies:.0f}", f"{d.arrays:.1f}")
    out.print(table)
    out.print(f"at N = {SIZES[-1]}: wanted < {LIMITS['copies']:g} copies, < {LIMITS['arrays']:g} arrays")
    out.print(f"time ~ N^{exponent(distances):.2f} from N = {SIZES[0]} to {SIZES[-1]}")
    for arguments in COMMANDS:
        seconds = wall_seconds(arguments)
        out.print(f"routes {' '.join(arguments)}: {seconds:.2f} s wall, wanted < {LIMITS[arguments[0]]:g} s")


if __name__ == "__main__":
    main()
