"""Commands in processes of their own that need not import anything first: a tenth of the time of one by the shell."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from commands import ROOT, Ran, with_routes

NOBODY = 198  # a descriptor of every command: a pipe that nobody reads


class Forks:
    """One process, which has imported the package and has found the plug-ins that its environment names, and one
    forked from it for each command.
    """

    def __init__(self, **environment: str) -> None:
        command = [sys.executable, str(ROOT / "tests" / "data" / "forking.py")]
        pipes: dict[str, Any] = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._parent = subprocess.Popen(command, env={**os.environ, **environment}, **pipes)

    def run(self, folder: Path, *words: str, stdout: str | None = "", **environment: str) -> Ran:
        """`routes WORDS` in the folder; its stdout is given back or goes to a file, None for a pipe nobody reads."""
        assert self._parent.stdin is not None
        assert self._parent.stdout is not None
        with tempfile.NamedTemporaryFile() as out, tempfile.NamedTemporaryFile() as err:
            given = {
                "words": words,
                "folder": str(folder),
                "environment": {**with_routes(), **environment},
                "files": [os.devnull, out.name if stdout == "" else stdout, err.name],
                "nobody": NOBODY,
            }
            self._parent.stdin.write(f"{json.dumps(given)}\n")
            self._parent.stdin.flush()
            code = int(self._parent.stdout.readline())
            return Ran(code, *(file.read().decode(errors="backslashreplace") for file in (out, err)))

    def end(self) -> None:
        self._parent.communicate()
