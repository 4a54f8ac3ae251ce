"""Sweeps struck at random points: nothing is lost, repeated, half written or left. The full size is `make faults`."""

from __future__ import annotations

import random
import sqlite3
from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks import faults
from benchmarks.faults import Found, Sweep, sound, whole
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.store.store import Store

TABLE = "problem,route,parameter\nbar[n=2],adjoint,a\nbar[n=2],adjoint,b\nbar[n=1],adjoint,a\n"


def test_nothing_is_lost_repeated_half_written_or_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every kind one; one strikes a runner with processes for its cases, one a runner of three."""
    monkeypatch.setattr(faults, "CASES", 12)
    found = sum(faults.faults(5, random.Random(14)).values(), Found())
    assert found.faults >= 5
    assert found.well, found


def test_a_fault_that_is_found_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(faults, "faults", lambda *given: dict.fromkeys(faults.KINDS, Found(faults=1)))
    assert CliRunner().invoke(faults.main).exit_code == 0
    monkeypatch.setattr(faults, "faults", lambda *given: {"SIGINT": Found(faults=1, half_written=1)})
    ran = CliRunner().invoke(faults.main)
    assert ran.exit_code == 1
    assert ran.output.splitlines()[-1].split() == ["all", "1", "0", "0", "1", "0"]
    assert not any(Found(**{name: 1}).well for name in ("lost", "repeated", "half_written", "left"))


def test_what_is_not_whole_is_counted(tmp_path: Path) -> None:
    """Hence the zeros mean something."""
    at = Sweep(tmp_path, tmp_path / "apart", 4, mounted=False)
    at.store.append(empty_row(), None)
    (tmp_path / "g.csv").write_text(TABLE)
    assert faults.unfinished(at) == 0
    (tmp_path / ".routes-0.part").touch()
    (tmp_path / "g.csv").write_text(TABLE[:-5])
    assert faults.unfinished(at) == 2
    for cut in range(1, len(TABLE)):
        (tmp_path / "g.csv").write_text(TABLE[:cut])
        first = TABLE[:cut] in (TABLE[:24], TABLE[:62])
        assert whole(tmp_path / "g.csv") == first, TABLE[:cut]


def test_a_damaged_store_is_not_sound(tmp_path: Path) -> None:
    store = Store(tmp_path / "s.sqlite")
    store.append_all([(empty_row(), None, None)] * 500)
    assert sound(store.path)
    with store.path.open("r+b") as file:
        file.seek(-20_000, 2)
        file.write(b"\xff" * 8192)
    assert not sound(store.path)


def test_what_was_kept_apart_counts(tmp_path: Path) -> None:
    at = Sweep(tmp_path / "folder", tmp_path / "apart", 4, mounted=False)
    at.store.append(empty_row(), None)
    at.apart.mkdir()
    Store(at.apart / "s-unsaved-1.sqlite").append(empty_row() | {"problem": "bar"}, None)
    with sqlite3.connect(at.folder / "s-unsaved-2.sqlite"):
        pass  # of a runner that was killed while it wrote it
    assert [row["problem"] for row in at.rows()] == [None, "bar"]
