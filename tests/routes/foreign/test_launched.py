"""An adapter that another program starts, as mpiexec does: it may write to stdout, and reads no messages."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from gradient_routes.routes.foreign.manifest import ADAPTERS, AROUND, START, manifest
from gradient_routes.routes.foreign.peer import Peer

ECHO = """# /// script
# [tool.gradient-routes]
# summary = "what it is given"
# cases = { bar = {} }
# options = { ranks = ["1", "2"] }
# launch = ["mpiexec", "-n", "{ranks}"]
# ///
from ranks import serve_on_ranks

class Alone:
    rank = 0
    def bcast(self, what):
        return what

class Echo:
    def gradient(self, p):
        return {"J": 0.0, "gradient": p}

serve_on_ranks(Echo(), Alone(), "echo")
"""
STARTS = '#!/bin/sh\necho starting\nshift 2\n"$@" </dev/null\necho ended\n'


@pytest.fixture
def echo(tmp_path: Path) -> Path:
    script = tmp_path / "echo.py"
    script.write_text(ECHO)
    return script


def test_its_messages_pass_the_program_that_starts_it(echo: Path, tmp_path: Path) -> None:
    starts = tmp_path / "mpiexec"
    starts.write_text(STARTS)
    starts.chmod(0o755)
    program = [sys.executable, "-c", START, str(ADAPTERS / "python"), str(echo)]
    peer = Peer(["sh", "-c", AROUND, "sh", str(starts), "-n", "2", *program], "echo")
    p = np.arange(200_000.0)  # more than a pipe holds
    assert (peer.ask("gradient", p=p)["gradient"] == p).all()
    peer.close()


def test_it_is_launched_where_its_options_are_not_the_defaults(echo: Path) -> None:
    found = manifest(echo)
    alone, two = found.command({"ranks": "1"}), found.command({"ranks": "2"})
    assert alone[0] == str(found.python)
    assert two == ("sh", "-c", AROUND, "sh", str(found.python.with_name("mpiexec")), "-n", "2", *alone)
