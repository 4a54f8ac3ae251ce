"""Processes under limits: whatever a case does, it ends in a row, and nothing that it started goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import nullcontext
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from commands import FAULTY, MARK, PATIENCE, Shell, ended, eventually, faulty, sigint_ignored, words
from forks import Forks

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.case import ProblemSpec, RouteSpec
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.isolation import process as watching
from gradient_routes.bench.execution.isolation import worker_process as line
from gradient_routes.bench.execution.isolation.limits import POOLS, Limits
from gradient_routes.bench.execution.pruning import Pruning
from gradient_routes.bench.execution.sweep import How, run
from gradient_routes.bench.store.store import Store
from gradient_routes.routes.adjoint import adjoint

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


class Clock:
    """Goes as clocks do, and by 10 limits at once whenever so many more processes have reached their misdeed, and what
    they had said by then is heard: no limit is met before, however slow the machine.
    """

    TIMEOUT = 3600.0

    def __init__(self, patch: pytest.MonkeyPatch, folder: Path, hanging: int) -> None:
        self.folder, self.hanging, self.jumps, self.looks = folder / "reached", hanging, 0, 0
        self.folder.mkdir()
        self.sleep = time.sleep
        for name, value in {MARK: folder, "ROUTES_TEST_REACHED": self.folder}.items():
            patch.setenv(name, str(value))
        for module in (watching, line):
            patch.setattr(module, "time", self)

    def monotonic(self) -> float:
        if len(os.listdir(self.folder)) >= self.hanging * (self.jumps + 1):
            self.looks += 1
        if self.looks > HEARD * self.hanging:
            self.jumps, self.looks = self.jumps + 1, 0
        return time.monotonic() + 10 * self.TIMEOUT * self.jumps

    def run(self, chosen: list[str], jobs: int = 1) -> list[dict]:
        """Rows by any order."""
        settings = Settings(timed=False)
        how = How(limits=Limits(timeout=self.TIMEOUT), jobs=jobs)
        return [outcome.row for outcome in run(case.problems(chosen), case.routes(["fd-central"]), settings, how)]


HEARD = 20  # looks of a watcher, two a tick


def by_misdeed(rows: list[dict]) -> dict[str, dict]:
    return {row["problem_options"]["does"]: row for row in rows}


ENDS = {
    "nothing": ("ok", None),
    "nan": ("non-finite", "2 of 2 gradient components not finite"),
    "raise": ("failed", "ZeroDivisionError: division by zero"),
    "quit": ("failed", "SystemExit: 4"),
    "exit": ("crashed", "in its first forward solve: its process ended with exit code 3"),
    "leave": ("crashed", "its process ended with exit code 0"),
    "segfault": ("crashed", "its process was ended by SIGSEGV"),
    "orphan": ("crashed", "its process was ended by SIGABRT"),
    "kill": ("crashed", "its process was ended by SIGKILL"),
    "close": ("crashed", "its process ended with exit code 1"),
    "hang_up": ("crashed", "it closed its connection and was still running"),
    "take": ("out-of-memory", "MemoryError"),
    "take_by_jax": ("out-of-memory", "RESOURCE_EXHAUSTED"),
    "take_in_c": ("out-of-memory", "an allocation failed within --memory of 572 MiB: malloc"),
    "take_by_child": ("out-of-memory", "> 572 MiB of --memory"),
    "factorize": ("out-of-memory", "factors of R_u (10648 unknowns)"),
    "garbage": ("ok", None),
    "flood": ("ok", None),
    "abandon": ("ok", None),
    "daemonize": ("ok", None),
}
SAYS = {"garbage": "garbage of C", "flood": "the end", "take_in_c": "Cannot allocate memory", "close": "Bad file"}


def test_every_misdeed_is_a_row_with_its_reason(started: Shell) -> None:
    """What hangs up is killed without a limit; a daemon, which has left group and parent, stops nobody and is ended."""
    chosen = faulty(does="|".join(ENDS))
    limits = ("--timeout", "inf", "--memory", "600MB", "--jobs", "2")
    ran = started.run("run", "--json", "--no-timing", "--problem", chosen, "--route", "fd-central", *limits)
    assert ran.code == 1, "and stdout holds nothing but rows"
    rows = by_misdeed(ran.rows)
    assert {does: row["status"] for does, row in rows.items()} == {does: status for does, (status, _) in ENDS.items()}
    for does, (status, says) in ENDS.items():
        assert says is None or says in rows[does]["reason"], does
        assert SAYS.get(does, "") in (rows[does]["stderr"] or "")
        assert bool(rows[does]["traceback"]) == (status == "failed" or "Error" in (says or "") or does in TRACED)
    assert "garbage of Python\n\x1b[31mgarbage without an end" in rows["garbage"]["stderr"]
    kept = by_misdeed(Store(started.folder / "results" / "routes.sqlite").rows())
    assert kept == rows
    started.nothing_is_left()


TRACED = ("nan", "factorize", "take_by_jax")

HANGS = ("hang", "stubborn", "escape", "scribble")


def test_what_hangs_is_killed_with_all_that_it_started(started: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    """Signal handlers do not run in C; half a message on the line to the runner does not stop it either."""
    late = faulty(does="sleep", when=10, halved=True)
    clock = Clock(monkeypatch, started.folder, hanging=len(HANGS) + 1)
    rows = by_misdeed(clock.run([faulty(does="|".join(HANGS)), late], jobs=len(HANGS) + 1))
    assert clock.jumps == 1, "all of them were at it"
    for does in HANGS:
        assert rows[does]["status"] == "timeout", rows[does]["reason"]
        assert "in its first forward solve" in rows[does]["reason"]
        assert "after 3600 s of --timeout" in rows[does]["reason"]
    assert rows["sleep"]["status"] == "timeout"
    assert rows["sleep"]["gradient_error"] == pytest.approx(1.0), "a wrong gradient is known whatever comes after it"
    assert "its gradient was known by then, its error 1" in rows["sleep"]["reason"]
    started.nothing_is_left()


def test_a_case_that_ends_while_it_is_timed_leaves_the_others_alone(cli) -> None:
    routes = ("fd-central", "fd-one-sided", f"{FAULTY}:never_timed")
    chosen = [word for route in routes for word in ("--route", route)]
    ran = cli("run", "--json", "--min-time", "0.1", "--isolate", "--problem", f"{FAULTY}:Faulty", *chosen)
    rows = {row["route"]: row for row in ran.rows}
    assert [rows[route]["status"] for route in routes] == ["ok", "ok", "crashed"]
    died = rows[routes[2]]
    assert "crashed in timing: its process ended with exit code 3; its gradient was known by then" in died["reason"]
    assert died["peak_bytes"] is not None, "what was known is kept"
    assert rows["fd-central"]["interleaved"] == rows["fd-one-sided"]["interleaved"] == 3


KNOWN = """
import os
from gradient_routes.problems.bar import Bar

