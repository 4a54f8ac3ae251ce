"""Sweeps that are struck at random points and resumed: what is lost, done twice, half written or left running.

    python -m benchmarks.faults [--faults N] [--seed SEED]

A fault is a signal, a disk that is full or a folder that becomes read-only, at the start of a run, a while after it or
after one of its rows. Every run goes on with the sweep, one at a time or three at once, and with what an earlier one
kept apart. A disk is filled on a tmpfs where one can be mounted; otherwise by the largest size of a file.
A folder is made read-only by a mount or, for users who are not root, by its mode.
"""

from __future__ import annotations

import csv
import json
import os
import random
import resource
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import astuple, dataclass
from itertools import chain, cycle, groupby
from pathlib import Path

import click
import psutil

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.store.store import Store

SIGNALS = ("SIGKILL", "SIGTERM", "SIGINT")
KINDS = (*SIGNALS, "full disk", "read-only")
CASES = 16
SWEEP = 10  # runs that are struck, at most, before the last one
ROUTES = ("adjoint", "fd-central")
MARK = "ROUTES_FAULTS"  # a variable that all that a run starts inherits
QUICK = ("--no-isolate",)
WAYS = (*[QUICK] * 6, (), ("--jobs", "2"))  # a process for each case takes ten times as long
LATEST = 1.0  # [s] after the start
GAP = 0.05  # [s] after a row
DISK, FILLED = 4 * 2**20, 2**18  # [byte] of the tmpfs; of the store before, so that what is kept apart is smaller
PATIENCE = 30.0  # [s] for the end of what a runner has started


@dataclass(frozen=True)
class Found:
    """Faults that struck; rows printed that are in no store; answers beyond the first of a case; files that are not
    whole; processes that outlive their runner.
    """

    faults: int = 0
    lost: int = 0
    repeated: int = 0
    half_written: int = 0
    left: int = 0

    def __add__(self, other: Found) -> Found:
        return Found(*map(sum, zip(astuple(self), astuple(other), strict=True)))

    @property
    def well(self) -> bool:
        return not any(astuple(self)[1:])


