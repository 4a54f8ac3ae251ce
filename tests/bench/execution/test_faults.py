"""Hostile plug-ins, streams and stores: every fault ends in a row or in one line, never in a wrong number."""

from __future__ import annotations

import os
import shlex
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from commands import Ran, with_routes
from forks import Forks

EVIL = '''
import numpy as np
from gradient_routes.problems.problem import Offers, Parameters, Problem
from gradient_routes.routes.route import Offers, Result, Work, route

def cost(n_p, forward, **options):
    return Work()

def evil(name, answer):
    @route(name, needs=Offers.VALUE, cost=cost)
    def function(model, p):
        """An answer that is none."""
        return answer(p)
    return function

def leave(p):
    raise SystemExit(0)

mutates = evil("mutates", lambda p: (1.0, p.__iadd__(1)))
leaves = evil("leaves", leave)
nan_J = evil("nan-J", lambda p: (float("nan"), p))
short = evil("short", lambda p: (1.0, p[:-1]))
complex_ = evil("complex", lambda p: (1.0, p + 0j))
nothing = evil("nothing", lambda p: None)
numpyish = evil("numpyish", lambda p: Result(np.float32(1), p, None, np.float32(0.5), None, np.int64(3)))
talks = evil("talks", lambda p: (print("garbage"), (1.0, p))[1])
misnamed = evil("adjoint", lambda p: (1.0, p))

class Box(Problem):
    name = "box"
    def __init__(self, *, start=(3,), J: float = 1.0):
        self.parameters = Parameters(start=np.array(start), scale=np.ones(len(start)), lower=0.0)
    def value(self, p):
        return float((p**2).sum())

def make(*, d: float = 0.5) -> Problem:
    """A factory function."""
    return Box()

def outside():
    return Box(start=(-1.0,))

def raises():
    raise ValueError("not today")

def no_problem():
    return 3
'''
ROUTES = "mutates leaves nan-J short complex nothing numpyish talks".split()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    site = tmp_path_factory.mktemp("evil")
    (site / "evil.py").write_text(EVIL)
    (site / "exits.py").write_text("raise SystemExit(3)")
    info = site / "evil-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: evil\nVersion: 1.0\n")
    names = {"complex": "complex_", "nan-J": "nan_J"}
    routes = "\n".join(f"{name} = evil:{names.get(name, name)}" for name in [*ROUTES, "misnamed"])
    problems = "\n".join(f"{name} = evil:{name}" for name in "Box make outside raises no_problem".split())
    (info / "entry_points.txt").write_text(
        f"[gradient_routes.routes]\n{routes}\n"
        f"[gradient_routes.problems]\n{problems}\nexits = exits:x\npi = math:pi\nbar = evil:Box\n"
    )
    return site


@pytest.fixture(scope="module")
def installed(site: Path) -> Iterator[Forks]:
    forks = Forks(PYTHONPATH=str(site))
    yield forks
    forks.end()


@pytest.fixture
def routes(installed: Forks, site: Path, tmp_path: Path) -> Callable[[str], Ran]:
    """The command line where they are installed."""
    return lambda words: installed.run(tmp_path, *shlex.split(words), PYTHONPATH=str(site))


def test_foreign_routes_fail_alone(routes: Callable[[str], Ran]) -> None:
    chosen = " ".join(f"--route {name}" for name in [*ROUTES, "adjoint"])
    done = routes(f"run --json --problem bar {chosen} --no-timing --no-isolate")
    assert done.code == 1
    assert "Traceback" not in done.err
    assert "garbage" in done.err, "what a plug-in prints is no result"
    rows = {row["route"]: row for row in done.rows}
    assert [name for name, row in rows.items() if row["status"] == "ok"] == ["numpyish", "talks", "adjoint"]
    for name, says in {
        "mutates": "read-only",
        "leaves": "SystemExit",
        "nan-J": "J = nan",
        "short": "shape (7,) for 8",
        "complex": "complex",
        "nothing": "TypeError",
    }.items():
        assert says in rows[name]["reason"]
    assert rows["numpyish"]["residual"] == 0.5
    assert rows["adjoint"]["gradient_error"] < 1e-15, "what a route did to p must not reach the next"


