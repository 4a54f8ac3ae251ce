"""The store: kept, exported, survives kills, shared by writers, refuses what is not its own."""

from __future__ import annotations

import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pandas as pd
import pytest
from commands import PATIENCE, shell

from gradient_routes.bench.cases.column import Column
from gradient_routes.bench.cases.row import COLUMNS, SAMPLES, STORED, empty_row
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.store.schema import KEY, tables
from gradient_routes.bench.store.store import SCHEMA, Store
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.tally import KINDS

RUN = ("run", "--problem", "bar[n=1|2]", "--route", "adjoint", "--route", "tangent", "--no-timing")


def row(**values):
    return empty_row() | {"problem": "bar", "route": "adjoint", "status": "ok"} | values


def test_rows_come_back_as_they_went_in(tmp_path: Path) -> None:
    store = Store(tmp_path / "s.sqlite")
    work = {kind: i for i, kind in enumerate(KINDS)}
    kept = row(
        problem_options={"n": 8}, gradient=[0.1, -0.0, 1e-300], work=work, predicted_work=None, objective=0.1 + 0.2
    )
    store.append(kept, Samples((0.1, 0.2), (0.3, 0.4)))
    assert store.rows() == [kept]
    names, samples = store.table("samples")
    assert names == [c.name for c in SAMPLES]
    assert samples == [
        (1, "gradient", 0, 0.1),
        (1, "gradient", 1, 0.2),
        (1, "forward", 0, 0.3),
        (1, "forward", 1, 0.4),
    ]


def test_not_a_number_is_absent_and_huge_counts_are_kept(tmp_path: Path) -> None:
    store = Store(tmp_path / "s.sqlite")
    wild = {"load": float("nan"), "steps": [1.0, float("inf")]}
    store.append(row(objective=float("nan"), problem_options=wild, predicted_tape_bytes=2**80), None)
    (back,) = store.rows()
    assert (back["objective"], back["problem_options"]) == (None, {"load": None, "steps": [1.0, None]})
    assert back["predicted_tape_bytes"] == 2.0**80


def test_an_unknown_table_is_one_line(cli) -> None:
    ran = cli("export", "--table", "casse")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "no table 'casse' - did you mean 'cases'?" in ran.err


def test_a_store_of_an_older_schema_gets_the_tables_of_studies(tmp_path: Path) -> None:
    store = Store(tmp_path / "s.sqlite")
    store.append(row(), None)
    with closing(sqlite3.connect(store.path)) as db:
        db.execute("DROP TABLE studies")
        db.execute("PRAGMA user_version = 2")
    assert store.table("studies")[1] == []
    store.check_writable()
    assert store.rows() == [row()]
    with closing(sqlite3.connect(store.path)) as db:
        assert db.execute("PRAGMA user_version").fetchone()[0] == SCHEMA


def test_a_study_installed_later_gets_its_tables_and_columns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the number of the schema, which is that of this project's own tables."""
    store, known = Store(tmp_path / "s.sqlite"), tables()
    store.append(row(), None)
    x, y = Column("x", "REAL", "m", "a length"), Column("y", "TEXT", "", "an object", json=True)
    for columns in ((x,), (x, y)):
        new = known | {"installed": (KEY, *columns)}
        monkeypatch.setattr("gradient_routes.bench.store.store.tables", lambda new=new: new)
        store.append_study("installed", {"installed": [{"x": 1.0, "y": {"z": 2}}]}, "today")
    assert [(r["x"], r["y"]) for r in store.records("installed")] == [(1.0, None), (1.0, {"z": 2})]
    assert store.rows() == [row()]


def test_the_store_is_append_only_and_counts_up(cli) -> None:
    cli(*RUN)
    first = Store("results/routes.sqlite").table("cases")[1]
    cli(*RUN)
    assert Store("results/routes.sqlite").table("cases")[1][: len(first)] == first
    assert [r[0] for r in Store("results/routes.sqlite").table("cases")[1]] == list(range(1, 9))


def test_no_store_keeps_nothing(cli, tmp_path: Path) -> None:
    assert cli(*RUN, "--no-store").code == 0
    assert not list(tmp_path.iterdir())


def test_exports_hold_the_same_numbers_in_every_format(cli, tmp_path: Path) -> None:
    ran = cli(*RUN[:-1], "--min-time", "0.01", "--json")
    frames = {}
    for format, read in (("csv", pd.read_csv), ("parquet", pd.read_parquet), ("json", pd.read_json)):
        assert cli("export", "--table", "cases", "--format", format, "-o", f"cases.{format}").code == 0
        frames[format] = read(tmp_path / f"cases.{format}")
    for frame in frames.values():
        assert list(frame["gradient_norm"]) == pytest.approx([r["gradient_norm"] for r in ran.rows], rel=1e-14)
        assert list(frame["work_solves"]) == [r["work"]["solves"] for r in ran.rows]
        assert {c.name for c in STORED} <= set(frame.columns)
    assert cli("export", "--table", "samples").out.startswith("case_id,kind,round,seconds\n")
    (environment,) = json.loads(cli("export", "--table", "environments", "--format", "json").out)
    assert environment["cores"] == os.cpu_count()
    assert json.loads(environment["versions"])["numpy"]