@dataclass(frozen=True)
class Sweep:
    """So many cases, in a folder of their own, and a folder for temporary files."""

    folder: Path
    apart: Path
    cases: int
    mounted: bool

    @property
    def store(self) -> Store:
        return Store(self.folder / "results" / "s.sqlite")

    def start(self, way: tuple[str, ...] = QUICK) -> subprocess.Popen[str]:
        sizes = "|".join(map(str, range(1, self.cases // len(ROUTES) + 1)))
        routes = [word for route in ROUTES for word in ("--route", route)]
        named = ("--store", "results/s.sqlite", "--gradient", "g.csv", "--resume", "--json", "--no-timing")
        command = [sys.executable, "-m", "gradient_routes", "run", "--problem", f"bar[n={sizes}]", *routes]
        known = {**os.environ, MARK: str(self.folder), "TMPDIR": str(self.apart)}
        return subprocess.Popen([*command, *named, *way], cwd=self.folder, env=known, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)  # fmt: skip

    def rows(self) -> list[Row]:
        """Of the store, and of those apart that a runner was not killed in the writing of."""
        stores = [self.store, *(Store(path) for path in stores_apart(self) if has_tables(path))]
        return [row for store in stores for row in store.rows()]

    def answers(self) -> Counter[str]:
        return Counter(row["case_key"] for row in self.rows() if row["status"] == "ok")

    def running(self) -> list[psutil.Process]:
        return [process for process in psutil.process_iter() if self._ours(process)]

    def _ours(self, process: psutil.Process) -> bool:
        try:
            return process.environ().get(MARK) == str(self.folder) and process.status() != psutil.STATUS_ZOMBIE
        except psutil.Error:
            return False


def faults(count: int, rng: random.Random, tell: Callable[[str], None] = lambda line: None) -> dict[str, Found]:
    """So many faults, sweep by sweep, by their kind. The kinds come in turn."""
    found = {kind: Found() for kind in KINDS}
    kinds = cycle(KINDS)
    while (done := sum(of.faults for of in found.values())) < count:
        with sweep(CASES) as at:
            for _ in range(min(SWEEP, count - done)):
                kind = next(kinds)
                found[kind] += struck(at, kind, rng)
                if len(at.answers()) == at.cases:
                    break
            found[kind] += struck(at, "", rng)
            found[kind] += Found(lost=at.cases - len({row["case_key"] for row in at.store.rows() if row["case_key"]}))
        tell(f"{done} of {count} faults")
    return found


@contextmanager
def sweep(cases: int) -> Iterator[Sweep]:
    """In a new folder, a small disk of its own where that can be mounted, with a store that is not small."""
    with tempfile.TemporaryDirectory() as root, ExitStack() as undone:
        folder, apart = Path(root) / "folder", Path(root) / "apart"
        folder.mkdir()
        apart.mkdir()
        mounted = _mount("-t", "tmpfs", "-o", f"size={DISK}", "none", folder)
        if mounted:
            undone.callback(subprocess.run, ["umount", "--lazy", folder], check=True)
        found = Sweep(folder, apart, cases, mounted)
        found.store.append(empty_row(), None)
        while found.store.path.stat().st_size < FILLED:
            found.store.append_all([(empty_row(), None, None)] * 100)
        yield found


def struck(at: Sweep, kind: str, rng: random.Random) -> Found:
    """One fault, or none, in a run; what came of it."""
    before = at.answers()
    (at.folder / "g.csv").unlink(missing_ok=True)
    with ExitStack() as undone, ThreadPoolExecutor() as threads:
        count = rng.choice((1, 1, 1, 1, 3)) if kind else 1
        runners = [at.start(rng.choice(WAYS) if kind else QUICK) for _ in range(count)]
        first, *others = runners
        printed = threads.map(rest, others)  # from now on: it may be one of them that the first waits for
        assert first.stdout is not None
        after = rng.choice((0, 0, 1, 4)) if kind else 0
        lines = [first.stdout.readline() for _ in range(after)]
        if kind:
            time.sleep(rng.uniform(0.0, GAP if after else LATEST))
        running = first.poll() is None
        if kind in SIGNALS:
            first.send_signal(getattr(signal, kind))
        elif kind == "full disk":
            undone.enter_context(full(at, runners, rng))
        elif kind == "read-only":
            running = undone.enter_context(read_only(at.store.path.parent)) and running
        lines += chain(rest(first), *printed)
    deadline = time.monotonic() + PATIENCE
    while (left := len(at.running())) and time.monotonic() < deadline:
        time.sleep(0.1)
    half = unfinished(at)
    kept = {(row["case_key"], row["started"]) for row in at.rows()}
    rows = [json.loads(line) for line in lines if line.endswith("\n")]
    lost = sum((row["case_key"], row["started"]) not in kept for row in rows)
    repeated = sum(max(0, n - max(1, before[key])) for key, n in at.answers().items())
    return Found(int(running and bool(kind)), lost, repeated, half, left)


def rest(runner: subprocess.Popen[str]) -> list[str]:
    """What it still prints until it ends."""
    with runner:
        assert runner.stdout is not None
        return runner.stdout.readlines()


@contextmanager
def full(at: Sweep, runners: list[subprocess.Popen[str]], rng: random.Random) -> Iterator[None]:
    """A disk with room for little or nothing more."""
    room = rng.choice((0, 4096, 2**15))
    if not at.mounted:
        for runner in runners:
            with suppress(ProcessLookupError):
                size = at.store.path.stat().st_size + room
                resource.prlimit(runner.pid, resource.RLIMIT_FSIZE, (size, size))
        yield
        return
    filler = at.folder / "filler"
    with filler.open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))
    os.truncate(filler, max(0, filler.stat().st_size - room))
    yield
    filler.unlink()


@contextmanager
def read_only(folder: Path) -> Iterator[bool]:
    """The folder and all in it; whether that could be done."""
    if os.geteuid():
        for path in (folder, *folder.iterdir()):
            path.chmod(0o500)
        yield True
        folder.chmod(0o700)
        for path in folder.iterdir():
            path.chmod(0o600)
        return
    done = _mount("--bind", folder, folder)
    try:
        yield done and _mount("-o", "remount,bind,ro", folder)
    finally:
        if done:
            subprocess.run(["umount", "--lazy", folder], check=True)


def _mount(*words: str | Path) -> bool:
    return subprocess.run(["mount", *words], capture_output=True, check=False).returncode == 0


def unfinished(at: Sweep) -> int:
    """Files that are not whole: parts of some, a table that is cut off, a store that SQLite finds damaged."""
    found = list(at.folder.rglob("*.part"))
    table = at.folder / "g.csv"
    if table.exists() and not whole(table):
        found.append(table)
    found += [path for path in (at.store.path, *stores_apart(at)) if not sound(path)]
    return len(found)


def whole(table: Path) -> bool:
    """Whether gradients are complete: as many lines as parameters for every route of every bar."""
    text = table.read_text()
    header, *lines = csv.reader(text.splitlines())
    groups = [(key[0], len(list(of))) for key, of in groupby(lines, lambda line: line[:2])]
    sizes = [int(name.partition("n=")[2].rstrip("]") or 8) for name, _ in groups]
    return text.endswith("\n") and {*map(len, lines)} <= {len(header)} and [n for _, n in groups] == sizes


def sound(path: Path) -> bool:
    """Whether SQLite finds nothing wrong with the file."""
    with closing(sqlite3.connect(path)) as db:
        return bool(db.execute("PRAGMA integrity_check").fetchone()[0] == "ok")


def stores_apart(at: Sweep) -> list[Path]:
    return [path for place in (at.folder, at.apart) for path in place.rglob("*unsaved*.sqlite")]


def has_tables(path: Path) -> bool:
    with closing(sqlite3.connect(path)) as db:
        return bool(db.execute("SELECT count(*) FROM sqlite_master").fetchone()[0])


@click.command()
@click.option("--faults", "count", type=click.IntRange(min=1), default=300, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
def main(count: int, seed: int) -> None:
    """Print what came of so many faults, by kind. Exit code 1 if anything was lost, repeated, cut off or left."""
    out = console()
    found = faults(count, random.Random(seed), lambda line: click.echo(line, err=True))
    out.print(f"{'':12}{'faults':>8}{'lost':>8}{'repeated':>10}{'half written':>14}{'left':>8}")
    total = sum(found.values(), Found())
    for kind, of in (*found.items(), ("all", total)):
        out.print(f"{kind:12}{of.faults:8}{of.lost:8}{of.repeated:10}{of.half_written:14}{of.left:8}")
    sys.exit(0 if total.well else 1)


if __name__ == "__main__":
    main()