class Known(Bar):
    def reference(self, p):
        with open("asked", "a") as file:
            file.write(f"{os.getpid()}\\n")
        return super().reference(p)
"""


def test_a_reference_is_found_once_for_all_that_wait_for_their_timing(cli, tmp_path: Path) -> None:
    (tmp_path / "known.py").write_text(KNOWN)
    routes = [word for route in ("adjoint", "tangent") for word in ("--route", route)]
    ran = cli("run", "--json", "--min-time", "0", "--isolate", "--problem", "known.py:Known", *routes)
    assert [(row["status"], row["reference"]) for row in ran.rows] == [("ok", "closed form")] * 2
    assert {row["interleaved"] for row in ran.rows} == {2}
    assert len((tmp_path / "asked").read_text().split()) == 1


REFUSING = """
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.errors import DomainError

class Odd(DomainError):
    def __init__(self, n, what):
        super().__init__(f"refusing: n={n} {what} - choose an even n")

class Refusing(Bar):
    def __init__(self, *, n: int = 3):
        if n % 2:
            raise Odd(n, "is odd")
        super().__init__(n=n)
"""


@pytest.mark.parametrize("selector", ["refusing.py:Refusing", "refusing.py:Refusing[n=2|3]"])
def test_a_refusal_of_others_comes_through(cli, tmp_path: Path, selector: str) -> None:
    """Although their exception cannot be put together again."""
    (tmp_path / "refusing.py").write_text(REFUSING)
    ran = cli("run", "--problem", selector, "--route", "adjoint", "--isolate")
    assert (ran.code, ran.out, ran.err) == (2, "", "routes: refusing: n=3 is odd - choose an even n\n")


def test_kernels_forced_on_the_machine_are_not_those_of_a_case(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    process = watching.Confined("timeit", ["-n", "1", "input()"], Limits(), stdin=subprocess.PIPE)
    variables = Path(f"/proc/{process.process.pid}/environ").read_text()
    process.kill()
    process.process.stdin.close()
    assert "OPENBLAS_CORETYPE" not in variables
    assert "OPENBLAS_NUM_THREADS=1" in variables


def test_a_process_is_killed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its number may be another's afterwards."""
    process = watching.Confined("timeit", ["-n", "1", "pass"], Limits(), stdout=subprocess.DEVNULL)
    process.kill()
    monkeypatch.setattr(os, "killpg", lambda *_: pytest.fail("killed again"))
    process.kill()


