"""The adapter in C: compiled as its head says, and as right as our adjoint."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from gradient_routes.routes.foreign.manifest import ADAPTERS

BARS = "bar bar[n=1] bar[parametrization=raw,n=3,sensors=2..3] bar[n=50,sensors=50] bar[n=10000]".split()  # frames


@pytest.fixture(scope="session")
def executable(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("cc") is None:
        pytest.skip("no C compiler here: install one that is called cc")
    program = tmp_path_factory.mktemp("compiled") / "bar"
    subprocess.run(["cc", "-O2", "-Wall", "-Werror", "-o", program, ADAPTERS / "executable.c", "-lm"], check=True)
    return program


def test_its_gradient_is_that_of_the_closed_form(executable: Path, cli) -> None:
    problems = [f"--problem={problem}" for problem in [*BARS, "block[n=1]"]]
    ran = cli("run", *problems, f"--route=adapter[command={executable}]", "--no-timing", "--no-store", "--json")
    *bars, block = ran.rows
    for row in bars:
        assert row["status"] == "ok", row["reason"]
        assert row["gradient_error"] < 1e-12
        assert row["peer"]["name"] == "executable"
        assert min(row["peer"]["forward_s"], row["peer"]["backward_s"]) >= 0.0
    assert len(bars) == len(BARS)
    assert (block["status"], block["reason"].partition(": ")[2]) == (
        "skipped",
        "load(): it knows the kind bar, with sensors and data",
    )


def test_it_is_short() -> None:
    assert len((ADAPTERS / "executable.c").read_text().partition("*/")[2].splitlines()) <= 150
