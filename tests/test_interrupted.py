"""An interrupt at any time, from the first import on: one line, exit code 130, no traceback, nothing left running."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

COMMANDS = {
    "run": ("run", "--problem", "bar[n=8|16]", "--route", "adjoint", "--route", "fd-central", "--store", "s.sqlite"),
    "check": ("check", "--problem", "bar", "--route", "adjoint", "--no-plot", "--store", "s.sqlite"),
    "list": ("list", "problems"),
}
LONGEST = 2.5  # [s] of waiting before the signal
TRIES = 4
MARK = "GRADIENT_ROUTES_TESTED"
IGNORING = ("sh", "-c", 'trap "" INT; exec "$@"', "sh")


def started(folder: Path, command: str, mark: str, disposition: str = "blocked") -> subprocess.Popen[str]:
    """A command that is told nothing before it can listen: SIGINT is inherited blocked, or ignored."""
    words = [sys.executable, "-m", "gradient_routes.bench.start", *COMMANDS[command]]
    if disposition == "ignored":
        return process([*IGNORING, *words], folder, mark)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        return process(words, folder, mark)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def process(words: list[str], folder: Path, mark: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        words,
        cwd=folder,
        env={**os.environ, MARK: mark},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def nothing_is_left(mark: str) -> bool:
    """Whether all that has inherited the mark has ended; it may take a moment to be killed with its parent."""
    for _ in range(600):
        if not [process for process in psutil.process_iter() if marked(process, mark)]:
            return True
        time.sleep(0.1)
    return False


def marked(process: psutil.Process, mark: str) -> bool:
    try:
        return process.status() != psutil.STATUS_ZOMBIE and process.environ().get(MARK) == mark
    except psutil.Error:
        return False


@pytest.mark.parametrize("command", COMMANDS)
def test_it_ends_with_one_line_whenever_it_comes(command: str, tmp_path: Path) -> None:
    delays = random.Random(command)
    for attempt in range(TRIES):
        mark = f"{os.getpid()}-{command}-{attempt}"
        process = started(tmp_path, command, mark)
        time.sleep(LONGEST * ((attempt + delays.random()) / TRIES) ** 2)  # early, while modules are imported, and late
        process.send_signal(signal.SIGINT)
        out, err = process.communicate()
        assert "Traceback" not in out + err
        assert "Exception ignored" not in err
        if process.returncode != 0:
            assert process.returncode == 130, err
            assert err.count("\n") == 1, err
            assert err.startswith("routes: interrupted - ")
        assert nothing_is_left(mark)


def test_an_ignored_interrupt_is_heard(tmp_path: Path) -> None:
    """As shells start background jobs; nohup ignores another signal."""
    process = started(tmp_path, "check", "ignored", "ignored")
    while psutil.Process(process.pid).num_threads() and not caught(process.pid):
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate()
    assert (process.returncode, err.count("\n")) == (130, 1), err
    assert err.startswith("routes: interrupted - nothing is kept")


def caught(pid: int) -> bool:
    """Whether the process handles SIGINT."""
    status = Path(f"/proc/{pid}/status").read_text()
    mask = next(line.split()[1] for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(mask, 16) >> (signal.SIGINT - 1) & 1)


def test_a_thread_that_user_code_leaves_keeps_nobody(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "import threading, time\n"
        "import numpy as np\n"
        "class Mine:\n"
        "    start = np.ones(2)\n"
        "    def __init__(self):\n"
        "        threading.Thread(target=time.sleep, args=(3600,)).start()\n"
        "    def objective(self, p):\n"
        "        return float(p @ p)\n"
        "    def gradient(self, p):\n"
        "        return 2.0 * p\n"
    )
    for isolate in ("--isolate", "--no-isolate"):
        command = ("check", "mine.py:Mine", "--no-plot", "--no-store", isolate)
        words = [sys.executable, "-m", "gradient_routes.bench.start", *command]
        ran = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
        assert ran.returncode == 0, ran.stderr
        assert "agrees" in ran.stdout
