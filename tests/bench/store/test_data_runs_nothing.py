"""Stores and baselines are data: no verb that reads them runs the code that they name."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path

import click
import pytest
from commands import ROOT
from forks import Forks

from gradient_routes.bench.cli import main
from gradient_routes.bench.store.store import Store

CODE = """
import os
from typing import Annotated

from gradient_routes.problems.bar import Bar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Offers, route

if os.environ.get("MARK") == "exit":
    open(os.environ.get("MARKED", os.devnull), "a").write(__name__)
    os._exit(0)


class Mine(Bar):
    def __init__(self, *, n: Annotated[int, "elements"] = 2) -> None:
        super().__init__(n=n)


@route("way", needs=Offers.SOLVE, cost=adjoint.cost)
def way(model: Model, p, *, factors: Annotated[str, "as the adjoint has them"] = "refined"):
    return adjoint.function(model, p, factors=factors)
"""
EXPECTED = """
[[expected]]
problem = "mine.py:Mine"
route = "mine.py:way"
status = "timeout"
reason = "names code, too"
"""
MEASURED = (
    "run --problem mine.py:Mine[n=2|3] --problem minemod:Mine --route mine.py:way --route adjoint --no-timing",
    "scaling --problem mine.py:Mine[n=2|4|8] --route mine.py:way --route minemod:way --min-time 0",
    "tolerance --problem mine.py:Mine --route mine.py:way --route adjoint --per-decade 1 --tightest 1e-4",
    "check --problem mine.py:Mine --route mine.py:way --no-plot",
)


@pytest.fixture(scope="module")
def sent(tmp_path_factory: pytest.TempPathFactory, forks: Forks) -> Path:
    """A folder with a store and a baseline that name a file and a module."""
    folder = tmp_path_factory.mktemp("sent")
    for name in ("mine.py", "minemod.py"):
        (folder / name).write_text(CODE)
    for command in (*(f"{measured} --no-isolate" for measured in MEASURED), "baseline -o baseline.json"):
        done = forks.run(folder, *command.split(), PYTHONPATH=str(folder))
        assert done.code == 0, done.err
    (folder / "results" / "expected.toml").write_text(EXPECTED)
    return folder


def reading(folder: Path) -> list[list[str]]:
    """Every verb that reads data, with each of its formats: those that need no problem, and those that resume."""
    found: list[list[str]] = []
    resumed: list[list[str]] = []  # last, for they add to the store
    for name, command in main.commands.items():
        options = {p.name: p for p in command.params if isinstance(p, click.Option)}
        files = [p for p in command.params if isinstance(p, click.Argument) and isinstance(p.type, click.Path)]
        named = ["results/routes.sqlite", "baseline.json"]
        words = [name, *named[: len(files)]]
        if name == "lab":  # a server, which would not end here
            continue
        if {"selector", "isolate"} & {*options}:  # it measures
            words += ["--problem", "bar", "--no-isolate"] + ["--no-timing"] * ("timed" in options)
            words += ["--route", "adjoint"] * ("routes" in options)
            resumed += [[*words, "--resume"]] if "resume" in options else []
            continue
        assert "store" in options or files or name in ("list", "environments"), (
            f"{name}: say here how it is called on a store"
        )
        if name == "merge":  # into another one
            words += ["--store", "merged.sqlite"]
        found.append(words)
        if len(files) > 1:
            found.append([name, *reversed(named)])
        if "output" in options:
            found.append([*words, "-o", f"{name}.json"])
        if "as_json" in options:
            found.append([*words, "--json"])
        if "format" in options:
            found += [[*words, "--format", one] for one in options["format"].type.choices if one != "parquet"]
        if "table" in options:
            found += [[*words, "--table", table] for table in ("scaling_fits", "break_even", "tolerance", "checks")]
    return found + resumed


def read(folder: Path, at: Path, mark: str) -> list[tuple[int, str, str]]:
    """What all of them say, in a copy of the folder, and what a file that is imported would do."""
    shutil.copytree(folder, at)
    environment = {**os.environ, "PYTHONPATH": str(at), "MARK": mark, "MARKED": str(at / "marked")}
    done = subprocess.run(
        [sys.executable, ROOT / "tests" / "data" / "reading.py"],
        input=json.dumps(reading(folder)),
        cwd=at,
        env=environment,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert not (at / "marked").exists(), (at / "marked").read_text()
    assert done.returncode == 0, done.stderr
    assert done.stdout, "its process was ended"
    return [tuple(each) for each in json.loads(done.stdout)]


def test_no_verb_runs_code_that_a_store_or_a_baseline_names(sent: Path, tmp_path: Path) -> None:
    found = {mark: read(sent, tmp_path / mark, mark) for mark in ("nothing", "exit")}
    words = reading(sent)
    assert {"list", "status", "report", "export", "compare", "baseline", "run"} <= {one[0] for one in words}
    for given, plain, marked in zip(words, found["nothing"], found["exit"], strict=True):
        if "--resume" not in given:  # these measure anew
            assert plain[0] in (0, 1), plain
            assert marked == plain, given
    report = dict(zip(map(tuple, words), found["exit"], strict=True))["report",]
    assert "minemod:Mine: n_u = 2" in report[1], "defaults are left out as they were when it ran"


def test_a_gate_fails_whatever_its_data_name(sent: Path, forks: Forks) -> None:
    """A module that ends the process does not make it pass."""
    with sqlite3.connect(sent / "results" / "routes.sqlite") as db:
        db.execute("VACUUM INTO ?", (str(sent / "worse.sqlite"),))
    with sqlite3.connect(sent / "worse.sqlite") as db:
        db.execute("UPDATE cases SET status = 'failed' WHERE problem LIKE '%:%'")
    for mark in ("nothing", "exit"):
        done = forks.run(sent, "compare", "baseline.json", "worse.sqlite", PYTHONPATH=str(sent), MARK=mark)
        assert done.code == 1, done.out
        assert "a regression" in done.out


def test_changes_of_code_are_seen_without_running_it(sent: Path, tmp_path: Path, forks: Forks) -> None:
    folder = tmp_path / "changed"
    shutil.copytree(sent, folder)

    def seen() -> set[str]:
        done = forks.run(folder, "status", "--json", PYTHONPATH=str(folder), MARK="exit")
        rows = [json.loads(line) for line in done.out.splitlines()]
        return {row["state"] for row in rows if row["problem"] == "mine.py:Mine"}

    assert seen() == {"current"}
    (folder / "mine.py").write_text(CODE + "\nMORE = 1\n")
    assert seen() == {"stale"}
    (folder / "mine.py").unlink()
    assert seen() == {"gone"}


def test_a_store_of_an_older_version_shows_what_it_can(sent: Path, tmp_path: Path, forks: Forks) -> None:
    old = tmp_path / "old.sqlite"
    shutil.copy(sent / "results" / "routes.sqlite", old)
    with sqlite3.connect(old) as db:
        for table, *_ in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'").fetchall():
            for name in [c[1] for c in db.execute(f"PRAGMA table_info('{table}')")]:
                if name.endswith("_declared"):
                    db.execute(f"ALTER TABLE '{table}' DROP COLUMN {name}")
    for verb, shown in (
        (f"status --store {old}", "mine.py:Mine[n=2], not timed"),
        (f"report --store {old}", "mine.py:Mine[n=2]: n_u = 2"),
        (f"report --store {old} --format md", "mine.py:Mine[n=2]"),
        (f"compare {old} {old}", "mine.py:Mine[n=2]"),
    ):
        done = forks.run(sent, *verb.split(), PYTHONPATH=str(sent), MARK="exit", COLUMNS="200")
        assert done.code == 0, done.err
        assert shown in done.out.replace("\\", ""), done.out
        assert done.out.count("kept by an older version") == 1 + verb.startswith("compare"), done.out
    lines = forks.run(sent, *f"status --json --store {old}".split(), PYTHONPATH=str(sent), MARK="exit").out.splitlines()
    assert {row["state"] for row in map(json.loads, lines)} == {"unchecked"}
    Store(old).append_study("check", {}, "now")  # and it is migrated
    assert "problem_declared" in Store(old).table("cases")[0]
