"""What the documents say is what the code does: every block of README and CONTRIBUTING is executed."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest
from commands import ROOT, Ran, shell

BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")
NUMBER = re.compile(r"(?<![\w.=\[-])<?[-+]?\d[\d.]*(e[-+]?\d+)?( (B|KiB|MiB|GiB|us|ms|s|min|h|d|y)\b)?")


def blocks(document: str, language: str) -> list[str]:
    found = [body for kind, body in BLOCK.findall((ROOT / document).read_text()) if kind == language]
    assert found, f"{document} has no {language} block: nothing would be tested"
    return found


def shape(text: str) -> list[list[str]]:
    """A printed text without what changes from run to run: numbers, marks of unstable ones, the width of columns."""
    text = text.replace("~", "").replace(", : unstable", "")
    return [NUMBER.sub("#", line).split() for line in text.splitlines() if line.strip()]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    return tmp_path


def typed(cli, folder: Path, command: str) -> Ran:
    """A command in this process, which has JAX imported and shares what is compiled; in a shell's where that has a
    word in it, and where other processes run the cases.
    """
    if set("[]{}()|&;<>*?$`~!") & set(QUOTED.sub("", command)) or "--executor" in command:
        done = shell(command, folder)
        return Ran(done.returncode, done.stdout, done.stderr)
    program, *arguments = shlex.split(command)
    assert program == "routes"
    return cli(*arguments)


@pytest.mark.parametrize("block", blocks("README.md", "console"), ids=lambda block: block.splitlines()[0][2:40])
def test_the_tour_prints_what_the_readme_shows(block: str, folder: Path, cli) -> None:
    command, _, shown = block.removeprefix("$ ").partition("\n")
    ran = typed(cli, folder, command)
    assert (ran.code, ran.err) == (0, "")
    out = ran.out
    assert shape(out) == shape(shown)
    if command.startswith("routes check"):
        (calls,) = re.findall(r"(\d+) objective calls", out)
        assert int(calls) <= 200
        (code,) = re.findall(r"exit code (\d)", out)
        assert f"exit code {code}" in shown  # a number, which the shape leaves out


def test_the_other_commands_of_the_readme_run(folder: Path, cli) -> None:
    for block in blocks("README.md", "sh"):
        for command in block.replace("\\\n", " ").splitlines():
            ran = typed(cli, folder, command.partition("  #")[0].strip())
            assert (ran.code, ran.err) == (0, ""), command
            for row in ran.rows if "--json" in command else ():
                assert row.get("calls", 0) <= 200
    assert (folder / "results/cases.csv").stat().st_size > 0 < (folder / "results/samples.parquet").stat().st_size


@pytest.mark.parametrize("document", ["README.md", "CONTRIBUTING.md"])
def test_python_blocks_run_one_after_the_other(document: str) -> None:
    space: dict = {}
    for block in blocks(document, "python"):
        exec(compile(block, document, "exec"), space)


def test_the_two_commands_exist_and_do_what_the_readme_says(folder: Path) -> None:
    (first,) = [b for b in blocks("README.md", "") if "make demo" in b]
    for line in first.splitlines():
        target = line.split()[1]
        dry = shell(f"make --dry-run --always-make {target}", ROOT)
        assert dry.returncode == 0, dry.stderr
        for step in (
            "-m venv .venv",
            "pip install",
            "routes run --problem bar --route all" if target == "demo" else "pytest",
        ):
            assert step in dry.stdout


def test_make_lists_its_targets() -> None:
    listed = shell("make", ROOT).stdout
    gates = "gate baseline benchmark-regression benchmark-baseline"
    for target in f"help demo test lint type {gates} benchmark mutants reports reference clean".split():
        assert re.search(rf"^{target} ", listed, re.MULTILINE), target


def test_no_document_points_nowhere() -> None:
    for document in ("README.md", "CONTRIBUTING.md"):
        text = (ROOT / document).read_text()
        paths = re.findall(r"\]\(([^)#:]+)\)", text) + re.findall(
            r"`((?:bench|routes|problems|tests|examples)/[\w./]+)`", text
        )
        assert paths
        assert not [path for path in paths if not (ROOT / path).exists()]
