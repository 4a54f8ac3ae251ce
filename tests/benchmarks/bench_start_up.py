"""pytest-benchmark: how long people wait for the command line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytest_plugins = ("measuring",)


@pytest.mark.benchmark(group="start-up", min_rounds=5)
@pytest.mark.parametrize("arguments", [["--help"], ["list"]], ids=" ".join)
def test_start_up(benchmark, arguments: list[str]) -> None:
    command = [str(Path(sys.executable).with_name("routes")), *arguments]
    done = benchmark(subprocess.run, command, capture_output=True, check=True)
    assert b"bar" in done.stdout
