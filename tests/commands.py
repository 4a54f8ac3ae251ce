"""Commands in processes of their own, as a user starts them, and what of them is left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil
import pytest

ROOT = Path(__file__).parent.parent
FAULTY = ROOT / "tests" / "data" / "faulty.py"
MARK = "ROUTES_TEST"  # a variable that all a test starts inherits, whatever groups and parents it leaves
PATIENCE = 600.0  # [s] for what takes a moment, however busy the machine: what hangs is ended


@dataclass(frozen=True)
class Ran:
    code: int
    out: str
    err: str

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One JSON object a line, nothing else: anything else fails here."""
        return [json.loads(line, parse_constant=lambda c: pytest.fail(c)) for line in self.out.splitlines()]


def with_routes() -> dict[str, str]:
    """The environment of this process, `routes` being the one beside its Python."""
    return {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def shell(command: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """A command as a user types it."""
    return subprocess.run(
        command,
        shell=True,
        cwd=cwd,
        env={**with_routes(), **environment},
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE,
    )


@dataclass(frozen=True)
class Shell:
    """The command line in processes of its own, and what of them is left."""

    folder: Path

    def start(self, *arguments: str, **environment: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            ["routes", *arguments],
            cwd=self.folder,
            env={**with_routes(), MARK: str(self.folder), **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="backslashreplace",
        )

    def run(self, *arguments: str, **environment: str) -> Ran:
        return ended(self.start(*arguments, **environment))

    def alive(self) -> list[psutil.Process]:
        """Of all that was started, descendants that have left included."""
        return [process for process in psutil.process_iter() if self._marked(process)]

    def _marked(self, process: psutil.Process) -> bool:
        try:
            return process.environ().get(MARK) == str(self.folder) and process.status() != psutil.STATUS_ZOMBIE
        except psutil.Error:
            return False

    def nothing_is_left(self) -> None:
        eventually(lambda: not self.alive())

    def asleep(self) -> None:
        """Once a misdeed has begun: its child is there."""
        eventually(lambda: any("time.sleep(987)" in word for process in self.alive() for word in words(process)))


def words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def ended(process: subprocess.Popen[str]) -> Ran:
    out, err = process.communicate(timeout=2 * PATIENCE)
    return Ran(process.returncode, out, err)


@contextmanager
def sigint_ignored() -> Iterator[None]:
    """What is started within ignores SIGINT, as what shells start in the background does."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def eventually(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def faulty(**options: object) -> str:
    return f"{FAULTY}:Faulty[{','.join(f'{name}={value}' for name, value in options.items())}]"
