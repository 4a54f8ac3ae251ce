"""What user code leaves behind is ended, what it sends itself is named, and a study is stored once."""

from __future__ import annotations

from pathlib import Path

import psutil
import pytest

from gradient_routes.bench.execution.isolation.descendants import MARK
from gradient_routes.bench.store.store import Store

MINE = """
import os, signal, subprocess, sys, time
import numpy as np

SLEEP = [sys.executable, "-c", "import time; time.sleep(3600)"]
AGAIN = "import subprocess, sys; subprocess.Popen({!r}, start_new_session=True)".format(SLEEP)

def child():
    subprocess.Popen(SLEEP, start_new_session=True)

def orphan():
    subprocess.run([sys.executable, "-c", AGAIN], start_new_session=True)

def orphan_then_crash():
    orphan()
    os.kill(os.getpid(), signal.SIGSEGV)

def fork():
    if os.fork() == 0:
        time.sleep(0.3)

def alarm():
    signal.alarm(1)
    time.sleep(3600)

def terminate():
    os.kill(os.getpid(), signal.SIGTERM)

def user_defined():
    os.kill(os.getpid(), signal.SIGUSR2)

class Mine:
    start = np.ones(2)
    def __init__(self):
        {}()
    def objective(self, p):
        return float(p @ p)
    def gradient(self, p):
        return 2.0 * p
"""


def check(cli, does: str, *options: str):
    Path("mine.py").write_text(MINE.replace("        {}()", f"        {does}()"))
    return cli("check", "mine.py:Mine", "--no-plot", "--isolate", *options)


def survivors() -> list[psutil.Process]:
    """Processes that were started for a job of this test."""
    found = []
    for process in psutil.process_iter():
        try:
            if process.status() != psutil.STATUS_ZOMBIE and MARK in process.environ():
                found.append(process)
        except psutil.Error:
            continue
    return found


@pytest.mark.parametrize("does", ["child", "orphan", "orphan_then_crash", "fork"])
def test_every_descendant_is_ended(cli, monkeypatch: pytest.MonkeyPatch, does: str) -> None:
    before = {process.pid for process in survivors()}  # of tests beside this one
    ran = check(cli, does)
    assert ran.code == (1 if does == "orphan_then_crash" else 0), ran.err
    mine = [process for process in survivors() if process.pid not in before and Path(process.cwd()) == Path.cwd()]
    assert not mine
    assert len(Store("results/routes.sqlite").records("studies")) == 1


@pytest.mark.parametrize(
    ("does", "name"), [("alarm", "SIGALRM"), ("terminate", "SIGTERM"), ("user_defined", "SIGUSR2")]
)
def test_the_signal_that_ended_it_is_named(cli, does: str, name: str) -> None:
    ran = check(cli, does)
    assert (ran.code, ran.out) == (1, "")
    assert "routes: check: crashed: its process was " in ran.err
    assert f" by {name} - " in ran.err
    (study,) = Store("results/routes.sqlite").records("studies")
    assert study["status"] == "crashed"
    assert study["reason"].endswith(name)
