"""What the harness itself costs: a process a case, a case in this process, a row of the store, a long sweep.

python -m benchmarks.harness
"""

from __future__ import annotations

import gc
import itertools
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import psutil

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.sweep import HERE, How, run
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.units import duration, size

QUICK = Settings(min_time=0.0)
REPEATS = 5
ROUTES = {
    "adjoint": 1.0,
    "implicit-ad": 2.0,
}  # without JAX and with it: seconds beyond the work itself that are allowed
ROWS, CASES = 1000, 500


@dataclass(frozen=True)
class Sweep:
    """Resident bytes of the runner after a fifth of its cases, and after all."""

    cases: int
    early: int
    late: int


def cases(problem: str, route: str, how: How) -> Iterator[Outcome]:
    """Those of a selector."""
    return run(case.problems([problem]), case.routes([route]), QUICK, how)


def isolation(route: str) -> float:
    """Seconds that a process of its own costs a case: beyond the same case here, where all is loaded and nothing is
    compiled; medians.
    """
    return wall(route, How()) - wall(route, HERE)


def wall(route: str, how: How) -> float:
    """Median seconds of one case on the bar, what JAX compiled for the one before forgotten."""
    import jax

    def once() -> float:
        jax.clear_caches()  # type: ignore[no-untyped-call]  # JAX gives it no types
        return seconds_of(lambda: list(cases("bar", route, how)))[0]

    once()
    return median(once() for _ in range(REPEATS))


def here(count: int = 200) -> float:
    """Seconds of a case in this process, its forward solves and gradients of a few unknowns included."""
    problem = f"bar[n={'|'.join(map(str, range(2, 2 + count)))}]"
    list(cases("bar[n=2|3]", "adjoint", HERE))
    return seconds_of(lambda: list(cases(problem, "adjoint", HERE)))[0] / count


def rows(count: int = ROWS) -> tuple[float, float, float]:
    """Seconds to write so many rows with their samples, to read them back, and to keep one alone."""
    (outcome,) = run(case.problems(["bar"]), case.routes(["adjoint"]), Settings(), HERE)
    row = (outcome.row, outcome.samples, outcome.environment)
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder) / "rows.sqlite")
        store.append(*row)
        write = seconds_of(lambda: store.append_all([row] * count))[0]
        read = seconds_of(store.rows)[0]
        one = median(seconds_of(lambda: store.append(*row))[0] for _ in range(20))
    return write, read, one


def sweep(count: int = CASES) -> Sweep:
    """Memory of this process while it runs so many cases, each in a process of its own."""
    problem = f"bar[n={'|'.join(map(str, range(2, 2 + count)))}]"
    outcomes = cases(problem, "adjoint", How())
    early = _taken(itertools.islice(outcomes, count // 5))
    return Sweep(count, early, _taken(outcomes))


def _taken(outcomes: Iterator[Outcome]) -> int:
    for _ in outcomes:
        pass
    gc.collect()
    return int(psutil.Process(os.getpid()).memory_info().rss)


def main() -> None:
    out = console()
    not_isolated = here()  # before JAX is there, whose objects a collection looks through
    for route, allowed in ROUTES.items():
        out.print(f"{route} on the bar, isolated: {isolation(route):.2f} s beyond the work itself (<= {allowed:g} s)")
    out.print(f"adjoint on a bar, not isolated: {duration(not_isolated)} a case with its work (<= 5 ms)")
    write, read, one = rows()
    out.print(f"{ROWS} rows: written in {duration(write)}, read in {duration(read)} (together < 1 s)")
    out.print(f"a row alone: {duration(one)}, most of it the disk's promise to keep it")
    swept = sweep()
    out.print(
        f"{swept.cases} isolated cases: the runner holds {size(swept.early)} after {swept.cases // 5},"
        f" {size(swept.late)} at the end (flat)"
    )


if __name__ == "__main__":
    main()