def test_foreign_problems_fail_alone(routes: Callable[[str], Ran]) -> None:
    done = routes("run --json --problem all --route fd-central --min-time 0")
    assert done.code == 2, "a start outside the domain is wrong before anything runs"
    assert "outside, start: p_1 = -1 is outside 0 < p_1" in done.err.replace("box, start", "outside, start")
    chosen = " ".join(f"--problem {name}" for name in ("raises", "no_problem", "make", "bar"))
    done = routes(f"run --json {chosen} --route fd-central --no-timing --no-isolate")
    assert done.code == 1
    rows = {row["problem"]: row for row in done.rows}
    assert "cannot be built: ValueError: not today" in rows["raises"]["reason"]
    assert "not a Problem" in rows["no_problem"]["reason"]
    assert rows["bar"]["n_param"] == 8, "a built-in is not to be replaced"
    assert rows["make"]["gradient"] == pytest.approx([6.0], rel=1e-8), "an integer start must not truncate steps"


def test_the_list_shows_every_broken_entry(routes: Callable[[str], Ran]) -> None:
    done = routes("list")
    assert (done.code, done.err) == (0, "")
    for says in (
        "exits' of evil cannot be imported: SystemExit: 3",
        "'pi' of evil cannot be called",
        "'misnamed' of evil calls itself 'adjoint'",
        "hidden by the problem of the same name",
        "d=0.5",
    ):
        assert says in done.out


def test_huge_and_tiny_moduli_are_judged_or_refused(cli, tmp_path: Path) -> None:
    """Squares of 1e-150 underflow; a gradient of zeros must not pass for right."""
    command = [
        "run",
        "--json",
        "--problem",
        "bar[parametrization=raw]",
        "--min-time",
        "0",
        "--no-store",
        "--at",
        "p.csv",
    ]
    (tmp_path / "p.csv").write_text("E\n" + "1e70\n" * 8)
    rows = {r["route"]: r for r in cli(*command, "--route", "adjoint", "--route", "fd-central").rows}
    assert rows["adjoint"]["gradient_error"] < 1e-14
    assert rows["adjoint"]["gradient_norm"] > 0
    assert rows["fd-central"]["gradient_error"] == pytest.approx(1.0)
    (tmp_path / "p.csv").write_text("E\n" + "1e-30\n" * 8)
    assert cli(*command, "--route", "complex-step").rows[0]["gradient_error"] < 1e-12
    for value, status in (("1e-320", "not-converged"), ("1e-200", "non-finite")):
        (tmp_path / "p.csv").write_text("E\n" + f"{value}\n" * 8)
        ran = cli(*command, "--route", "adjoint")
        assert (ran.code, ran.rows[0]["status"]) == (1, status)
    (tmp_path / "p.csv").write_text("E\n" + "1e100\n" * 8)
    assert "E_1 = 1e+100 is outside" in cli(*command, "--route", "adjoint").err


@pytest.mark.parametrize(
    ("command", "code"),
    [
        ("routes run --problem bar --route adjoint --no-timing >&-", 0),
        ("routes run --problem 'bar[n=1|2]' --route adjoint --no-timing 2>&-", 0),
        ("PYTHONIOENCODING=ascii routes run --problem 'bar[data=é.csv]' --route adjoint", 2),
    ],
)
def test_streams_at_their_limits(command: str, code: int, tmp_path: Path) -> None:
    done = subprocess.run(["bash", "-c", command], cwd=tmp_path, env=with_routes(), capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") <= 1
    assert done.returncode == code


RUN = ("run", "--problem", "bar", "--route", "adjoint", "--no-timing", "--no-isolate")


@pytest.mark.parametrize("words", [RUN, (*RUN, "--json", "--no-store"), ("list",)], ids=["table", "rows", "list"])
def test_a_full_stdout_is_one_line(words: tuple[str, ...], forks: Forks, tmp_path: Path) -> None:
    ran = forks.run(tmp_path, *words, stdout="/dev/full")
    assert "Traceback" not in ran.err
    assert ran.err.count("\n") <= 1
    assert ran.code == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ("ba\nr",),
        ("bar", "--store", 300 * "a"),
        ("bar", "--store", ""),
        ("bar[n=1e12]",),
        ("bar[n=1_0]",),
        (f"bar[sensors={5000 * '9'}]",),
    ],
)
def test_names_at_their_limits(arguments: tuple[str, ...], cli) -> None:
    problem, *options = arguments
    ran = cli("run", "--problem", problem, "--route", "adjoint", *options)
    assert (ran.code, ran.err.count("\n")) == (2, 1)


