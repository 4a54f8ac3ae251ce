"""Every verb under limits: it ends in one line with an exit code, and nothing that it started goes on."""

from __future__ import annotations

import json
import signal
import sys
import time
from contextlib import nullcontext
from pathlib import Path

import pytest
from commands import FAULTY, MARK, Shell, ended, eventually, faulty, sigint_ignored
from forks import Forks

from gradient_routes.bench.cases.registry import studies
from gradient_routes.bench.command_options import FINISHED
from gradient_routes.bench.execution.isolation import process as watching
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies import command

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")

COUNTED = """
from gradient_routes.problems.bar import Bar

class Counted(Bar):
    def linearize(self, u, p):
        with open("gradients", "a") as file:
            file.write(".")
        return super().linearize(u, p)
"""
ENDLESS = {
    "invert": ("--optimizer", "descent", "--tolerance", "0", "--iterations", "100000"),
    "tolerance": ("--route", "adjoint", "--tightest", "1e-12", "--per-decade", "1000", "--budget", "inf"),
}


@pytest.fixture
def late(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A limit that is met once there are some gradients, however long that takes."""
    file = tmp_path / "gradients"

    class Late:
        @staticmethod
        def monotonic() -> float:
            return time.monotonic() + (7200.0 if file.exists() and len(file.read_text()) > 9 else 0.0)

    monkeypatch.setattr(watching, "time", Late)


ASLEEP = """
from faulty import Sleeping, sleep
from gradient_routes.problems.bar import Bar

def asleep():
    with open("gradients", "w") as file:
        file.write(10 * ".")
    sleep()

class Check(Sleeping):
    def objective(self, p):
        asleep()

class Asleep(Bar):
    def __init__(self):
        super().__init__(n=2)
        asleep()
"""
SLEEPING = {
    "check": ("asleep.py:Check",),
    "vcurve": ("--problem", "asleep.py:Asleep", "--route", "fd-central"),
    "kink": ("--problem", "asleep.py:Asleep"),
    "tolerance": ("--problem", "asleep.py:Asleep"),
    "unrolling": ("--problem", "asleep.py:Asleep"),
}


def test_every_verb_ends_at_its_limit(
    late: None, cli, started: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In one line, with an exit code and a row that says so."""
    monkeypatch.setenv(MARK, str(tmp_path))
    (tmp_path / "faulty.py").write_text(FAULTY.read_text())
    (tmp_path / "asleep.py").write_text(ASLEEP)
    for verb, given in SLEEPING.items():
        ran = cli(verb, *given, "--timeout", "1800", "--isolate")
        finished = f"; {FINISHED}" if studies()[verb].keeps else ""
        says = f"routes: {verb}: timeout: after 1800 s of --timeout - raise the limit, or ask for less{finished}\n"
        assert (ran.code, ran.out, ran.err) == (1, "", says)
        (tmp_path / "gradients").unlink()
    kept = Store(tmp_path / "results" / "routes.sqlite").records("studies")
    assert {row["study"]: row["status"] for row in kept} == dict.fromkeys(SLEEPING, "timeout")
    assert {row["reason"] for row in kept} == {"after 1800 s of --timeout"}
    started.nothing_is_left()


@pytest.mark.parametrize("verb", ENDLESS)
def test_what_a_verb_has_at_its_limit_is_shown_and_kept(verb: str, late: None, cli, tmp_path: Path) -> None:
    (tmp_path / "counted.py").write_text(COUNTED)
    ran = cli(verb, "--problem", "counted.py:Counted", "--json", "--isolate", *ENDLESS[verb])
    told = f"{verb}: timeout: after 3600 s of --timeout - raise the limit, or ask for less; {FINISHED}"
    assert (ran.code, ran.err) == (1, f"routes: {told}\n")
    table = "inversion" if verb == "invert" else verb
    kept = Store(tmp_path / "results" / "routes.sqlite").records(table)
    assert sum(row["table"] == table for row in ran.rows) == len(kept) > 0
    assert verb != "invert" or kept[-1]["says"] == "interrupted"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (("check", f"{FAULTY}:Leaving"), "check: crashed: its process ended with exit code 0"),
        (("tolerance", "--problem", faulty(does="leave", when=0)), "tolerance: crashed: its process ended with"),
        (("tolerance", "--problem", faulty(does="quit", when=0)), "routes: tolerance: SystemExit: 4 - see --debug"),
        (("unrolling", "--problem", faulty(does="raise", when=0)), "unrolling: ZeroDivisionError"),
        (
            ("vcurve", "--problem", faulty(does="take", when=0), "--route", "fd-central", "--memory", "300MB"),
            "vcurve: out-of-memory: MemoryError: Unable to allocate",
        ),
    ],
)
def test_no_code_of_others_ends_a_verb_as_if_all_were_well(cli, given: tuple[str, ...], says: str) -> None:
    """An exit code of 0 would mean that a gradient agrees."""
    ran = cli(*given, "--no-store", "--isolate")
    assert (ran.code, ran.out) == (1, ""), ran.err
    assert says in ran.err
    assert "Traceback" not in ran.err


