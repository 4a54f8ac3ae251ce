"""Environments of adapters: fitting interpreters, what is installed, and what is said where that fails."""

from __future__ import annotations

import shlex
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from gradient_routes.bench.environments import building, interpreters
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError
from gradient_routes.routes.foreign.foreign import of_manifest
from gradient_routes.routes.foreign.manifest import Manifest, environments, manifest, shipped

SCRIPT = Path(__file__).parent / "bar_adapter.py"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder for environments."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(building.shutil, "which", lambda name: None)
    return tmp_path / "cache"


@pytest.fixture
def ours(monkeypatch: pytest.MonkeyPatch) -> list[Sequence[str]]:
    """Instead of pip, which needs an index: what is installed here is visible there. The commands that were run."""
    real, commands = building._run, []

    def run(command: Sequence[str], who: str) -> None:
        commands.append(command)
        if "install" not in command:
            return real([*command[:-1], "--without-pip", command[-1]], who)
        (site,) = Path(command[0]).parent.parent.glob("lib/python*/site-packages")
        shared = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
        (site / "shared.pth").write_text("\n".join(shared))
        return None

    monkeypatch.setattr(building, "_run", run)
    return commands


def test_an_environment_is_listed_made_compared_and_used(ours: list[Sequence[str]], cli, monkeypatch) -> None:
    run = ["run", "--problem=bar", f"--route=adapter[command={SCRIPT}]", "--no-store", "--json", "--no-timing"]
    resumed = [*(word for word in run if word != "--no-store"), "--resume"]
    (row,) = cli(*resumed).rows
    make = f"routes environments create {SCRIPT}"
    assert (row["status"], row["reason"]) == ("skipped", f"{SCRIPT} has no environment here - make it: {make}")
    ran = cli(*make.split()[1:])
    assert (ran.code, ran.err) == (0, "")
    assert f"{SCRIPT.stem}: " in ran.out
    assert "gradient on bar off ours by" in ran.out
    assert ours[1][1:] == ["-m", "pip", "install", "--quiet", "numpy"]
    (row,) = cli(*resumed).rows  # not taken for done because it was skipped
    assert (row["status"], row["peer"]["name"], row["peer"]["forward_s"]) == ("ok", "bar-by-hand", 1e-6)
    assert row["gradient_error"] < 1e-14
    assert row["memory_method"] == "by bar-by-hand itself"
    if sys.platform == "linux":
        assert row["peak_bytes"] == row["peer"]["peak_bytes"] >= 0
    assert row["peer"]["versions"].keys() == {"numpy"}
    (row,) = cli(*[word.replace("=bar", "=bar[parametrization=raw]", 1) for word in run]).rows
    assert (row["status"], row["reason"]) == ("skipped", "adapter: load(): log E, not raw")


def test_every_adapter_is_listed_with_the_command_that_makes_its_environment(cli) -> None:
    out = cli("environments").out
    for name in shipped():
        assert f"missing: routes environments create {name}" in out


def test_a_route_without_its_environment_is_skipped_with_that_command(cli) -> None:
    (row,) = cli("run", "--problem=bar", "--route=jax", "--no-store", "--json").rows
    assert (row["status"], row["reason"].partition(" - ")[2]) == ("skipped", "make it: routes environments create jax")


def test_of_a_case_that_is_not_known_it_is_said_what_differs() -> None:
    route = of_manifest(manifest(SCRIPT))
    assert route.objection(Bar(parametrization="raw")) == "bar_adapter knows parametrization log, not raw"
    assert route.objection(Block(n=1)) == "bar_adapter knows bar, not hyperelastic"
    assert route.objection(Bar(alpha=0.1)) == "bar: alpha=0.1 is not described to other codes - leave it out"
    assert route.objection(Bar()) == (
        "bar_adapter has no environment here - make it: routes environments create bar_adapter"
    )


def test_options_are_those_of_the_metadata_the_default_first() -> None:
    route = of_manifest(manifest(SCRIPT))
    assert route.defaults == {"sums": "cumulative"}
    assert route.summary == "the bar by cumulative sums, for tests"
    assert not route.sound, "`all` does not include other codes"


def test_what_another_version_needs_has_another_folder(tmp_path: Path) -> None:
    text = SCRIPT.read_text()
    folders = set()
    for wanted in ("numpy", "numpy>=2"):
        (tmp_path / SCRIPT.name).write_text(text.replace('"numpy"', f'"{wanted}"'))
        folders.add(manifest(tmp_path / SCRIPT.name).folder)
    assert len(folders) == 2
    assert {folder.parent for folder in folders} == {environments()}


def test_of_a_failing_install_the_last_line_is_shown_and_nothing_is_taken_for_ready() -> None:
    pip = [sys.executable, "-m", "pip", "install", "--no-index", "no-package-of-that-name"]
    with pytest.raises(building.NotInstalled, match=r"bar: python.* ended with exit code 1: ERROR: No matching dist"):
        building._run(pip, "bar")


