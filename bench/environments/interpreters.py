"""Interpreters of Python on this machine."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from packaging.specifiers import InvalidSpecifier, SpecifierSet
from packaging.version import Version

from gradient_routes.problems.errors import InputError

MINORS = range(9, 20)  # of Python 3
ASK = "import sys; print('.'.join(map(str, sys.version_info[:3])))"
LIMIT_S = 30.0  # for an interpreter to say its version


def fitting(requires: str, who: str) -> Path:
    """The first interpreter of a version that `requires` admits, ours first. Raises InputError: what there is."""
    try:
        wanted = SpecifierSet(requires)
    except InvalidSpecifier:
        raise InputError(f"{who}: requires-python = '{requires}' is no version specifier - write '>=3.12'") from None
    seen: dict[str, Path] = {}
    for path in candidates():
        version = version_of(path)
        if version is not None and wanted.contains(Version(version)):
            return path
        if version is not None:
            seen.setdefault(version, path)
    here = ", ".join(seen) or "none"
    raise InputError(f"{who}: needs Python {requires}, here is {here} - install one, by uv, pyenv or your system")


def candidates() -> Iterator[Path]:
    """Ours, those on the PATH by name, those of pyenv."""
    yield Path(sys.executable)
    for minor in MINORS:
        found = shutil.which(f"python3.{minor}")
        if found is not None:
            yield Path(found)
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    yield from sorted(pyenv.glob("versions/*/bin/python"))


def version_of(python: Path) -> str | None:
    """None where it does not run, as a shim of pyenv for a version that is not chosen."""
    try:
        asked = subprocess.run([python, "-c", ASK], capture_output=True, text=True, timeout=LIMIT_S, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return asked.stdout.strip() or None
