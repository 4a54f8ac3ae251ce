"""Runners of one sweep at once: a case is run by one of them, and by another where that one is killed."""

from __future__ import annotations

import signal
import subprocess
from collections import Counter
from pathlib import Path

import pytest
from commands import Ran, eventually, with_routes

from gradient_routes.bench.store.claims import Claims
from gradient_routes.bench.store.store import Store

# a value is known when the gate of its size is open; who is at it is noted
MODEL = """
import os, time
from pathlib import Path
import numpy as np
from gradient_routes.problems.problem import Offers, Parameters, Problem

HERE = Path(__file__).parent

class Model(Problem):
    name = "model"
    offers = Offers.VALUE

    def __init__(self, *, n: int = 1) -> None:
        self.parameters = Parameters(start=np.ones(n), scale=np.ones(n))

    def value(self, p):
        begun = HERE / f"begun-{len(p)}-{os.getppid()}-{os.getpid()}"
        begun.touch()
        while not (HERE / f"gate-{len(p)}").exists():
            time.sleep(0.01)
        return 1 / 0 if len(p) == 2 else float((p**2).sum())
"""
SIZES = range(1, 5)
COMMAND = ("routes", "run", "--json", "--no-timing", "--resume", "--problem", "model.py:Model[n=1|2|3|4]",
           "--route", "fd-central")  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "model.py").write_text(MODEL)
    return tmp_path


def runner(folder: Path, *options: str) -> subprocess.Popen[str]:
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen([*COMMAND, *options], cwd=folder, env=with_routes(), **pipes)


def open_gates(folder: Path) -> None:
    for n in SIZES:
        (folder / f"gate-{n}").touch()


def ended(runners: list[subprocess.Popen[str]]) -> list[Ran]:
    out = [process.communicate(timeout=120) for process in runners]
    return [Ran(process.returncode, *said) for process, said in zip(runners, out, strict=True)]


def sizes(rows: list[dict]) -> list[int]:
    return sorted(row["n_param"] for row in rows)


def begun(folder: Path) -> Counter[int]:
    """Processes that have been at a case, by its size."""
    return Counter(int(path.name.split("-")[1]) for path in folder.glob("begun-*"))


@pytest.mark.parametrize(("count", "options"), [(2, ("--jobs", "2")), (2, ("--no-isolate",))])
def test_runners_at_once_run_every_case_once(folder: Path, count: int, options: tuple[str, ...]) -> None:
    """The one that fails, too. Those with a process at a time are below."""
    runners = [runner(folder, *options) for _ in range(count)]
    eventually(lambda: len(begun(folder)) >= count)
    open_gates(folder)
    done = ended(runners)
    assert all("Traceback" not in ran.err for ran in done)
    assert sorted(row["case_key"] for ran in done for row in ran.rows) == sorted(
        row["case_key"] for row in Store(folder / "results" / "routes.sqlite").rows()
    )
    assert sizes([row for ran in done for row in ran.rows]) == [*SIZES]


def test_the_case_of_a_runner_that_is_killed_is_run_by_another(folder: Path) -> None:
    killed = runner(folder)
    eventually(lambda: bool(begun(folder)))
    other = runner(folder)
    eventually(lambda: len(begun(folder)) >= 2)
    killed.send_signal(signal.SIGKILL)
    killed.communicate(timeout=60)
    open_gates(folder)
    (done,) = ended([other])
    assert sizes(Store(folder / "results" / "routes.sqlite").rows()) == sizes(done.rows) == [*SIZES]


def test_a_runner_that_has_done_all_else_waits_for_the_cases_of_others(folder: Path) -> None:
    """So that the sweep is complete when any of them ends, whoever is killed meanwhile."""
    slow = runner(folder, "--no-isolate")
    eventually(lambda: bool(begun(folder)))
    (held,) = begun(folder)
    for n in {*SIZES} - {held}:
        (folder / f"gate-{n}").touch()
    other = runner(folder, "--no-isolate")
    assert other.stderr is not None
    assert other.stderr.readline() == "routes: 1 case is run by another - waiting for it, interrupt to leave it\n"
    slow.send_signal(signal.SIGKILL)
    slow.communicate(timeout=60)
    open_gates(folder)
    (done,) = ended([other])
    assert sizes(done.rows) == sizes(Store(folder / "results" / "routes.sqlite").rows()) == [*SIZES]


def test_what_failed_before_is_run_again_by_one_of_two(cli, folder: Path) -> None:
    open_gates(folder)
    assert sizes(cli(*COMMAND[1:]).rows) == [*SIZES]
    again = ended([runner(folder, "--no-isolate") for _ in range(2)])
    assert sorted(len(ran.rows) for ran in again) in ([0, 1], [1, 1]), "both may come when the other has ended"


def test_a_claim_is_of_one_process_and_of_one_case(tmp_path: Path) -> None:
    claims = Claims(Store(tmp_path / "s.sqlite"))
    first, second = "ffffffffffffffff", "00000000000000ff"
    assert claims.take(first)
    code = (
        "from gradient_routes.bench.store.claims import Claims; from gradient_routes.bench.store.store import Store\n"
        f"claims = Claims(Store('s.sqlite')); print(claims.take('{first}'), claims.take('{second}'))"
    )
    command = [with_routes()["PATH"].split(":")[0] + "/python", "-c", code]

    def told() -> str:
        return subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    assert told() == "False True\n"
    claims.release(first)
    assert told() == "True True\n"
