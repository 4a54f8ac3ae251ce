"""No view prints a line that a terminal of 80 columns would break."""

from __future__ import annotations

import re

import pytest
from rich.cells import cell_len

STYLES = re.compile(r"\x1b\[[0-9;]*m")
SMALL = "bar[n=4,sensors=2,alpha=1e-3,noise=0.01]"
COMMANDS = [
    "run --problem bar --route adjoint --route fd-central --min-time 0",
    "check --problem bar --route faulty-adjoint",
    "check --problem bar",
    "vcurve --problem bar --route adjoint --components 1 --directions 1",
    "tolerance --problem bar --route adjoint --route tangent --tightest 1e-3",
    "unrolling --problem bar[n=2] --max-iterations 2",
    "kink --problem bar[stop=multiplier] --route adjoint --route tangent",
    "kink --problem bar[stop=softplus] --route adjoint",
    f"identify --problem {SMALL} --vary sensors=4 --place 2 --criterion A",
    "scaling --problem bar[n=2|4|8] --route adjoint --route tangent --min-time 0",
    "invert --problem bar --route adjoint",
    "list",
    "--help",
]
OF_THE_STORE = ("status", "report", "compare results/routes.sqlite results/routes.sqlite")


@pytest.fixture
def widest(cli, monkeypatch: pytest.MonkeyPatch):
    """The lines of a command that are wider than its terminal."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, to Rich

    def lines(command: str) -> list[str]:
        ran = cli(*command.split())
        assert ran.code in (0, 1), ran.err
        assert len(ran.out.splitlines()) > 3
        return [line for line in STYLES.sub("", ran.out).splitlines() if cell_len(line.rstrip()) > 80]

    return lines


@pytest.mark.parametrize("command", COMMANDS)
def test_no_line_of_a_view_is_wider_than_the_terminal(command: str, widest) -> None:
    assert widest(command) == []


def test_nor_is_one_of_what_is_stored(widest) -> None:
    assert widest(f"run --problem {SMALL} --route all --min-time 0") == []
    for command in OF_THE_STORE:
        assert widest(command) == [], command
