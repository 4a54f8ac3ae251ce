"""What 100 000 cases cost: seconds and peak memory of reading them, memory of the runner while rows stream.

python -m benchmarks.large
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import psutil

from benchmarks.invented_store import case, fill
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.execution.timing import seconds_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.bill.done import Done
from gradient_routes.bench.units import duration, size

CASES = 100_000
ALLOWED_S, ALLOWED_BYTES, ALLOWED_GROWTH = 10.0, 500e6, 20e6
VERBS = ("status", "report", "report -o report.html", "compare", "export -o cases.csv")


@dataclass(frozen=True)
class Cost:
    """Of one command: wall time [s], peak resident bytes."""

    command: str
    seconds: float
    peak: int


def reading(folder: Path, cases: int = CASES) -> list[Cost]:
    """Each verb on such a store, in a process of its own. Linux counts what its parent holds as its peak, too: the
    store is filled elsewhere.
    """
    filling = get_context("spawn").Process(target=fill, args=(Store(folder / "a.sqlite"), cases))
    filling.start()
    filling.join()
    shutil.copy(folder / "a.sqlite", folder / "b.sqlite")
    return [measured(folder, verb) for verb in VERBS]


def measured(folder: Path, verb: str) -> Cost:
    which = ["a.sqlite", "b.sqlite"] if verb == "compare" else ["--store", "a.sqlite"]
    command = [sys.executable, "-m", "gradient_routes.bench.start", *verb.split(), *which]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL) as process:
        seconds, (_, status, usage) = seconds_of(lambda: os.wait4(process.pid, 0))
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, command
    return Cost(verb, seconds, usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024))


def growth(rows: int = CASES, early: int = 5000) -> int:
    """Resident bytes that the runner's display gains from the first rows to the last."""
    done = Done(None, False, (), views=False)
    rng = np.random.default_rng(0)
    before = 0
    for k in range(rows):
        done.take(Outcome(case(k, rng), place=k))
        if k == early:
            before = psutil.Process().memory_info().rss
    return int(psutil.Process().memory_info().rss - before)


def main() -> None:
    out = console()
    with tempfile.TemporaryDirectory() as folder:
        for cost in reading(Path(folder)):
            out.print(
                f"{cost.command} of {CASES} cases: {duration(cost.seconds)} (<= {ALLOWED_S:g} s), {size(cost.peak)}"
                f" (<= {size(ALLOWED_BYTES)})"
            )
    out.print(f"{CASES} rows taken by a run: {size(growth())} more than after 5000 (<= {size(ALLOWED_GROWTH)})")


if __name__ == "__main__":
    main()