def test_a_memory_store_is_a_file_like_any_other(cli, tmp_path: Path) -> None:
    assert cli("run", "--problem", "bar", "--route", "adjoint", "--min-time", "0", "--store", ":memory:").code == 0
    assert (tmp_path / ":memory:").stat().st_size > 0


def test_a_foreign_store_is_left_alone(tmp_path: Path, cli) -> None:
    with closing(sqlite3.connect(tmp_path / "foreign.sqlite")) as db:
        db.execute("PRAGMA application_id = 77")
    ran = cli("run", "--problem", "bar", "--route", "adjoint", "--store", "foreign.sqlite")
    assert (ran.code, "another program" in ran.err) == (2, True)


def holds_the_numbers(text: str) -> None:
    for word in ("problem", "memory", "tape", "closed", "adjoint"):
        assert word in text
    assert text.count("KiB") >= 2  # tapes
    assert text.count("MiB") >= 2  # memory
    assert "…" not in text


TAPES = ("--problem", "bar[n=8|1000]", "--route", "unrolled-ad[iterations=20]", "--route", "adjoint")


@pytest.mark.parametrize("columns", ["60", "100"])
def test_no_width_is_too_narrow_for_the_numbers(columns: str, cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    ran = cli("run", "--no-store", "--min-time", "0", *TAPES)
    holds_the_numbers(ran.out)


def test_no_terminal_is_too_narrow_for_the_numbers(tmp_path: Path) -> None:
    """On a narrow screen lines fold or wrap, but no unit and no column is cut off."""
    import pty

    leader, follower = pty.openpty()
    command = [str(Path(sys.executable).with_name("routes")), "run", "--no-store", "--no-isolate", "--min-time", "0"]
    child = subprocess.Popen(
        [*command, *TAPES],
        stdout=follower, stderr=subprocess.DEVNULL, cwd=tmp_path, env={**os.environ, "COLUMNS": "20"},
    )  # fmt: skip
    os.close(follower)
    shown = b""
    while True:
        try:
            more = os.read(leader, 65536)
        except OSError:
            break
        if not more:
            break
        shown += more
    child.wait()
    os.close(leader)
    holds_the_numbers(shown.decode())


def test_the_point_handed_to_routes_is_read_only() -> None:
    from gradient_routes.bench.cases.case import problems
    from gradient_routes.bench.cases.settings import Settings
    from gradient_routes.bench.execution.case_context import CaseContext

    (spec,) = problems(["bar"])
    p = CaseContext(spec, Settings()).p
    assert not p.flags.writeable
    np.testing.assert_array_equal(p, np.zeros(8))


def test_control_characters_of_others_reach_no_terminal(cli, tmp_path: Path) -> None:
    """A store may come from anywhere; a name, a reason or a word of a process may hold what retitles a terminal."""
    assert cli("run", "--problem", "bar[n=2]", "--route", "adjoint", "--min-time", "0").code == 0
    wild = "a\x1b[31mb\x07\x9b2J"
    with closing(sqlite3.connect(tmp_path / "results" / "routes.sqlite")) as db, db:
        db.execute("UPDATE cases SET problem = ?, reason = ?, stderr = ?, status = 'crashed'", (wild, wild, wild))
    for command in ("status", "report", "report --format md -o r.md", "compare results/routes.sqlite b\x1b[31m.json"):
        ran = cli(*command.split())
        said = ran.out + ran.err + ((tmp_path / "r.md").read_text() if "md" in command else "")
        assert said.count("[31m") > 0, command
        assert not [c for c in said if not c.isprintable() and c != "\n"], command
