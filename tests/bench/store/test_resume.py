"""Cases by what their answers rest on: what is missing, failed or stale is run again, and nothing else is."""

from __future__ import annotations

import shlex
import sqlite3
import subprocess
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from commands import PATIENCE, Ran, shell, with_routes
from forks import Forks

from benchmarks.faults import sound
from gradient_routes.bench.cases import environment, keys, sources
from gradient_routes.bench.cases.row import STATUSES, empty_row
from gradient_routes.bench.store import resume
from gradient_routes.bench.store.keeping import apart, kept_apart
from gradient_routes.bench.store.resume import OPEN, add_kept_apart, state_of, still_open
from gradient_routes.bench.store.store import Store

MODEL = '''
from pathlib import Path
import numpy as np
from gradient_routes.problems.problem import Offers, Parameters, Problem
from power import POWER

class Model(Problem):
    """J = sum p^POWER, once the file says so."""

    name = "model"
    offers = Offers.VALUE

    def __init__(self, *, n: int = 2, data: str = "data.csv", fails: bool = False) -> None:
        self.fails = fails
        self.parameters = Parameters(start=np.ones(n) * float(Path(data).read_text()), scale=np.ones(n))

    def value(self, p):
        return 1 / 0 if self.fails else float((p**POWER).sum())
'''


@pytest.fixture
def plugin(tmp_path: Path) -> Path:
    """A problem in a file, what it imports from beside, the data it reads, and what it has nothing to do with."""
    (tmp_path / "model.py").write_text(MODEL)
    (tmp_path / "power.py").write_text("POWER = 2\n")
    (tmp_path / "data.csv").write_text("1\n")
    (tmp_path / "other.py").write_text("OTHER = 1\n")
    return tmp_path


RUN = ("run", "--no-isolate", "--min-time", "0", "--json")


def running(forks: Forks, folder: Path) -> Callable[..., list[str]]:
    def ran(*arguments: str) -> list[str]:
        """Which cases were run again, by route and n."""
        options = ("--problem", "model.py:Model[n=2|3]", "--route", "fd-central", "--route", "fd-one-sided")
        done = forks.run(folder, *RUN, *options, *arguments)
        assert done.code == 0, done.err
        return sorted(f"{row['route']} {row['n_param']}" for row in done.rows)

    return ran


CASE = ("run", "--json", "--min-time", "0", "--problem", "model.py:Model", "--route", "fd-central")
ALL = ["fd-central 2", "fd-central 3", "fd-one-sided 2", "fd-one-sided 3"]


def test_an_answer_is_stale_once_anything_that_it_rests_on_has_changed(plugin: Path, forks: Forks) -> None:
    ran = running(forks, plugin)
    assert ran() == ALL
    assert ran("--resume") == []
    (plugin / "other.py").write_text("OTHER = 2\n")
    (plugin / "README").write_text("of no consequence")
    (plugin / "model.py").touch()
    assert ran("--resume") == [], "what it does not import is nothing to it, nor is a date"
    (plugin / "model.py").write_text(MODEL.replace("float((", "float(3 * ("))
    assert ran("--only", "missing") == ran("--only", "failed") == []
    assert ran("--resume") == ALL
    (plugin / "power.py").write_text("POWER = 3\n")
    assert ran("--only", "stale") == ALL
    assert ran("--only", "stale") == []
    (plugin / "data.csv").write_text("2\n")
    assert ran("--only", "all", "--problem", "model.py:Model[n=2]") == ALL
    assert ran("--resume") == []
    assert len(Store(plugin / "results" / "routes.sqlite").rows()) == 16, "nothing is replaced"


def test_what_is_missing_or_failed_is_run_and_told_from_what_is_done(plugin: Path, cli) -> None:
    sweep = (*CASE, "--problem", "model.py:Model[fails=true]")
    assert cli(*CASE).code == 0
    told = {}
    for only in ("failed", "missing", "missing", "failed", "stale", "all"):
        done = cli(*sweep, "--only", only)
        told.setdefault(only, []).append([row["problem_options"]["fails"] for row in done.rows])
        assert f"{len(done.rows)} of 2 cases run" in done.err
    assert told == {"failed": [[], [True]], "missing": [[True], []], "stale": [[]], "all": [[False, True]]}
    assert [row["status"] for row in cli(*sweep, "--resume").rows] == ["failed"], "what failed is no answer"


def test_other_settings_are_another_case(plugin: Path, cli) -> None:
    for given, count in (
        ((), 1), ((), 0), (("--rtol", "1e-9"), 1), (("--no-timing",), 1), (("--threads", "2"), 1),
        (("--budget", "1"), 0), (("--min-time", "0.01"), 0),
        (("--components", "1"), 1), (("--components", "1", "--seed", "1"), 1),
    ):  # fmt: skip
        assert len(cli(*CASE, "--resume", *given).rows) == count, given