def test_what_c_prints_is_no_result(forks: Forks, tmp_path: Path) -> None:
    ran = forks.run(tmp_path, "check", "--json", "--no-store", f"{FAULTY}:Chatty")
    assert ran.code == 0, ran.err
    assert "garbage of C" in ran.err
    assert json.loads(ran.out)["verdict"] == "agrees"


@pytest.mark.parametrize(
    ("model", "name", "ignored"),
    [("Sleeping", "SIGTERM", False), ("Stubborn", "SIGINT", False), ("Sleeping", "SIGINT", True)],
)
def test_an_interrupted_verb_leaves_nothing_running(started: Shell, model: str, name: str, ignored: bool) -> None:
    """Also where it was started with SIGINT ignored, as what shells start in the background is."""
    with sigint_ignored() if ignored else nullcontext():
        process = started.start("check", f"{FAULTY}:{model}")
    started.asleep()
    process.send_signal(signal.Signals[name])
    ran = ended(process)
    assert (ran.code, ran.out, ran.err) == (130, "", "routes: interrupted - nothing is kept\n")
    started.nothing_is_left()
    assert not (started.folder / "results" / "routes.sqlite").exists()


DEAF = """
import os, signal, time

class Deaf(Counted):
    def linearize(self, u, p):
        if os.path.exists("gradients") and os.path.getsize("gradients") > 8:
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
            super().linearize(u, p)  # the gradient at which the limit is met
            time.sleep(987)
        return super().linearize(u, p)
"""


def test_a_verb_that_does_not_react_is_killed_and_says_nothing_of_what_it_has(
    late: None, cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "deaf.py").write_text(COUNTED + DEAF)
    monkeypatch.setattr(command, "LAST", 0.5)
    ran = cli("invert", "--problem", "deaf.py:Deaf", "--isolate", "--no-plot", *ENDLESS["invert"])
    told = "invert: timeout: after 3600 s of --timeout - raise the limit, or ask for less"
    assert (ran.code, ran.err) == (1, f"routes: {told}\n")
    assert not Store(tmp_path / "results" / "routes.sqlite").records("inversion")


def test_a_group_that_is_told_to_end_keeps_what_it_has(started: Shell) -> None:
    """Service managers tell all processes at once: the one inside by itself, and by the one that watches it."""
    (started.folder / "counted.py").write_text(COUNTED)
    process = started.start("invert", "--problem", "counted.py:Counted", "--no-plot", *ENDLESS["invert"])
    gradients = started.folder / "gradients"
    eventually(lambda: gradients.exists() and len(gradients.read_text()) > 9)
    for each in started.alive():
        each.send_signal(signal.SIGTERM)
    ran = ended(process)
    assert (ran.code, ran.err) == (130, f"routes: interrupted - {FINISHED}\n")
    assert Store(started.folder / "results" / "routes.sqlite").records("inversion")
    started.nothing_is_left()
