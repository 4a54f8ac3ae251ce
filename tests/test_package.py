"""What is built: the wheel holds one top-level name and all of it, the sdist everything, and both run."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from dataclasses import dataclass
from pathlib import Path

import pytest
from commands import PATIENCE, ROOT

FLOORS = ("adapters", "bench", "problems", "routes")
GENERATED = {"PKG-INFO", "setup.cfg"}
BUILD = "import sys, setuptools.build_meta as b; to = sys.argv[1]; b.build_wheel(to); b.build_sdist(to)"
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
# files of the web library Routes with the names of ours, for where no index can be reached
WEB = ("__init__.py", "route.py", "base.py", "mapper.py")


def sources() -> list[str]:
    """The files of the project, those not yet added to git included; in an unpacked sdist those it lists."""
    if not (ROOT / ".git").exists():
        listed = (ROOT / "gradient_routes.egg-info" / "SOURCES.txt").read_text().splitlines()
        return [name for name in listed if ".egg-info/" not in name and name not in GENERATED]
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\0")
    return [name for name in names if name and os.path.lexists(ROOT / name)]


def of_the_package() -> set[str]:
    """The files that are installed, by their places there."""
    below = {f"gradient_routes/{name}" for name in sources() if name.startswith(tuple(f"{f}/" for f in FLOORS))}
    return below | {f"gradient_routes/{name}" for name in ("__init__.py", "__main__.py", "lab.py", "py.typed")}


@dataclass(frozen=True)
class Built:
    wheel: Path
    sdist: Path


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    """Wheel and sdist of a copy, in which no earlier build has left anything."""
    copy, dist = tmp_path_factory.mktemp("copy"), tmp_path_factory.mktemp("dist")
    for name in sources():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, copy / name, follow_symlinks=False)
    done = subprocess.run([sys.executable, "-c", BUILD, str(dist)], cwd=copy, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    return Built(wheel, sdist)


@dataclass(frozen=True)
class Installed:
    """An environment and a working folder; `run` starts a program of that environment there."""

    bin: Path
    folder: Path

    def run(self, program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        left_out = ("PYTHONPATH", "VIRTUAL_ENV")
        env = {name: value for name, value in os.environ.items() if name not in left_out}
        command = [str(self.bin / program), *arguments]
        return subprocess.run(command, cwd=self.folder, env=env, capture_output=True, text=True, timeout=2 * PATIENCE)


@pytest.fixture(scope="module")
def installed(built: Built, tmp_path_factory: pytest.TempPathFactory) -> Installed:
    """The wheel, and after it the web library Routes, in an environment that has the dependencies of this one; the
    folder holds modules with the names of the three floors.
    """
    environment, folder = tmp_path_factory.mktemp("environment"), tmp_path_factory.mktemp("folder")
    venv.create(environment, symlinks=True)
    bin, (site,) = environment / "bin", environment.glob("lib/python*/site-packages")
    shared = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    (site / "shared.pth").write_text("\n".join(shared))
    install = (*PIP, "--python", str(bin / "python"), "install", "--no-deps")
    subprocess.run([*install, "--force-reinstall", str(built.wheel)], check=True)
    web = [*install, "--retries", "0", "--timeout", "5", "Routes"]
    if subprocess.run(web, capture_output=True).returncode != 0:
        (site / "routes").mkdir()
        for name in WEB:
            (site / "routes" / name).write_text("raise ImportError('this is the web library')\n")
    for name in FLOORS:
        (folder / f"{name}.py").write_text("raise ImportError('this is a file of the user')\n")
    assert (site / "routes" / "mapper.py").is_file()
    assert (site / "gradient_routes" / "routes" / "route.py").is_file()
    return Installed(bin, folder)


def test_the_wheel_holds_every_module_and_data_file_under_one_name(built: Built) -> None:
    with zipfile.ZipFile(built.wheel) as wheel:
        names = {name for name in wheel.namelist() if ".dist-info/" not in name}
    assert names == of_the_package()
    assert {Path(name).suffix for name in names} >= {".py", ".typed"}


def test_the_sdist_holds_every_file(built: Built) -> None:
    with tarfile.open(built.sdist) as sdist:
        names = {member.name.partition("/")[2] for member in sdist.getmembers() if member.isfile()}
    names = {name for name in names if ".egg-info/" not in name}
    links = {f"gradient_routes/{name}" for name in FLOORS}
    expected = ({*sources()} - links) | of_the_package() | GENERATED
    assert names == expected, "what is missing is to be named in MANIFEST.in"


def test_the_tests_run_from_an_unpacked_sdist(built: Built, tmp_path: Path) -> None:
    with tarfile.open(built.sdist) as sdist:
        sdist.extractall(tmp_path, filter="data")
    (root,) = tmp_path.iterdir()
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "tests/test_layers.py", "-k", "loose"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, timeout=2 * PATIENCE)
    assert done.returncode == 0, done.stdout
    where = "import gradient_routes.bench.cli as cli; print(cli.__file__)"
    done = subprocess.run([sys.executable, "-c", where], cwd=root, capture_output=True, text=True)
    assert done.stdout.strip() == str(root / "gradient_routes" / "bench" / "cli.py")


def test_it_runs_beside_routes_and_files_with_the_names_of_its_floors(installed: Installed) -> None:
    """As in the test below, of every module."""
    run = ("routes", "run", "--problem", "bar", "--route", "adjoint", "--no-store", "--no-timing", "--json")
    for options in (["--no-isolate"], []):  # in this process, and in one of its own
        done = installed.run(*run, *options)
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.count('"status": "ok"') == 1


def test_every_module_of_the_wheel_finds_what_it_imports(installed: Installed) -> None:
    """Nothing that is installed rests on what is not: tests, benchmarks, examples."""
    code = (
        "from importlib import import_module; from pkgutil import walk_packages; import gradient_routes as g\n"
        "for module in walk_packages(g.__path__, 'gradient_routes.'):\n"
        "    if not module.name.endswith('__main__'): import_module(module.name)"
    )
    done = installed.run("python", "-c", code)
    assert (done.returncode, done.stderr) == (0, "")


def test_python_m_is_the_command(installed: Installed) -> None:
    done = installed.run("python", "-m", "gradient_routes", "--help")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == installed.run("routes", "--help").stdout
    where = installed.run("python", "-c", "import gradient_routes; print(gradient_routes.__file__)").stdout
    assert where.startswith(str(installed.bin.parent)), "the wheel is not what was tested"


def test_the_citation_has_what_its_format_asks_for_and_the_version_of_the_package() -> None:
    """Citation File Format 1.2.0: cff-version, message, title and authors are required."""
    text = (ROOT / "CITATION.cff").read_text()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    top = dict(re.findall(r"^([a-z-]+):[ ]*(.*)$", text, re.MULTILINE))
    assert top.keys() >= {"cff-version", "message", "title", "authors"}
    assert (top["cff-version"], top["version"], top["license"]) == ("1.2.0", project["version"], project["license"])
    assert top["repository-code"] == project["urls"]["Repository"]
    assert re.findall(r"^  - name: (.*)$", text, re.MULTILINE) == [author["name"] for author in project["authors"]]


def test_the_classifiers_name_the_versions_that_are_tested() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = re.findall(r"Python :: (3\.\d+)", "\n".join(project["classifiers"]))
    for file, before in ((".ci/pythons.py", "VERSIONS = "), (".github/workflows/ci.yml", "python: ")):
        line = (ROOT / file).read_text().partition(before)[2].partition("\n")[0]
        assert re.findall(r"3\.\d+", line) == named, file
    assert project["requires-python"] == f">={named[0]}"


def test_make_test_pythons_names_tests_that_there_are() -> None:
    alone = {name: value for name, value in os.environ.items() if not name.startswith("MAKE")}  # `make test` runs this
    command = ["make", "--dry-run", "test-pythons"]
    done = subprocess.run(command, cwd=ROOT, env=alone, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    _, script, *tests = done.stdout.split()
    assert len(tests) > 2
    assert all((ROOT / name).exists() for name in (script, *tests))
