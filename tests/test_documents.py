"""The documents say what the code does: every block of README, CONTRIBUTING and docs/ is executed."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest
from commands import ROOT, Ran, shell

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
DOCUMENTS = [str(p.relative_to(ROOT)) for p in PAGES if not {"reference", "_build"} & set(p.parts)]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\w+\.py)\n")  # the first line of a Python block that is a file of the reader's
ECHO = 'echo "exit code $?"'
MAY_FAIL = " || true"
LOOP = re.compile(r"for (\w+) in ([^;]+); do ([^;]+); done")
QUOTED = re.compile(r"'[^']*'|\"[^\"]*\"")
NUMBER = re.compile(r"(?<![\w.=\[-])<?[-+]?\d[\d.]*(e[-+]?\d+)?( (B|KiB|MiB|GiB|us|ms|s|min|h|d|y)\b)?")


def blocks(document: str, language: str) -> list[str]:
    return [body for kind, body in BLOCK.findall((ROOT / document).read_text()) if kind == language]


def having(language: str) -> list[str]:
    return [document for document in DOCUMENTS if blocks(document, language)]


def shape(text: str) -> list[list[str]]:
    """A printed text without what changes from run to run: numbers, marks of unstable ones, costs that are not
    resolved and what is said of them, the width of columns.
    """
    text = text.replace("~", "").replace(", : unstable", "").replace(", priced on a busy machine", "")
    lines = [line for line in text.splitlines() if line.strip() and "cost / forward solve unresolved" not in line]
    return [NUMBER.sub("#", line.replace("unresolved", "1")).split() for line in lines]


def reader(document: str, folder: Path) -> Path:
    """The folder of someone who follows a document: the examples, and the files it has them write."""
    shutil.copytree(ROOT / "examples", folder / "examples", dirs_exist_ok=True)
    for block in blocks(document, "python"):
        if named := FILE.match(block):
            (folder / named[1]).write_text(block)
    return folder


def typed(cli, folder: Path, line: str) -> Ran:
    """A line of commands, one after the other."""
    code, out, err = 0, "", ""
    for command in LOOP.sub(repeated, line).split("; "):
        if command == ECHO:
            code, out = 0, f"{out}exit code {code}\n"
        else:
            ran = alone(cli, folder, command)
            code, out, err = ran.code, out + ran.out, err + ran.err
    return Ran(code, out, err)


def repeated(loop: re.Match[str]) -> str:
    name, words, command = loop.groups()
    return "; ".join(command.replace(f"${name}", word) for word in words.split())


def alone(cli, folder: Path, command: str) -> Ran:
    """A command in this process, which has JAX imported and shares what is compiled: as shown, but timed as briefly
    as may be, in processes of its own where it ends one. In a shell's where that has a word in it, and where Dask runs
    the cases.
    """
    head, _, reader = command.partition(" | ")
    head, _, file = head.removesuffix(MAY_FAIL).partition(" >")
    asked = head.removesuffix(" 2>&1")
    special = set("[]{}()|&;<>*?$`~!") & set(QUOTED.sub("", asked))
    brief = " --min-time 0" if asked.startswith("routes run ") and "--min-time" not in asked else ""
    if special or "--executor" in asked or not asked.startswith("routes "):
        done = shell(command.replace(asked, asked + brief, 1), folder)
        return Ran(done.returncode, done.stdout, done.stderr)
    apart = ["--isolate"] if "unruly" in asked else []
    ran = cli(*shlex.split(asked + brief)[1:], *apart)
    if command.endswith(MAY_FAIL):
        ran = Ran(0, ran.out, ran.err)
    if asked != head:
        ran = Ran(ran.code, ran.out + ran.err, "")
    if file:
        (folder / file).write_text(ran.out)
        ran = Ran(ran.code, "", ran.err)
    if reader:
        done = subprocess.run(reader, shell=True, cwd=folder, input=ran.out, capture_output=True, text=True)
        ran = Ran(done.returncode, done.stdout, ran.err + done.stderr)
    return ran


def consoles() -> list[tuple[str, str]]:
    """Document and block; a command that several documents show, with the same output but for numbers, is run once."""
    found = {}
    for document in reversed(DOCUMENTS):
        for block in blocks(document, "console"):
            command, _, shown = block.partition("\n")
            found[command, str(shape(shown))] = document, block
    assert len(found) > 15, "hardly any console block: the pattern no longer finds them"
    return list(found.values())


@pytest.mark.parametrize(("document", "block"), consoles(), ids=lambda text: text.splitlines()[0][:40])
def test_commands_print_what_is_shown(document: str, block: str, tmp_path: Path, cli) -> None:
    command, _, shown = block.removeprefix("$ ").partition("\n")
    ran = typed(cli, reader(document, tmp_path), command)
    assert (ran.code, ran.err) == (0, "")
    assert shape(ran.out) == shape(shown)
    if command.startswith("routes check"):
        (calls,) = re.findall(r"(\d+) objective calls", ran.out)
        assert int(calls) <= 240
        (code,) = re.findall(r"exit code (\d)", ran.out)
        assert f"exit code {code}" in shown  # a number, which the shape leaves out


@pytest.mark.parametrize("document", having("sh"))
def test_the_other_commands_run(document: str, tmp_path: Path, cli) -> None:
    folder = reader(document, tmp_path)
    for block in blocks(document, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            command, _, writes = (part.strip() for part in line.partition("  # writes "))
            ran = typed(cli, folder, command.partition("  #")[0].strip())
            assert (ran.code, ran.err) == (0, ""), command
            assert not writes or (folder / writes).stat().st_size > 0
            for row in ran.rows if "--json" in command else ():
                assert row.get("calls", 0) <= 240


@pytest.mark.parametrize("document", having("python"))
def test_python_blocks_run_one_after_the_other(document: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(reader(document, tmp_path))
    space: dict = {}
    for block in blocks(document, "python"):
        exec(compile(block, document, "exec"), space)


@pytest.mark.parametrize("target", ["demo", "test"])
def test_the_two_commands_exist_and_do_what_the_readme_says(target: str) -> None:
    assert any(re.search(rf"^make {target} ", block, re.MULTILINE) for block in blocks("README.md", ""))
    dry = shell(f"make --dry-run --always-make {target}", ROOT)
    assert dry.returncode == 0, dry.stderr
    last = "routes run --problem bar --route all" if target == "demo" else "pytest"
    assert all(step in dry.stdout for step in ("-m venv .venv", "pip install", last))


def test_make_lists_its_targets() -> None:
    listed = shell("make", ROOT).stdout
    gates = "gate baseline benchmark-regression benchmark-baseline"
    for target in f"help demo test lint type {gates} benchmark mutants reports reference docs clean".split():
        assert re.search(rf"^{target} ", listed, re.MULTILINE), target


def test_the_readme_is_one_page() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) <= 250


@pytest.mark.parametrize("document", DOCUMENTS)
def test_no_document_points_nowhere(document: str) -> None:
    text = (ROOT / document).read_text()
    linked = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", text)
    here = [path for path in linked if "reference/" not in path]  # generated: `make docs` follows those
    top = re.findall(r"`((?:bench|routes|problems|tests|examples|benchmarks|docs|findings)/[\w./]+)`", text)
    missing = [p for p in here if not (ROOT / document).parent.joinpath(p).exists()]
    assert not missing + [p for p in top if "NAME" not in p and not (ROOT / p).exists()]