@pytest.mark.skipif(not shutil.which("cc"), reason="no C compiler here: install one that is called cc")
def test_a_program_in_C_is_compiled(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    found = manifest(shipped()["executable"])
    monkeypatch.setattr(building.shutil, "which", lambda name: name == "cc" or None)
    ran = cli("environments", "create", "executable")
    assert (ran.code, found.ready) == (0, True), ran.err
    assert "gradient on bar off ours by" in ran.out
    monkeypatch.setenv("CC", "no-such")
    ran = cli("environments", "create", "executable")
    says = "executable: no C compiler no-such here - install one, or name it in CC"
    assert (ran.code, ran.err, found.ready) == (1, f"routes: {says}\n", False)


def test_those_that_are_made_may_be_left_alone(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []

    def create(found: Manifest) -> Path:
        made.append(found.name)
        raise building.NotInstalled(f"{found.name}: no network")

    monkeypatch.setattr(building, "create", create)
    for name in ("dolfinx-adjoint", "jax"):
        mark = manifest(shipped()[name]).mark
        mark.parent.mkdir(parents=True)
        mark.touch()
    assert cli(*"environments create --missing jax torch".split()).err == "routes: torch: no network\n"
    assert cli(*"environments create --missing all".split()).code == 1
    assert cli(*"environments create jax".split()).code == 1
    assert made == ["torch", "diffrax", "jax"]


def test_a_failed_environment_is_not_ready(monkeypatch: pytest.MonkeyPatch, cli) -> None:
    def fail(command: Sequence[str], who: str) -> None:
        Path(command[-1]).mkdir(parents=True, exist_ok=True)
        raise building.NotInstalled(f"{who}: pip ended with exit code 1: ERROR: no space left")

    monkeypatch.setattr(building, "_run", fail)
    ran = cli("environments", "create", "jax")
    assert (ran.code, ran.err) == (1, "routes: jax: pip ended with exit code 1: ERROR: no space left\n")
    assert not manifest(shipped()["jax"]).ready


@pytest.mark.parametrize(
    ("requires", "says"),
    [
        (">=3.99", r"mine: needs Python >=3.99, here is 3\.\d+\.\d+.* - install one, by uv, pyenv or your system"),
        ("three", "mine: requires-python = 'three' is no version specifier - write '>=3.12'"),
    ],
)
def test_an_interpreter_that_is_missing_is_named(requires: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        interpreters.fitting(requires, "mine")


def interpreter(path: Path, version: str) -> Path:
    """A program that says it is of that version."""
    path.parent.mkdir(parents=True)
    path.write_text(f"#!/bin/sh\necho {version}\n")
    path.chmod(0o755)
    return path


def test_one_of_the_path_or_of_pyenv_is_taken_where_ours_does_not_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    named = interpreter(tmp_path / "bin" / "python3.19", "3.19.2")
    of_pyenv = interpreter(tmp_path / "pyenv" / "versions" / "3.18.1" / "bin" / "python", "3.18.1")
    monkeypatch.setattr(interpreters.shutil, "which", lambda name: str(named) if name == "python3.19" else None)
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path / "pyenv"))
    assert interpreters.fitting(">=3.19", "mine") == named
    assert interpreters.fitting("==3.18.*", "mine") == of_pyenv
    with pytest.raises(InputError, match=r"needs Python >=3\.20, here is .*, 3\.19\.2, 3\.18\.1 - install one"):
        interpreters.fitting(">=3.20", "mine")


def test_an_adapter_without_packages_needs_no_index(tmp_path: Path) -> None:
    script = tmp_path / "plain.py"
    script.write_text(SCRIPT.read_text().replace('["numpy"]', "[]"))
    found = manifest(script)
    assert not found.ready
    folder = building.create(found)
    assert found.ready
    assert building.weight(folder) > 0
    assert interpreters.version_of(found.python) == interpreters.version_of(Path(sys.executable))
    assert not list(folder.glob("lib/python*/site-packages/pip"))


@pytest.mark.parametrize("uv", [None, "/there/uv"])
def test_uv_makes_it_where_it_is_installed(uv: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    script = tmp_path / "two.py"
    alone = '# [tool.gradient-routes]\n# without-dependencies = ["alone==1"]'
    script.write_text(SCRIPT.read_text().replace("# [tool.gradient-routes]", alone))
    commands: list[list[str]] = []
    monkeypatch.setattr(building.shutil, "which", lambda name: uv if name == "uv" else None)
    monkeypatch.setattr(building, "_run", lambda command, who: commands.append([*map(str, command)]))
    found = manifest(script)
    found.folder.mkdir(parents=True)
    monkeypatch.setattr(building.shutil, "rmtree", lambda *arguments, **options: None)
    building.create(found)
    python, there = sys.executable, str(found.python)
    make = [uv, "venv", "--quiet", "--python", python] if uv else [python, "-m", "venv"]
    install = [uv, "pip", "install", "--quiet", "--python", there] if uv else [there, "-m", "pip", "install", "--quiet"]
    assert commands == [
        [*make, str(found.folder)],
        [*install, "numpy"],
        [*install, "--no-deps", "alone==1"],
    ]


def test_ours_is_taken_where_it_fits_and_one_that_does_not_run_is_none() -> None:
    assert interpreters.fitting(">=3.11", "mine") == Path(sys.executable)
    assert interpreters.version_of(Path("/bin/false")) is None
    assert interpreters.version_of(Path("/nowhere/python")) is None


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("print()", "has no inline metadata, a comment '# /// script' - see the guide"),
        ("# /// script\n# dependencies = [\n# ///\n", "its inline metadata cannot be read"),
        ("# /// script\n# dependencies = []\n# ///\n", "its table tool.gradient-routes lacks 'summary' - add it"),
        (None, "cannot be read"),
    ],
)
def test_a_script_without_metadata_says_what_it_lacks(text: str | None, says: str, tmp_path: Path, cli) -> None:
    script = tmp_path / "mine.py"
    if text is not None:
        script.write_text(text)
    ran = cli("environments", "create", shlex.quote(str(script)))
    assert ran.code == 2
    assert says in ran.err


def test_a_mistyped_name_is_answered_with_the_nearest(cli) -> None:
    ran = cli("environments", "create", "jaxx")
    assert (ran.code, ran.err) == (2, "routes: no adapter 'jaxx' - did you mean 'jax'?\n")
