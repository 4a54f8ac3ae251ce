"""Another code as the subject of a check: its own J against its own dJ/dp, its tolerance tightened."""

from __future__ import annotations

import json
import shlex
import sys
from pathlib import Path

import pytest

from gradient_routes.routes.foreign.manifest import ADAPTERS, START

SCRIPT = Path(__file__).parent / "bar_adapter.py"
MISTAKES = {
    "none": ("agrees", 0),
    "sign": ("wrong-gradient", 1),
    "loose": ("solver-limited", 3),
    "another-J": ("agrees", 0),
}


def command(mistake: str) -> str:
    """With the packages of this environment."""
    return shlex.join([sys.executable, "-c", START, str(ADAPTERS / "python"), str(SCRIPT), mistake])


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_check_judges_the_adapter(mistake: str, cli) -> None:
    ran = cli("check", "--problem=bar", f"--adapter={command(mistake)}", "--rtol=1e-4", "--no-store", "--json")
    found = json.loads(ran.out)
    assert (found["verdict"], ran.code) == MISTAKES[mistake]
    if mistake == "sign":
        assert "log E_1" in found["culprit"]
    notes = " ".join(found["remarks"])
    assert ("another functional" in notes) == (mistake == "another-J")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--adapter=./it"], "check: --adapter goes with --problem, without --route - give both, or leave it out"),
        (["--problem=bar", "--route=adjoint", "--adapter=./it"], "check: --adapter goes with --problem, without"),
        (["--problem=advection", "--adapter=./it"], "check: advection: is not described to other codes"),
        (["--problem=bar", "--adapter=/nowhere/it"], "/nowhere/it cannot be started: No such file or directory"),
        (["--problem=bar", f"--adapter={SCRIPT}"], "has no environment here - make it: routes environments create"),
        (["--problem=bar", "--adapter=false"], "ended with exit code 1 in describe() - see its output"),
    ],
)
def test_what_is_no_adapter_says_so(arguments: list[str], says: str, cli, monkeypatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    ran = cli("check", *arguments, "--no-store")
    assert ran.code != 0
    assert says in ran.err
    assert "Traceback" not in ran.err
