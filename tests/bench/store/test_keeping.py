"""A store that cannot be written: noticed before the first case, or its rows are kept apart and merged later."""

from __future__ import annotations

import sqlite3
import subprocess
import warnings
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

import pytest
from commands import shell

from gradient_routes import run
from gradient_routes.bench.cases.row import empty_row
from gradient_routes.bench.cases.samples import Samples
from gradient_routes.bench.store.keeping import Keeper
from gradient_routes.bench.store.merge import merge
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

# every verb that stores
VERBS = {
    "run": "run --problem model.py:Model --route fd-central",
    "scaling": "scaling --problem bar --route adjoint",
    "check": "check --problem model.py:Model --route fd-central",
    "vcurve": "vcurve --problem bar --route adjoint",
    "kink": "kink --problem bar",
    "tolerance": "tolerance --problem bar --route adjoint",
    "unrolling": "unrolling --problem bar",
    "invert": "invert --problem bar",
    "consistency": "consistency",
    "identify": "identify --problem bar",
}
MODEL = """
from pathlib import Path
import numpy as np
from gradient_routes import Offers, Parameters, Problem

class Model(Problem):
    name = "model"
    offers = Offers.VALUE

    def __init__(self):
        self.parameters = Parameters(start=np.ones(2), scale=np.ones(2))

    def value(self, p):
        Path("ran").touch()
        return float((p**2).sum())
"""


def row(**values):
    return empty_row() | {"problem": "bar", "route": "adjoint", "status": "ok", "problem_options": {}} | values


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 1 MiB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "none", disk], capture_output=True, check=False)
    if mounted.returncode:
        pytest.skip("needs to mount a tmpfs")
    try:
        yield disk
    finally:
        subprocess.run(["umount", disk], check=True)


def fill(disk: Path) -> None:
    with (disk / "full").open("wb", buffering=0) as file, suppress(OSError):
        while True:
            file.write(bytes(4096))


def other_program(path: Path) -> None:
    with closing(sqlite3.connect(path)) as db:
        db.execute("CREATE TABLE songs (title TEXT)")
        db.commit()


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_refuses_a_store_that_cannot_be_written(cli, tmp_path: Path, verb: str) -> None:
    (tmp_path / "model.py").write_text(MODEL)
    (tmp_path / "folder").mkdir()
    other_program(tmp_path / "songs.sqlite")
    for name in ("folder", "/dev/full", "/dev/null", "songs.sqlite", "model.py", "/proc/s.sqlite", "model.py/s.sqlite"):
        ran = cli(*VERBS[verb].split(), "--store", name)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1), name
        assert ran.err.startswith(f"routes: store {name}: ")
    assert not (tmp_path / "ran").exists()


def test_a_full_disk_is_noticed_before_the_first_case(disk: Path, cli) -> None:
    """Where there is no store yet, and where there is one, which takes no further row."""
    (disk.parent / "model.py").write_text(MODEL)
    Store(disk / "there.sqlite").append(row(), None)
    fill(disk)
    for name in ("new.sqlite", "there.sqlite"):
        ran = cli(*VERBS["run"].split(), "--store", f"disk/{name}")
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
        assert "No space left on device" in ran.err
    assert not (disk.parent / "ran").exists()
    assert len(Store(disk / "there.sqlite").rows()) == 1


def test_a_folder_that_takes_no_journal_is_noticed(disk: Path) -> None:
    store = Store(disk / "s.sqlite")
    store.append(row(), None)
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    with pytest.raises(InputError, match="Read-only file system"):
        store.check_writable()