def test_libraries_use_as_many_threads_as_they_may(started: Shell, cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the processor time of each thread, which others on the machine do not change."""
    for pool in POOLS:
        monkeypatch.setenv(pool, "2")
    allowed = str(max(os.sched_getaffinity(0)))
    libraries = "by_blas|by_xla|by_pardiso"
    command = ("run", "--json", "--no-timing", "--route", "fd-central", "--problem")
    isolated = cli(*command, faulty(does=libraries), "--threads", "1", "--isolate")
    here = started.run(*command, faulty(does="by_blas|by_pardiso"), "--threads", "1", "--no-isolate")
    said = [*(row["stderr"] for row in isolated.rows), *here.err.splitlines()]
    assert len(said) == 5
    assert all(float(line.removeprefix("busiest ")) > 0.9 for line in said), said
    (row,) = cli(*command, faulty(does="by_blas"), "--threads", "2", "--isolate").rows
    if len(os.sched_getaffinity(0)) > 1:
        assert float(row["stderr"].split()[1]) < 0.9, "this would be seen"
    (row,) = cli(*command, faulty(does="fingers"), "--affinity", allowed, "--isolate").rows
    assert row["stderr"] == f"processors [{allowed}]"


def test_larger_sizes_are_not_tried_after_a_limit_and_are_after_a_bug(cli) -> None:
    sizes = faulty(n="1|2|3", taken=300)
    bugs = faulty(n="2|3", does="raise")
    command = ("run", "--no-timing", "--problem", sizes, "--problem", bugs, "--route", "fd-central")
    ran = cli(*command, "--memory", "600MB", "--json", "--isolate")
    rows = [(row["problem_options"]["does"], row["n_param"], row["status"]) for row in ran.rows]
    assert rows == [
        *(("nothing", 1, "ok"), ("nothing", 2, "out-of-memory"), ("nothing", 3, "pruned")),
        *(("raise", 2, "failed"), ("raise", 3, "failed")),
    ]
    assert ran.rows[2]["reason"] == (
        "fd-central: out-of-memory at n_u = 0, n_p = 2 already - give more than --memory 572 MiB"
    )


def test_only_the_same_pair_is_pruned() -> None:
    """Options that are no sizes tell pairs apart; a smaller size in any direction is tried."""
    spec, route = ProblemSpec("x", {"n": 4, "seed": 1, "law": "a"}, None), RouteSpec("adjoint", adjoint, {"k": 1})
    pruning = Pruning()
    pruning.note(spec, route, (40, 4), empty_row() | {"status": "timeout", "timeout_s": 2.0})
    pruning.note(spec, route, (10, 1), empty_row() | {"status": "crashed"})

    def pruned(size: tuple[int, int], k: int = 1, **options: object) -> bool:
        other = ProblemSpec("x", spec.options | options, None)
        return pruning.reason(other, RouteSpec("adjoint", adjoint, {"k": k}), size) is not None

    assert pruned((80, 8), n=8)
    assert pruned((40, 8), n=8)
    assert not pruned((40, 4)), "itself is tried again"
    assert not pruned((20, 8), n=8)
    assert not pruned((80, 8), n=8, law="b")
    assert not pruned((80, 8), n=8, seed=2)
    assert not pruned((80, 8), k=2, n=8)


@pytest.mark.parametrize(("jobs", "name", "ignored"), [("1", "SIGTERM", False), ("3", "SIGINT", True)])
def test_an_interrupted_run_shows_what_is_done_and_how_to_go_on(
    started: Shell, jobs: str, name: str, ignored: bool
) -> None:
    """Also where it was started with SIGINT ignored, as what shells start in the background is."""
    given = ("run", "--problem", faulty(does="nothing"), "--problem", faulty(does="sleep"), "--route", "fd-central")
    with sigint_ignored() if ignored else nullcontext():
        process = started.start(*given, "--no-timing", "--jobs", jobs)
    started.asleep()
    eventually(lambda: bool(Store(started.folder / "results" / "routes.sqlite").latest()))
    process.send_signal(signal.Signals[name])
    ran = ended(process)
    assert ran.code == 130
    assert ran.out.count("fd-central") >= 1
    assert ran.err.count("\n") == 1
    assert "what is finished is printed, and kept unless --no-store; go on with: routes run --problem" in ran.err
    assert ran.err.endswith("--resume\n")
    (kept,) = Store(started.folder / "results" / "routes.sqlite").rows()
    assert (kept["status"], kept["problem_options"]["does"]) == ("ok", "nothing")
    started.nothing_is_left()


@pytest.mark.parametrize("given", [("run", "--problem", faulty(does="hang"), "--route", "fd-central"), ("check",)])
def test_a_killed_runner_takes_its_worker_with_it(started: Shell, given: tuple[str, ...]) -> None:
    """Hanging in C or not. What a worker had started, nobody is there to end."""
    process = started.start(*given, *([f"{FAULTY}:Sleeping"] if given == ("check",) else []))
    eventually(lambda: len(started.alive()) >= 2)
    process.kill()
    process.communicate()
    eventually(lambda: not any("bench." in word for left in started.alive() for word in words(left)))


def test_nothing_beside_a_file_or_in_the_folder_hides_a_library(tmp_path: Path) -> None:
    """Nor does a path with spaces and letters of other alphabets stop anyone."""
    folder = tmp_path / "mødels of mine"
    (folder / "problems").mkdir(parents=True)
    (folder / "problems" / "__init__.py").write_text("raise ImportError('not this one')")
    for name in ("bench", "routes", "jax", "numpy", "scipy", "click", "psutil", "types", "random", "beside"):
        says = "raise ImportError('not this one')" if name != "beside" else "from faulty import Faulty, Sound"
        (folder / f"{name}.py").write_text(says)
    (folder / "faulty.py").write_text(FAULTY.read_text())
    (folder / "модель 1.py").write_text("from beside import Faulty, Sound")
    shell = Shell(folder)
    chosen = ("--problem", "bar[n=2]", "--problem", "модель 1.py:Faulty", "--route", "implicit-ad")
    ran = shell.run("run", "--json", "--no-timing", *chosen)
    assert [row["status"] for row in ran.rows] == ["ok", "skipped"], ran.err
    assert shell.run("check", "модель 1.py:Sound", "--no-plot").code == 0


IMPORTED = """
import ctypes, os, sys
if "gradient_routes.bench.execution.isolation.worker" in sys.orig_argv:
    {}
from faulty import Faulty
"""


def test_a_file_may_misbehave_in_a_worker_only(started: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    """While it is imported there: the survey of sizes goes on, too."""
    (started.folder / "faulty.py").write_text(FAULTY.read_text())
    reached = "open(os.environ['ROUTES_TEST_REACHED'] + f'/{os.getpid()}', 'w').close()"
    misdeeds = {"hangs": f"{reached}; ctypes.PyDLL(None).sleep(987)", "leaves": "os._exit(0)", "raises": "1 / 0"}
    for name, misdeed in misdeeds.items():
        (started.folder / f"{name}.py").write_text(IMPORTED.format(misdeed))
    clock = Clock(monkeypatch, started.folder, hanging=1)
    monkeypatch.chdir(started.folder)
    found = clock.run([f"{name}.py:Faulty" for name in (*misdeeds, "faulty")])
    assert clock.jumps == 2, "in the survey, and as a case"
    rows = {row["problem"].partition(".")[0]: row for row in found}
    assert {name: row["status"] for name, row in rows.items()} == {
        "hangs": "timeout", "leaves": "crashed", "raises": "failed", "faulty": "ok",
    }  # fmt: skip
    assert "in its start" in rows["raises"]["reason"]
    assert "cannot be imported: ZeroDivisionError" in rows["raises"]["reason"]
    assert "ZeroDivisionError" in rows["raises"]["traceback"]
    started.nothing_is_left()


def test_a_gradient_of_many_components_comes_through(cli, tmp_path: Path) -> None:
    n = 100_000  # more bytes than any pipe or socket holds
    given = ("--problem", f"{FAULTY}:Faulty[n={n}]", "--route", f"{FAULTY}:itself", "--gradient", "g.csv")
    ran = cli("run", *given, "--no-timing", "--no-store", "--isolate")
    assert ran.code == 0, ran.err
    with (tmp_path / "g.csv").open() as file:
        assert sum(1 for _ in file) == n + 1


def test_what_c_prints_is_no_result_without_processes_either(forks: Forks, tmp_path: Path) -> None:
    chosen = ("--problem", faulty(does="garbage", when="0|1"), "--problem", "bar", "--route", "fd-central")
    ran = forks.run(tmp_path, "run", "--json", "--no-isolate", "--min-time", "0", "--no-store", *chosen)
    assert [row["status"] for row in ran.rows] == ["ok"] * 3


def test_a_late_reader_reads_nothing_of_the_next_case(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whose line may have the descriptor of the last."""
    received = Connection._recv

    def late(descriptor: int, size: int) -> bytes:
        time.sleep(0.1)
        return os.read(descriptor, size)

    monkeypatch.setattr(Connection, "_recv", lambda self, size: received(self, size, read=late))
    problems, routes = case.problems([faulty(n="1|2")]), case.routes(["fd-central"])
    settings, how = Settings(timed=False), How(limits=Limits(timeout=PATIENCE))
    assert [o.row["status"] for o in run(problems, routes, settings, how)] == ["ok"] * 2


def test_no_descriptor_is_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    problems, routes = case.problems([faulty(does="nothing|exit")]), case.routes(["fd-central"])
    settings, how = Settings(timed=False), How(limits=Limits(timeout=PATIENCE))
    counts = []
    for _ in range(2):
        assert [o.row["status"] for o in run(problems, routes, settings, how)] == ["ok", "crashed"]
        counts.append(len(os.listdir("/proc/self/fd")))
    assert counts[0] == counts[1]


def test_an_allocation_that_superlu_misses_is_no_singular_matrix(monkeypatch: pytest.MonkeyPatch) -> None:
    import scipy.sparse
    import scipy.sparse.linalg

    from gradient_routes.bench.cases.status import status_of
    from gradient_routes.routes.solvers.factorization import Factorizer

    def splu(A: object) -> None:
        raise RuntimeError("SUPERLU_MALLOC fails for buf in intCalloc() at line 173 in file memory.c\n")

    monkeypatch.setattr(scipy.sparse.linalg, "splu", splu)
    with pytest.raises(MemoryError, match="factors of R_u") as failure:
        Factorizer("superlu")(scipy.sparse.eye_array(3).tocsc(), "x")
    assert status_of(failure.value) == "out-of-memory"
