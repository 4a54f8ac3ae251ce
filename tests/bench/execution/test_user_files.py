"""Files of the user are imported by processes under limits, never by the one that runs a command."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import click
import pytest
from forks import Forks

from gradient_routes.bench.cases import case
from gradient_routes.bench.cli import main
from gradient_routes.bench.execution.describing import described
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError, RoutesError

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits memory")

FILE = """
import os
from typing import Annotated, Literal

from gradient_routes.problems.bar import Bar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.route import Offers, route

with open("pids", "a") as file:
    file.write(f"{os.getpid()}\\n")


class Mine(Bar):
    def __init__(
        self, *, n: Annotated[int, "elements"] = 3, load: Literal["tip", "body"] = "tip", at: complex | None = None
    ) -> None:
        super().__init__(n=n)


def even(*, every: int) -> None:
    from gradient_routes.problems.errors import InputError

    if every % 2:
        raise InputError(f"way: every={every} is odd - choose an even one")


def cost(n_p, forward, every):
    return adjoint.cost(n_p, forward, factors="refined")


@route("way", needs=Offers.SOLVE, cost=cost, check=even)
def way(model, p, *, every: Annotated[int, "an even number"] = 2):
    return adjoint.function(model, p, factors="refined")
"""
ENDS = {
    "leaves": ("import os\nos._exit(0)\n", "crashed{}: its process ended with exit code 0 - see its output above"),
    "exits": ("import sys\nsys.exit(0)\n", "'exits.py:P' cannot be imported: SystemExit: 0 - mend it"),
    "raises": ("raise ValueError('no')\n", "'raises.py:P' cannot be imported: ValueError: no - mend it"),
    "hangs": ("import time\ntime.sleep(987)\n", "timeout{}: after 4 s of --timeout - raise the limit, or ask for less"),
    "eats": ("kept = bytes(2**31)\n", "out-of-memory{}: MemoryError - raise --memory, or ask for less"),
}
LIMITS = ("--timeout", "4", "--memory", "1GiB")
RUNNERS = ("run", "scaling")  # the others are confined as a whole


def measuring() -> dict[str, tuple[str, ...]]:
    """Every verb that measures a problem, in a process of its own if it is told to; and how a file is named."""
    found = {}
    for name, command in main.commands.items():
        options = {p.name for p in command.params if isinstance(p, click.Option)}
        if "isolate" in options:
            needed = [p for p in command.params if p.required and p.name == "routes"]
            found[name] = ("--route", "adjoint") if needed or name in ("check", "vcurve") else ()
    return found


def imported_by(folder: Path) -> set[int]:
    return {int(line) for line in (folder / "pids").read_text().split()}


@pytest.mark.parametrize("verb", measuring())
def test_a_file_that_ends_its_process_does_not_end_the_command(cli, tmp_path: Path, verb: str) -> None:
    """In process: were it imported here, this test would end, too."""
    (tmp_path / "leaves.py").write_text(ENDS["leaves"][0])
    ran = cli(verb, "--problem", "leaves.py:P", *measuring()[verb], "--isolate")
    who = "problem 'leaves.py:P'" if verb in RUNNERS else verb
    where = " while it was imported" if verb in RUNNERS else ""
    says = ENDS["leaves"][1].format(where)
    assert (ran.code, ran.out, ran.err) == (1, "", f"routes: {who}: {says}\n")
    if verb not in RUNNERS:
        names, rows = Store("results/routes.sqlite").table("studies")
        assert [row[names.index("status")] for row in rows] == ["crashed"]


@pytest.mark.parametrize(
    ("how", "kind"), [*((how, "problem") for how in ENDS), ("leaves", "route"), ("raises", "route")]
)
def test_however_an_import_ends_it_is_one_line(cli, tmp_path: Path, how: str, kind: str) -> None:
    code, says = ENDS[how]
    (tmp_path / f"{how}.py").write_text(code)
    named = {"problem": "bar", "route": "adjoint", kind: f"{how}.py:P"}
    ran = cli("run", "--problem", named["problem"], "--route", named["route"], "--no-timing", *LIMITS, "--isolate")
    said = says.format(" while it was imported")
    assert (ran.code, ran.out) == (1, "")
    assert ran.err == f"routes: {said}\n" if said.startswith("'") else f"routes: {kind} '{how}.py:P': {said}\n"
    assert not (tmp_path / "results").exists(), "nothing was measured"


@pytest.mark.parametrize("verb", RUNNERS)
def test_a_runner_imports_no_file(cli, tmp_path: Path, verb: str) -> None:
    (tmp_path / "mine.py").write_text(FILE)
    before = {*sys.modules}  # other tests import files of this name without isolation
    named = ("--problem", "mine.py:Mine[n=2|4]", "--route", "mine.py:way", "--min-time", "0")
    ran = cli(verb, *named, "--json", "--isolate")
    assert (ran.code, ran.err) == (0, ""), ran.err
    rows = [row for row in ran.rows if row.get("table", "cases") == "cases"]
    assert sorted((row["route"], row["problem_options"]["n"]) for row in rows) == [
        ("mine.py:way", 2), ("mine.py:way", 4)
    ]  # fmt: skip
    assert {row["status"] for row in rows} == {"ok"}
    assert {tuple(row["problem_options"].items())[1:] for row in rows} == {(("load", "tip"), ("at", None))}
    assert os.getpid() not in imported_by(tmp_path)
    assert not [name for name in {*sys.modules} - before if name.startswith("_routes_mine_")]


def test_it_knows_what_has_been_done(cli, forks: Forks, tmp_path: Path) -> None:
    """Without importing: by what was said of the file, and by reading it."""
    (tmp_path / "mine.py").write_text(FILE)
    named = ("run", "--problem", "mine.py:Mine[n=2]", "--route", "mine.py:way", "--no-timing", "--json")
    counts = [len(cli(*named, "--resume", how).rows) for how in ("--isolate", "--isolate", "--no-isolate")]
    assert counts == [1, 0, 0], "keys are the same, wherever it is imported"
    (tmp_path / "mine.py").write_text(FILE + "\nMORE = 1\n")
    assert len(forks.run(tmp_path, *named, "--resume").rows) == 1


@pytest.mark.parametrize(
    ("problem", "route", "says"),
    [
        ("mine.py:Mine[m=2]", "adjoint", "mine.py:Mine: no option 'm'"),
        ("mine.py:Mine[n=x]", "adjoint", "mine.py:Mine: n=x is not a whole number"),
        ("mine.py:Mine[at=1]", "adjoint", "mine.py:Mine: at=1 is not"),
        ("mine.py:Mine[load=top]", "adjoint", "mine.py:Mine: load=top"),
        ("mine.py:Main", "adjoint", "'mine.py:Main': mine.py has no 'Main'"),
        ("yours.py:Mine", "adjoint", "'yours.py:Mine': no file yours.py here - check the path"),
        ("mine.py:Mine", "mine.py:way[every=3]", "way: every=3 is odd - choose an even one"),
        ("mine.py:Mine", "mine.py:even", "route 'mine.py:even' of mine.py:even is no Route"),
    ],
)
def test_what_is_asked_wrongly_is_refused_as_before(cli, tmp_path: Path, problem: str, route: str, says: str) -> None:
    (tmp_path / "mine.py").write_text(FILE)
    said = {how: cli("run", "--problem", problem, "--route", route, how) for how in ("--isolate", "--no-isolate")}
    assert said["--isolate"] == said["--no-isolate"]
    assert said["--isolate"].code == 2
    assert said["--isolate"].err.startswith(f"routes: {says}")


def test_a_default_that_is_no_plain_value_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "odd.py").write_text("class Own: ...\n\n\ndef problem(*, x=Own()): ...\n")
    with pytest.raises(InputError, match=r"odd.py:problem: default of x: .* Own .* give a number, a text or None"):
        described(["odd.py:problem"], [], Limits())


def test_nothing_is_started_for_what_is_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gradient_routes.bench.execution.describing.WorkerProcess", None)
    assert described(["bar[n=2|3]", "all"], ["adjoint", "all"], Limits()) == {}


def test_a_job_that_cannot_be_put_together_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that is imported once, and not a second time."""
    monkeypatch.chdir(tmp_path)
    once = "import os\nif os.path.exists('once'):\n    raise ValueError('twice')\nopen('once', 'w').close()\n"
    (tmp_path / "mine.py").write_text(once + FILE)
    from gradient_routes.bench.execution.executors.isolated import called
    from gradient_routes.bench.studies.scaling.sizes import unknowns

    (spec,) = case.problems(["mine.py:Mine"], described(["mine.py:Mine"], [], Limits()))
    with pytest.raises(RoutesError, match=r"'mine.py:Mine' cannot be imported: ValueError: twice"):
        called(unknowns, (spec,), Limits())