def test_no_format_loses_a_digit_or_a_type(cli, tmp_path: Path) -> None:
    Store("results/routes.sqlite").append(
        row(objective=1.4641234567890123e-12, gradient_norm=1e-300, seconds=1.0), None
    )
    for format, read in (("csv", pd.read_csv), ("parquet", pd.read_parquet)):
        assert cli("export", "--format", format, "-o", f"cases.{format}").code == 0
        frame = read(tmp_path / f"cases.{format}")
        assert (frame["objective"][0], frame["gradient_norm"][0]) == (1.4641234567890123e-12, 1e-300)
    (back,) = json.loads(cli("export", "--format", "json").out)
    assert (back["objective"], back["gradient_norm"]) == (1.4641234567890123e-12, 1e-300)
    types = pd.read_parquet(tmp_path / "cases.parquet").dtypes.astype(str)
    assert (types["seconds"], types["residual"], types["n_param"], types["reason"]) == (
        "Float64", "Float64", "Int64", "string",
    )  # fmt: skip


def test_export_to_where_one_cannot_write(cli) -> None:
    cli(*RUN)
    ran = cli("export", "-o", "nowhere/x.csv")
    assert (ran.code, ran.err.count("\n")) == (2, 1)


def test_report_prints_what_was_kept(cli) -> None:
    cli(*RUN)
    out = cli("report").out
    assert "bar[n=1]" in out
    assert out.count("adjoint") == 2


def is_one_line(error: pytest.ExceptionInfo[InputError], says: str) -> bool:
    text = str(error.value)
    return says in text and "\n" not in text and " - " in text


def test_stores_that_are_none_are_refused(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("this is no database, but it is long enough to have a header to look at")
    with closing(sqlite3.connect(tmp_path / "other")) as db:
        db.execute("CREATE TABLE songs (title TEXT)")
        db.commit()
    for path, says in ((tmp_path, "directory"), (tmp_path / "text", "not a database"), (tmp_path / "other", "another")):
        with pytest.raises(InputError) as error:
            Store(path).check_writable()
        assert is_one_line(error, says)
    with pytest.raises(InputError) as error:
        Store(tmp_path / "text" / "below.sqlite").check_writable()
    assert is_one_line(error, "text")


def test_a_newer_schema_is_refused(tmp_path: Path) -> None:
    store = Store(tmp_path / "s.sqlite")
    store.append(row(), None)
    with closing(sqlite3.connect(store.path)) as db:
        db.execute(f"PRAGMA user_version = {SCHEMA + 1}")
    for use in (store.check_writable, store.rows):
        with pytest.raises(InputError, match=f"schema {SCHEMA + 1}"):
            use()


def test_a_store_that_cannot_be_written_is_refused_before_anything_runs(cli) -> None:
    ran = cli(*RUN, "--store", "/proc/routes.sqlite")  # not even root may write there
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.count("\n") == 1


def test_two_processes_write_at_once(tmp_path: Path) -> None:
    command = [str(Path(sys.executable).with_name("routes")), *RUN, "--no-isolate"]
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    children = [subprocess.Popen(command, cwd=tmp_path, text=True, **pipes) for _ in range(2)]
    assert [child.communicate(timeout=PATIENCE)[1] for child in children] == [""] * 2
    assert [child.returncode for child in children] == [0] * 2
    assert len(Store(tmp_path / "results" / "routes.sqlite").rows()) == 8


@pytest.mark.parametrize(("seed", "latest", "options"), [(0, 1.0, ()), (1, 0.2, ("--no-isolate",)),
                                                         (2, 0.2, ("--no-isolate",))])  # fmt: skip
def test_a_kill_loses_at_most_the_case_in_flight(
    tmp_path: Path, seed: int, latest: float, options: tuple[str, ...]
) -> None:
    """Every row that was printed had been kept before; killed at a random moment after the first."""
    command = [str(Path(sys.executable).with_name("routes")), "run", "--json", "--problem", "bar[n=1|2|3|4|5|6|7|8]"]
    command += ["--route", "adjoint", "--route", "tangent", *options]
    child = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    first = child.stdout.readline()
    time.sleep(random.Random(seed).uniform(0.0, latest))
    child.send_signal(signal.SIGKILL)
    rest, _ = child.communicate()
    printed = [json.loads(line) for line in [first, *rest.splitlines(keepends=True)] if line.endswith("\n")]
    assert printed
    store = Store(tmp_path / "results" / "routes.sqlite")
    kept = store.rows()
    assert kept[: len(printed)] == printed
    assert len(kept) <= len(printed) + 1
    store.append(row(), None)  # and it opens again
    assert len(store.rows()) == len(kept) + 1


@pytest.mark.parametrize(
    "verb", ["report", "status", "baseline", "compare results/routes.sqlite results/routes.sqlite"]
)
def test_a_value_that_is_none_of_its_column_is_named(cli, verb: str) -> None:
    store = Store("results/routes.sqlite")
    store.append(row(problem_options={}, route_options={}, case_key="a"), None)
    with closing(sqlite3.connect(store.path)) as db:
        db.execute("UPDATE cases SET problem_options = '{broken'")
        db.commit()
    ran = cli(*verb.split())
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert "cases, case_id 1, problem_options: no JSON" in ran.err


def test_an_empty_file_is_an_empty_store(tmp_path: Path) -> None:
    """What a kill before the first commit leaves."""
    store = Store(tmp_path / "s.sqlite")
    store.path.touch()
    with pytest.raises(InputError, match="is empty - run"):
        store.rows()
    store.append(row(), None)
    assert len(store.rows()) == 1


def test_every_column_is_documented() -> None:
    assert all(column.meaning for column in (*COLUMNS, *STORED, *SAMPLES))


def test_the_shell_sees_the_same(cli, tmp_path: Path) -> None:
    assert cli("run", "--problem", "bar", "--route", "adjoint", "--no-timing").code == 0
    done = shell("routes export --format parquet | wc -c", tmp_path)
    assert done.returncode == 0
    assert int(done.stdout.split()[-1]) > 1000
