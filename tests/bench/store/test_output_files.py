"""Files that options name: written whole or not at all, and never in place of anything but an earlier one."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from commands import shell
from forks import NOBODY, Forks

from gradient_routes.bench.store import replacing
from gradient_routes.bench.store.output_files import Output, read_by
from gradient_routes.bench.store.store import SQLITE, Store
from gradient_routes.problems.errors import InputError, RoutesError

PROBLEM = """
import numpy as np
from gradient_routes import Offers, Parameters, Problem
from adjacent import POWER

class Power(Problem):
    name = "power"
    offers = Offers.VALUE

    def __init__(self):
        self.parameters = Parameters(start=np.ones(2), scale=np.ones(2))

    def value(self, p):
        return float((p**POWER).sum())

    def objective(self, p):
        return float((p**POWER).sum())

    def gradient(self, p):
        return POWER * p ** (POWER - 1)

    start = np.ones(2)
"""
RUN = "run --problem prob.py:Power --route fd-central --no-timing --store s.sqlite"
CHECK = "check prob.py:Power --no-plot --store s.sqlite"
FIELD = "run --problem advection[n=2] --route tangent --no-timing --no-isolate --store s.sqlite"
OPTIONS = {
    "--gradient": f"{RUN} --gradient",
    "--vtu": f"{FIELD} --vtu",
    "--sensitivities": f"{FIELD} --sensitivities",
    "identify --vtu": "identify --problem advection[n=2] --store s.sqlite --vtu",
    "check --html": f"{CHECK} --html",
    "vcurve --html": "vcurve --problem bar[n=1] --route adjoint --at p.csv --no-plot --store s.sqlite --html",
    "export -o": "export --store s.sqlite -o",
    "report -o": "report --store s.sqlite -o",
    "compare -o": "compare base.json s.sqlite -o",
    "baseline -o": "baseline --store s.sqlite -o",
}
ENDS = dict(
    zip(OPTIONS, (".csv", ".vtu", ".npz", ".vtu", ".html", ".html", ".csv", ".md", ".md", ".json"), strict=True)
)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, forks: Forks) -> Path:
    folder = tmp_path_factory.mktemp("made")
    (folder / "prob.py").write_text(PROBLEM)
    (folder / "adjacent.py").write_text("POWER = 2\n")
    (folder / "p.csv").write_text("log E\n1.0\n")
    (folder / "notes.doc").write_text("of mine")
    for words in (RUN, "baseline --store s.sqlite -o base.json"):
        done = forks.run(folder, *words.split())
        assert done.code == 0, done.err
    return folder


@pytest.fixture
def folder(made: Path, tmp_path: Path) -> Path:
    """A problem in a file, what it imports, a store, a baseline of it and a file of its own."""
    return shutil.copytree(made, tmp_path, dirs_exist_ok=True)


def contents(folder: Path) -> dict[str, bytes]:
    """Of all files; of stores their rows, for they are written to before anything is measured."""
    files = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    stores = {name for name, content in files.items() if content.startswith(SQLITE)}
    return files | {name: repr(Store(folder / name).rows()).encode() for name in stores}


@pytest.mark.parametrize("option", OPTIONS)
def test_no_option_writes_over_what_is_no_earlier_result(folder: Path, cli, option: str) -> None:
    """Neither by its name, nor by a link, whatever its name ends with."""
    os.link(folder / "s.sqlite", folder / f"hard{ENDS[option]}")
    (folder / f"soft{ENDS[option]}").symlink_to("s.sqlite")
    (folder / f"source{ENDS[option]}").symlink_to("adjacent.py")
    (folder / f"journal{ENDS[option]}").symlink_to("s.sqlite-journal")
    before = contents(folder)
    for name in ("prob.py", "adjacent.py", "notes.doc", "s.sqlite", "s.sqlite-wal", "s.sqlite-claims",
                 *(f"{kind}{ENDS[option]}" for kind in ("hard", "soft", "source", "journal"))):  # fmt: skip
        ran = cli(*OPTIONS[option].split(), name)
        assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1), name
        assert ran.err.startswith("routes: ")
        assert contents(folder) == before, name


@pytest.mark.parametrize(("option", "link"), [("--gradient", "g.csv"), ("check --html", "g.html")])
def test_a_source_is_known_by_its_hard_links(folder: Path, cli, option: str, link: str) -> None:
    for source in ("prob.py", "adjacent.py"):
        os.link(folder / source, folder / link)
        ran = cli(*OPTIONS[option].split(), link)
        assert (ran.code, "is another file of this run" in ran.err) == (2, True)
        (folder / link).unlink()
    assert (folder / "prob.py").read_text() == PROBLEM


@pytest.mark.parametrize("option", OPTIONS)
def test_every_option_replaces_its_own_and_leaves_nothing_else(folder: Path, cli, option: str) -> None:
    name = f"out{ENDS[option]}"
    for _ in range(2):
        ran = cli(*OPTIONS[option].split(), name)
        assert ran.code == 0, ran.err
        os.link(folder / name, folder / "kept") if not (folder / "kept").exists() else None
    assert (folder / name).stat().st_size > 10
    assert (folder / "kept").stat().st_ino != (folder / name).stat().st_ino, "a hard link keeps what was there"
    assert not [path.name for path in folder.iterdir() if path.name.endswith(".part")]


@pytest.mark.parametrize("option", OPTIONS)
def test_what_cannot_be_written_is_one_line_and_the_store_is_whole(folder: Path, forks: Forks, option: str) -> None:
    rows = len(Store(folder / "s.sqlite").rows())
    kept = option in ("--gradient", "--vtu", "--sensitivities")
    (folder / f"full{ENDS[option]}").symlink_to("/dev/full")
    full = forks.run(folder, *OPTIONS[option].split(), f"full{ENDS[option]}")
    assert (full.code, full.err.count("\n")) == (1, 1), full.err
    assert f"full{ENDS[option]}: No space left on device - name a file you may write" in full.err
    assert len(Store(folder / "s.sqlite").rows()) == rows + kept
    (folder / f"pipe{ENDS[option]}").symlink_to(f"/dev/fd/{NOBODY}")
    closed = forks.run(folder, *OPTIONS[option].split(), f"pipe{ENDS[option]}")
    if option in ("identify --vtu", "check --html", "vcurve --html"):  # in a process of its own, which has no such file
        assert closed.code in (1, 2)
    else:
        assert (closed.code, "Broken pipe" in closed.err) == (1, True), closed.err
    assert "Traceback" not in closed.err
    assert closed.err.count("\n") == 1


@pytest.mark.parametrize("verb", ["list", "report", "status", "export", "export --format json", RUN, f"{RUN} --json",
                                  "compare base.json s.sqlite", f"{CHECK}", "report --format md"])  # fmt: skip
def test_stdout_that_is_full_or_closed_is_no_traceback(folder: Path, forks: Forks, verb: str) -> None:
    where = "" if "--store" in verb or verb.startswith(("list", "compare")) else " --store s.sqlite"
    full = forks.run(folder, *f"{verb}{where}".split(), stdout="/dev/full")
    assert (full.code, full.err.count("\n")) == (1, 1), full.err
    assert "No space left on device" in full.err
    closed = forks.run(folder, *f"{verb}{where}".split(), stdout=None)
    assert "Traceback" not in closed.err
    assert closed.err.count("\n") <= 1
    assert len(Store(folder / "s.sqlite").rows()) >= 1


def test_a_closed_stdout_costs_no_file(folder: Path, forks: Forks) -> None:
    forks.run(folder, *f"{RUN} --json --gradient g.csv".split(), stdout=None)
    assert (folder / "g.csv").read_text().startswith("problem,route")


def test_stdout_and_pipes_are_written_as_they_are(folder: Path, forks: Forks) -> None:
    """Of the shell, one of each."""
    table = forks.run(folder, *"export --store s.sqlite".split()).out
    assert table.startswith("case_id,")
    for command in ("-o /dev/stdout", "-o /dev/stdout | cat"):
        done = shell(f"routes export --store s.sqlite {command}", folder)
        assert done.stdout == table, command
    assert forks.run(folder, *"export --store s.sqlite -o /dev/stdout".split()).out == table, "a file"
    os.mkfifo(folder / "p")
    with subprocess.Popen(["cat", "p"], cwd=folder, stdout=subprocess.PIPE, text=True) as reader:
        assert forks.run(folder, *"export --store s.sqlite -o p".split()).code == 0
        assert reader.communicate()[0] == table
    assert forks.run(folder, *"export --store s.sqlite -o /dev/null".split()).code == 0
    done = forks.run(folder, *f"{RUN} --gradient /dev/stdout".split())
    assert done.code == 0
    assert done.out.count("problem,route") == 1
    assert "gradients of 1 of 1 cases in /dev/stdout" in done.out


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
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


def test_a_full_disk_leaves_the_earlier_file(small: Path) -> None:
    output = Output("-o", small / "x.csv", (".csv",))
    (small / "x.csv").write_text("earlier")
    with pytest.raises(RoutesError, match=r"x.csv: No space left on device"), output.open() as file:
        file.write(bytes(2**21))
    assert [(path.name, path.read_text()) for path in small.iterdir()] == [("x.csv", "earlier")]


def interrupted(output: Output) -> None:
    with output.text() as file:
        file.write("second")
        raise KeyboardInterrupt


@pytest.mark.parametrize("nameless", [True, False])
def test_a_file_is_replaced_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, nameless: bool
) -> None:
    if not nameless:
        monkeypatch.setattr(replacing, "NAMELESS", None)
    path = tmp_path / "x.csv"
    output = Output("-o", path, (".csv",))
    output.check([])
    assert not list(tmp_path.iterdir())
    with output.text() as file:
        file.write("first")
    path.chmod(0o640)
    with pytest.raises(KeyboardInterrupt):
        interrupted(output)
    assert path.read_text() == "first"
    with output.text() as file:
        file.write("third")
        assert path.read_text() == "first"
    assert (path.read_text(), stat.S_IMODE(path.stat().st_mode)) == ("third", 0o640)
    assert [path.name for path in tmp_path.iterdir()] == ["x.csv"]


def test_a_link_to_a_result_stays_one(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link.csv").symlink_to("there/x.csv")
    output = Output("-o", tmp_path / "link.csv", (".csv",))
    for text in ("one", "two"):
        output.check([])
        with output.text() as file:
            file.write(text)
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "there" / "x.csv").read_text() == "two"


def test_links_in_a_circle_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.csv").symlink_to("b.csv")
    (tmp_path / "b.csv").symlink_to("a.csv")
    with pytest.raises(InputError, match=r"^-o .*a.csv: [^\n]* - name a file you may write$"):
        Output("-o", tmp_path / "a.csv", (".csv",)).check([])


def test_an_empty_file_has_nothing_to_lose(tmp_path: Path) -> None:
    (tmp_path / "tmp.Xy").touch()
    Output("-o", tmp_path / "tmp.Xy", (".csv",)).check([])


def test_what_a_command_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.py").write_text("import b")
    for name in ("b.py", "c.py", "d.csv", "e,f.csv"):
        (tmp_path / name).touch()
    found = read_by("a.py:Model[data=d.csv,n=2]", "bar", None, tmp_path / "e,f.csv", "no/file")
    assert {path.name for path in found} == {"a.py", "b.py", "d.csv", "e,f.csv"}


def test_help_says_the_rule(cli) -> None:
    assert "An earlier one of the same kind is replaced" in " ".join(cli("--help").out.split())
    for verb, times in (("run", 3), ("identify", 1), ("check", 1), ("vcurve", 1), ("export", 1), ("report", 2),
                        ("compare", 1), ("baseline", 1)):  # fmt: skip
        assert " ".join(cli(verb, "--help").out.split()).count("no other file.") == times, verb
