"""A user file that changes the working folder moves nothing that the command line names."""

from __future__ import annotations

from pathlib import Path

import pytest

from gradient_routes.bench.store.store import Store

MOVES = """
import os
from pathlib import Path

from gradient_routes.problems.bar import Bar
from gradient_routes.routes.adjoint import adjoint

Path("elsewhere").mkdir(exist_ok=True)
os.chdir("elsewhere")


def stays() -> None:
    assert Path.cwd().name == "elsewhere", "where the file went is where it stays"


class Moved(Bar):
    def __init__(self, *, n: int = 8) -> None:
        stays()
        super().__init__(n=n)


def solid(*, probes: str = ""):
    from gradient_routes.problems.block import Block

    stays()
    return Block(n=2, derivatives="hand")


def J(p):
    return float(p @ p)


def dJ(p):
    return 2 * p
"""
PROBLEM = ("--problem", "moves.py:Moved")
SOLID = ("--problem", "moves.py:solid")  # has a mesh
CALLS = {
    "run": (*SOLID, "--route", "adjoint", "--no-timing", "--at", "p.csv", "--gradient", "g.csv", "--vtu", "f.vtu"),
    "check": ("--objective", "moves.py:J", "--gradient", "moves.py:dJ", "--at", "p.csv", "--html", "page.html"),
    "vcurve": (*PROBLEM, "--route", "adjoint", "--html", "page.html", "--per-decade", "2", "--steps", "1e-9", "1e-3"),
    "tolerance": (*PROBLEM, "--route", "adjoint", "--at", "p.csv", "--tightest", "1e-3", "--per-decade", "1"),
    "scaling": ("--problem", "moves.py:Moved[n=1|2]", "--route", "adjoint", "--min-time", "0"),
    "identify": (*SOLID, "--noise", "0.1", "--vtu", "f.vtu"),
}
WRITTEN = {"run": ["f.vtu", "g.csv"], "check": ["page.html"], "vcurve": ["page.html"], "identify": ["f.vtu"]}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "moves.py").write_text(MOVES)
    (tmp_path / "p.csv").write_text("p\n" + "\n".join(["0.1"] * 8) + "\n")
    return tmp_path


APART = ("run", "check", "scaling")  # cases, a study and a matrix of cases; the other verbs are studies


@pytest.mark.parametrize(
    ("verb", "how"), [*((verb, "--no-isolate") for verb in CALLS), *((verb, "--isolate") for verb in APART)]
)
def test_results_are_where_the_command_was_started(cli, folder: Path, verb: str, how: str) -> None:
    before = {path.name for path in folder.iterdir()}
    ran = cli(verb, *CALLS[verb], "--store", "kept.sqlite", how)
    assert ran.code == 0, ran.err
    written = {path.name for path in folder.iterdir() if path.is_file()} - before
    assert sorted(written) == sorted([*WRITTEN.get(verb, []), "kept.sqlite"])
    assert [*(folder / "elsewhere").iterdir()] == []
    assert "kept in kept.sqlite" in ran.out
    assert Store(folder / "kept.sqlite").table("cases" if verb in ("run", "scaling") else "studies")[1]


def test_a_second_file_is_found_where_the_command_was_started(cli, folder: Path) -> None:
    route = "from gradient_routes.routes.adjoint import adjoint\n"
    (folder / "way.py").write_text(route)
    ran = cli("run", *PROBLEM, "--route", "way.py:adjoint", "--no-timing", "--no-store", "--no-isolate")
    assert ran.code == 0, ran.err