def test_what_was_too_dear_waits_for_a_larger_budget(plugin: Path, cli) -> None:
    for budget, statuses in (("1e-9", ["skipped"]), ("1e-9", []), ("1e-10", []), ("inf", ["ok"]), ("1e-9", [])):
        assert [row["status"] for row in cli(*CASE, "--resume", "--budget", budget).rows] == statuses


def kept(**values: object) -> dict:
    return empty_row() | {"status": "ok", "content_key": "a", "budget_s": 60.0} | values


def test_states() -> None:
    row = kept()
    assert state_of(row, None) == "missing"
    assert state_of(row, kept(content_key="b")) == "stale"
    states = {status: state_of(row, kept(status=status)) for status in STATUSES}
    assert states == dict.fromkeys(STATUSES, "failed") | {"ok": "done", "skipped": "done", "pruned": "missing"}
    assert state_of(row, kept(status="crashed"), expected=lambda kept: True) == "done"
    assert state_of(row, kept(status="crashed", content_key="b"), expected=lambda kept: True) == "stale"
    for before, now, state in (
        (60.0, 61.0, "missing"),
        (60.0, None, "missing"),
        (60.0, 60.0, "done"),
        (None, 5, "done"),
    ):
        assert state_of(kept(budget_s=now), kept(status="skipped", budget_s=before)) == state
    for price, state in (
        ({"price_s": 2.0, "price_cpu_s": 2.0}, "done"),
        ({"price_s": 2.0, "price_cpu_s": 8.0}, "done"),  # of several threads
        ({"price_s": 8.0, "price_cpu_s": 2.0}, "stale"),  # it waited three quarters of its time
        ({}, "stale"),  # as kept before prices were
    ):
        assert state_of(row, kept(status="skipped", predicted_s=99.0, **price)) == state
        assert state_of(row, kept(seconds=1.0, predicted_s=99.0, **price)) == "done"


def content(monkeypatch: pytest.MonkeyPatch, **changed: object) -> str:
    from gradient_routes.bench.cases import case
    from gradient_routes.bench.cases.settings import Settings

    for name, value in changed.items():
        monkeypatch.setattr(keys, name, value)
    (problem,), (route,) = case.problems(["bar"]), case.routes(["adjoint"])
    return keys.identity(problem, route, Settings(), 1)["content_key"]


def test_versions_of_libraries_and_of_the_harness_are_in_the_key(monkeypatch: pytest.MonkeyPatch) -> None:
    before = content(monkeypatch)
    assert content(monkeypatch) == before
    newer = environment.versions() | {"scipy": "99.0"}
    assert content(monkeypatch, versions=lambda: newer) != before
    assert content(monkeypatch, versions=environment.versions) == before
    assert content(monkeypatch, HARNESS=keys.HARNESS + 1) != before


FLOOR = "gradient_routes/problems"
BAR = f"{FLOOR}/bar.py"


def test_the_source_of_a_problem_is_all_that_it_imports_of_its_own() -> None:
    found = {
        path.relative_to(sources.HERE) for path in sources.closure(sources.HERE / BAR, sources.HERE, "gradient_routes")
    }
    names = {str(path) for path in found}
    assert {BAR, f"{FLOOR}/problem.py", f"{FLOOR}/matrices/tridiagonal.py"} <= names
    assert not any(name.startswith("bench/") for name in names), "the harness has a number of its own"
    assert "problems/fem/assembly_jax.py" not in names


def test_relative_imports_and_packages_are_followed(tmp_path: Path) -> None:
    for path, text in {
        "own/__init__.py": "from . import a", "own/a.py": "from .b import c\nimport numpy",
        "own/b.py": "def f(): import own.d", "own/d.py": "", "own/e.py": "", "other.py": "",
    }.items():  # fmt: skip
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text)
    found = sources.closure(tmp_path / "own" / "a.py", tmp_path, "own")
    assert {str(path.relative_to(tmp_path)) for path in found} >= {"own/a.py", "own/b.py", "own/d.py"}
    assert not {"own/e.py", "other.py"} & {str(path.relative_to(tmp_path)) for path in found}