def test_what_a_folder_that_became_read_only_does_not_take_is_kept_elsewhere(
    disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(disk.parent)
    keeper = Keeper(Store(disk / "s.sqlite"))
    keeper.append(row(note="a"), None, None)
    subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
    keeper.append(row(note="b"), None, None)
    assert "1 row not kept: store" in keeper.close()
    (apart,) = disk.parent.glob("*unsaved*")
    assert [kept["note"] for kept in Store(apart).rows()] == ["b"]


def test_rows_wait_for_a_disk_that_has_room_again(disk: Path) -> None:
    store = Store(disk / "s.sqlite")
    keeper = Keeper(store)
    keeper.append(row(note="a"), None, None)
    fill(disk)
    wide = "x" * 50_000
    for note in "bcd":
        keeper.append(row(note=note, reason=wide), None, None)
    assert [kept["note"] for kept in store.rows()] == ["a"]
    (disk / "full").unlink()
    keeper.append(row(note="e"), None, None)
    assert [kept["note"] for kept in store.rows()] == [*"abcde"]
    assert keeper.close() == ""


def test_what_a_full_disk_does_not_take_is_merged_later(disk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(disk.parent)
    store = Store(disk / "s.sqlite")
    keeper = Keeper(store)
    keeper.append(row(note="a"), Samples((0.1,), (0.2,)), None)
    fill(disk)
    for note in "bc":
        keeper.append(row(note=note, reason="x" * 50_000), Samples((0.3,), (0.4,)), None)
    said = keeper.close()
    assert said.startswith(f"2 rows not kept: store {store.path}: ")
    command = said.partition("later: ")[2]
    (disk / "full").unlink()
    for added in (2, 0):
        done = shell(command, disk.parent)
        assert (done.returncode, done.stdout.split()[0]) == (0, str(added)), done.stderr
    assert [kept["note"] for kept in store.rows()] == [*"abc"]
    assert [sample[0] for sample in store.table("samples")[1]] == [1, 1, 2, 2, 3, 3]
    assert list(disk.iterdir()) == [store.path]


def test_studies_are_merged_with_all_their_rows(tmp_path: Path, cli) -> None:
    for name, problem in (("a", "bar[n=2]"), ("b", "bar[n=3]")):
        assert cli("identify", "--problem", problem, "--store", f"{name}.sqlite").code == 0
    a, b = Store(tmp_path / "a.sqlite"), Store(tmp_path / "b.sqlite")
    spectra = [store.records("spectrum") for store in (a, b)]
    assert merge(a, b) == (0, 1)
    assert merge(a, b) == (0, 0)
    assert [found["study_id"] for found in a.records("spectrum")] == [1] * 2 + [2] * 3
    assert [found | {"study_id": 1} for found in a.records("spectrum")] == spectra[0] + spectra[1]
    assert merge(Store(tmp_path / "new.sqlite"), a) == (0, 2)


@pytest.mark.parametrize(
    ("other", "says"), [("s.sqlite", "is the store itself"), ("no", "no such file"), ("songs", "another program")]
)
def test_what_cannot_be_merged_is_one_line(cli, tmp_path: Path, other: str, says: str) -> None:
    Store(tmp_path / "s.sqlite").append(row(), None)
    other_program(tmp_path / "songs")
    ran = cli("merge", other, "--store", "s.sqlite")
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert says in ran.err


def locked(self: Store, *given: object) -> None:
    if "unsaved" not in self.path.name:
        raise InputError(f"store {self.path}: database is locked - try again later")
    APPEND[type(given[0])](self, *given)


APPEND = {list: Store.append_all, str: Store.append_study}


@pytest.mark.parametrize("verb", ["run", "scaling", "invert"])
def test_a_store_that_locks_up_midway_loses_no_row(
    cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    (tmp_path / "model.py").write_text(MODEL)
    monkeypatch.setattr(Store, "append_all", locked)
    monkeypatch.setattr(Store, "append_study", locked)
    options = {"run": "--no-timing", "scaling": "--levels 1 --no-plot", "invert": "--no-plot"}
    ran = cli(*VERBS[verb].split(), *options[verb].split())
    assert (ran.code, "not kept: store results/routes.sqlite: database is locked" in ran.err) == (1, True)
    assert "Traceback" not in ran.err
    kept = [Store(path) for path in tmp_path.rglob("*unsaved*.sqlite")]
    tables = {"run": "cases", "scaling": "cases", "invert": "inversion"}
    assert sum(len(store.table(tables[verb])[1]) for store in kept) >= 1


def test_a_function_warns_where_its_rows_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Store, "append_all", locked)
    with pytest.warns(UserWarning, match=r"1 row not kept: .*kept in .*s-unsaved-\w{8}-\d+\.sqlite") as said:
        frame = run("bar", "adjoint", timing=False, store=tmp_path / "s.sqlite")
    assert said[0].filename == __file__
    assert len(frame) == 1
    with warnings.catch_warnings():
        monkeypatch.undo()
        (apart,) = tmp_path.glob("*unsaved*")
        assert len(Store(apart).rows()) == 1
