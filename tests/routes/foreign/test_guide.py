"""The adapter that the guide has its reader write is right, runs and is described by its metadata."""

from __future__ import annotations

import json
import re
import shlex
import sys
from pathlib import Path

import pytest
from commands import ROOT

from gradient_routes.routes.foreign.manifest import ADAPTERS, START, manifest

GUIDE = ROOT / "docs" / "how-to" / "other-frameworks.md"


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    (block,) = re.findall(r"^```py\n(.*?)^```$", GUIDE.read_text(), re.MULTILINE | re.DOTALL)
    (tmp_path / "mine.py").write_text(block)
    return tmp_path / "mine.py"


def test_its_metadata_can_be_read(mine: Path) -> None:
    found = manifest(mine)
    assert (found.name, found.dependencies, dict(found.cases)) == ("mine", ("numpy",), {"bar": {}})


@pytest.mark.parametrize("of", ["log", "raw"])
def test_its_gradient_is_ours_and_that_of_its_J(of: str, mine: Path, cli) -> None:
    command = shlex.join([sys.executable, "-c", START, str(ADAPTERS / "python"), str(mine)])
    problem = f"--problem=bar[parametrization={of}]"
    found = json.loads(cli("check", problem, f"--adapter={command}", "--no-store", "--json").out)
    assert found["verdict"] == "agrees"
    assert not [remark for remark in found["remarks"] if "functional" in remark]


def test_it_is_as_short_as_the_guide_says(mine: Path) -> None:
    assert len(mine.read_text().splitlines()) <= 45


def test_a_row_is_stale_once_the_adapter_has_changed(mine: Path, cli) -> None:
    command = f"{sys.executable} {mine}"  # it cannot be started so, which is a row as well
    run = ["run", "--problem=bar", f"--route=adapter[command={command}]", "--json", "--no-timing"]
    assert cli(*run).rows[0]["status"] == "crashed"
    assert "1 crashed" in cli("status").out
    mine.write_text(mine.read_text() + "# changed\n")
    assert "1 crashed (stale)" in cli("status").out