def test_two_runners_of_one_sweep_lose_no_row(plugin: Path) -> None:
    command = ["routes", "run", "--no-isolate", "--min-time", "0", "--json", "--resume", "--route", "fd-central"]
    command += ["--problem", "model.py:Model[n=1|2|3|4|5|6|7|8|9|10]"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    runners = [subprocess.Popen(command, cwd=plugin, env=with_routes(), **pipes) for _ in range(2)]
    printed = [Ran(runner.wait(), *out) for runner, out in [(r, r.communicate(timeout=PATIENCE)) for r in runners]]
    assert [done.code for done in printed] == [0, 0], [done.err for done in printed]
    rows = Store(plugin / "results" / "routes.sqlite").rows()
    every = [(row["case_key"], row["started"]) for done in printed for row in done.rows]
    assert Counter((row["case_key"], row["started"]) for row in rows) == Counter(every)
    assert len({row["case_key"] for row in rows}) == 10


def test_a_full_disk_loses_no_printed_row_and_harms_no_store(plugin: Path, forks: Forks) -> None:
    sizes = [*range(50, 60)]
    sweep = ("--problem", f"model.py:Model[n={'|'.join(map(str, sizes))}]", "--route", "fd-central", "--resume")
    assert forks.run(plugin, *RUN, "--problem", "model.py:Model[n=50]", "--route", "fd-central").code == 0
    store = Store(plugin / "results" / "routes.sqlite")
    before = store.rows()
    while store.path.stat().st_size < 2**18:  # what others have measured, more than is kept apart
        store.append_all([(empty_row(), None, None)] * 50)
    others, blocks = len(store.rows()) - 1, store.path.stat().st_size // 512
    done = shell(f"ulimit -f {blocks}; exec routes {shlex.join((*RUN, *sweep))}", plugin)
    full = Ran(done.returncode, done.stdout, done.stderr)
    assert full.code == 1
    assert [row["n_param"] for row in full.rows] == sizes[1:], "what is measured is printed"
    assert full.err.count("\n") == 2
    assert sound(store.path)
    assert store.rows()[0] == before[0]
    kept = len(store.rows()) - others
    waiting = len(sizes) - kept
    assert f"{waiting} rows not kept: store" in full.err
    (path,) = (plugin / "results").glob("routes-unsaved-*.sqlite")
    assert [row["n_param"] for row in Store(path).rows()] == sizes[kept:]
    again = forks.run(plugin, *RUN, *sweep)
    assert (again.rows, path.exists()) == ([], False)
    assert f"{waiting} cases and 0 studies of {path} added to results/routes.sqlite" in again.err
    assert len(store.rows()) == others + len(sizes)


def test_what_another_runner_keeps_apart_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At once, and after a third has added it to the store, between the two looks as well."""
    done = empty_row() | {"case_key": "1", "content_key": "2", "status": "ok"}
    store = Store(tmp_path / "s.sqlite")
    wanted = still_open(store, OPEN, lambda row: False)
    assert wanted(done)
    for name in ("t", "s"):  # the first is of another store
        apart(Store(tmp_path / f"{name}.sqlite"), lambda other: other.append(done, None), "")
        assert wanted(done) == (name == "t")
    assert wanted(done | {"content_key": "3"})
    (path,) = kept_apart(store)
    path.with_name(path.name + "-2.sqlite").touch()  # of a runner that was killed before it wrote it
    monkeypatch.setattr(resume, "_is_in", lambda other, row: not add_kept_apart(store) and False)
    assert not wanted(done)
    assert (len(store.rows()), path.exists(), len(kept_apart(store))) == (1, False, 1)


def test_what_cannot_be_added_is_said(tmp_path: Path) -> None:
    """Its cases count as done: nobody runs them, and they are in no store."""
    store = Store(tmp_path / "s.sqlite")
    store.append(empty_row(), None)
    apart(store, lambda other: other.append(empty_row() | {"case_key": "1"}, None), "")
    (path,) = kept_apart(store)
    with closing(sqlite3.connect(path)) as db:
        db.execute("CREATE TABLE strange (study_id INTEGER)")
        db.commit()
    (line,) = add_kept_apart(store)
    assert "has a table 'strange' - install the study that it is of; cases in it count as done" in line
    assert path.exists()


def test_a_row_of_an_older_schema_is_missing(plugin: Path, forks: Forks) -> None:
    """It has no key: what it was an answer to is not known."""
    ran = running(forks, plugin)
    assert ran() == ALL
    with closing(sqlite3.connect(plugin / "results" / "routes.sqlite")) as db:
        for statement in ("DROP INDEX by_case", "ALTER TABLE cases DROP COLUMN case_key", "PRAGMA user_version = 3"):
            db.execute(statement)
        db.commit()
    assert ran("--resume") == ALL
    assert ran("--resume") == []


WATCH = """from pathlib import Path
import model


class Model(model.Model):
    def value(self, p):
        here = Path(__file__)
        here.write_text(here.read_text() + "#")
        return super().value(p)
"""


def test_a_source_that_changes_while_it_runs_gives_no_row_under_its_old_name(plugin: Path, forks: Forks) -> None:
    """What ran of the other code is no answer of this one."""
    (plugin / "watch.py").write_text(WATCH)
    done = forks.run(plugin, *"run --json --no-timing --problem watch.py:Model --route fd-central".split())
    (row,) = done.rows
    assert row["status"] == "failed"
    assert "watch.py has changed since the run began - run it again" in row["reason"]
