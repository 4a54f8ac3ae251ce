"""Making the environment of an adapter: by uv where it is installed, by venv and pip where not, by cc for one in C."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from gradient_routes.bench.environments.interpreters import fitting
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.text import shortened
from gradient_routes.routes.foreign.manifest import Manifest


class NotInstalled(RoutesError):
    """An environment could not be made."""


def create(manifest: Manifest) -> Path:
    """Makes its environment anew and returns the folder; what is left of a failed try is not taken for one.

    Raises InputError where no interpreter fits, NotInstalled with the last line of what failed.
    """
    folder = manifest.folder
    shutil.rmtree(folder, ignore_errors=True)
    folder.parent.mkdir(parents=True, exist_ok=True)
    if manifest.compiled:
        _compile(manifest)
    else:
        _install(manifest)
    manifest.mark.write_text("\n".join((*manifest.dependencies, *manifest.without_dependencies)) + "\n")
    return folder


def _compile(manifest: Manifest) -> None:
    cc = os.environ.get("CC") or "cc"
    if shutil.which(cc) is None:
        raise NotInstalled(f"{manifest.name}: no C compiler {cc} here - install one, or name it in CC")
    manifest.folder.mkdir()
    _run([cc, "-O2", "-o", str(manifest.program), str(manifest.script), "-lm"], manifest.name)


def _install(manifest: Manifest) -> None:
    python, folder = fitting(manifest.requires_python, manifest.name), manifest.folder
    uv, nothing = shutil.which("uv"), not (manifest.dependencies or manifest.without_dependencies)
    make = [uv, "venv", "--quiet", "--python", str(python)] if uv else [str(python), "-m", "venv"]
    _run([*make, *(["--without-pip"] if nothing and not uv else []), str(folder)], manifest.name)
    there = str(manifest.python)
    install = [uv, "pip", "install", "--quiet", "--python", there] if uv else [there, "-m", "pip", "install", "--quiet"]
    for needed, alone in ((manifest.dependencies, []), (manifest.without_dependencies, ["--no-deps"])):
        if needed:
            _run([*install, *alone, *needed], manifest.name)


def _run(command: Sequence[str], who: str) -> None:
    variables = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    variables["PIP_DISABLE_PIP_VERSION_CHECK"] = "1"
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, env=variables)
    if done.returncode:
        said = (done.stderr.strip() or done.stdout.strip() or "no word").splitlines()[-1]
        raise NotInstalled(f"{who}: {Path(command[0]).name} ended with exit code {done.returncode}: {shortened(said)}")


def weight(folder: Path) -> int:
    """Bytes of its files, links not followed."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if not path.is_dir() or path.is_symlink())
