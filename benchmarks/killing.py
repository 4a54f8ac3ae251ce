"""A sweep killed at random points, by SIGKILL, and resumed: what is lost, what is done twice, what is left running.

    python -m benchmarks.killing

A point is a while after the start of the runner or after one of its rows; where cases have processes of their own, one
of those is killed now and then before the runner is.
"""

from __future__ import annotations

import json
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.store.store import Store

KILLS, CASES, SEED = 50, 40, 0
ROUTES = ("adjoint", "fd-central")
ISOLATED = 0.2  # of the runs: most are of one process, for it takes a fifth of the time
START, GAP = 0.6, 0.05  # [s] within which a kill comes, after the start and after a row
PATIENCE = 20.0  # [s] for the death of a worker whose runner is dead


@dataclass
class Killing:
    """Rows printed and not kept or cases without an answer at the end; answers beyond the first of a case; processes
    that outlive their runner.
    """

    kills: int = 0
    runs: int = 0
    lost: int = 0
    repeated: int = 0
    left: int = 0
    printed: list[Row] = field(default_factory=list)

    def __add__(self, other: Killing) -> Killing:
        return Killing(*(getattr(self, name) + getattr(other, name) for name in vars(self)))

    def __str__(self) -> str:
        return f"{self.kills} kills, {self.lost} lost, {self.repeated} repeated, {self.left} left running"


def killing(store: Path, cases: int, kills: int, rng: random.Random, isolated: float = ISOLATED) -> Killing:
    """So many kills of one sweep, less where it ends before, then its end undisturbed."""
    found, command = Killing(), sweep(store, cases)
    while found.kills < kills and not found.runs > 2 * kills:
        apart = rng.random() < isolated
        if not killed(command + ([] if apart else ["--no-isolate"]), rng, found, apart):
            break
    done = subprocess.run([*command, "--no-isolate"], capture_output=True, text=True, check=False)
    found.printed += [json.loads(line) for line in done.stdout.splitlines()]
    kept = Store(store).rows()
    answers = Counter(row["case_key"] for row in kept if row["status"] == "ok")
    known = {(row["case_key"], row["started"]) for row in kept}
    found.lost = sum((row["case_key"], row["started"]) not in known for row in found.printed) + cases - len(answers)
    found.repeated = sum(answers.values()) - len(answers)
    return found


def sweep(store: Path, cases: int) -> list[str]:
    """The command that goes on with it."""
    sizes = "|".join(map(str, range(1, cases // len(ROUTES) + 1)))
    routes = [word for route in ROUTES for word in ("--route", route)]
    quick = ("--min-time", "0", "--store", str(store), "--resume", "--json")
    return [str(Path(sys.executable).with_name("routes")), "run", "--problem", f"bar[n={sizes}]", *routes, *quick]


def killed(command: list[str], rng: random.Random, found: Killing, apart: bool) -> bool:
    """Start it and kill it; whether it was still running."""
    found.runs += 1
    with subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as runner:
        assert runner.stdout is not None
        lines = [runner.stdout.readline() for _ in range(rng.choice((0, 0, 1, 2)))]
        time.sleep(rng.uniform(0.0, GAP if lines else START))
        workers = children(runner.pid)
        if apart and workers and rng.random() < 0.5:
            found.kills += 1
            with suppress(psutil.Error):
                workers[0].kill()
            lines.append(runner.stdout.readline())
            workers = children(runner.pid)
        running = runner.poll() is None
        runner.send_signal(signal.SIGKILL)
        lines += runner.stdout.readlines()
    found.kills += running
    found.printed += [json.loads(line) for line in lines if line.endswith("\n")]
    found.left += len(psutil.wait_procs(workers, PATIENCE)[1])
    return running


def children(pid: int) -> list[psutil.Process]:
    try:
        return psutil.Process(pid).children(recursive=True)
    except psutil.Error:
        return []


def sound(store: Path) -> bool:
    """Whether SQLite finds nothing wrong with the file."""
    with closing(sqlite3.connect(store)) as db:
        return bool(db.execute("PRAGMA integrity_check").fetchone()[0] == "ok")


def main() -> None:
    out, rng, total = console(), random.Random(SEED), Killing()
    while total.kills < KILLS:
        with tempfile.TemporaryDirectory() as folder:
            store = Path(folder) / "routes.sqlite"
            found = killing(store, CASES, KILLS - total.kills, rng)
            file = "sound" if sound(store) else "broken"
            out.print(f"a sweep of {CASES} cases, started {found.runs + 1} times: {found}; the file is {file}")
        total = total + found
    out.print(str(total))


if __name__ == "__main__":
    main()
