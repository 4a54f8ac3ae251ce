"""The bar by every route, and the tests named, on the oldest Python 3.11, 3.12 and 3.13 that PATH or pyenv has."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

VERSIONS = ("3.11", "3.12", "3.13")
ROOT = Path(__file__).parent.parent
VERSION = "import sys; print(*sys.version_info[:3], sep='.')"


def installed(minor: str) -> dict[str, str]:
    """Version -> path. pyenv's shims stand for interpreters that are found in its own folder."""
    folders = [Path(folder) for folder in os.environ["PATH"].split(os.pathsep)]
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    paths = [folder / f"python{minor}" for folder in folders if folder != pyenv / "shims"]
    found = {}
    for path in (*paths, *pyenv.glob(f"versions/{minor}.*/bin/python")):
        if path.is_file():
            done = subprocess.run([path, "-c", VERSION], capture_output=True, text=True)
            if done.returncode == 0:
                found[done.stdout.strip()] = str(path)
    return found


def passes(version: str, python: str, tests: list[str]) -> bool:
    """Whether the wheel installs, runs and passes the tests there. The environment is kept in .venvs/."""
    bin = ROOT / ".venvs" / version / "bin"
    pip = [bin / "python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    shutil.rmtree(ROOT / "build", ignore_errors=True)  # else modules that are gone would be installed
    steps = (
        [python, "-m", "venv", bin.parent],
        [*pip, ".[test]"],
        [*pip, "--force-reinstall", "--no-deps", "."],  # what an earlier call has installed is of older sources
        [bin / "routes", "run", "--problem", "bar", "--route", "all", "--no-store"],
        [bin / "python", "-m", "pytest", *tests],
    )
    print(f"== Python {version}, {python}", flush=True)
    return all(subprocess.run(step, cwd=ROOT).returncode == 0 for step in steps)


failed = []
for minor in VERSIONS:
    found = installed(minor)
    if not found:
        print(f"== Python {minor} is not installed: left out")
        continue
    oldest = min(found, key=lambda version: [int(number) for number in version.split(".")])
    if not passes(oldest, found[oldest], sys.argv[1:]):
        failed.append(oldest)
sys.exit(f"failed on {', '.join(failed)}" if failed else 0)
