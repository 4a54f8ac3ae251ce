"""Command lines, one a line on stdin as JSON, each in a process forked from this one, which has imported what most need
but has run nothing; their exit codes on stdout.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

import gradient_routes.bench.cli
import gradient_routes.bench.execution.executors.in_process
import gradient_routes.bench.execution.executors.isolated
import gradient_routes.bench.studies.bill.done
import gradient_routes.bench.studies.bill.view
import gradient_routes.problems.advection
import gradient_routes.problems.bar
import gradient_routes.routes.adjoint
import gradient_routes.routes.finite_difference  # noqa: F401
from gradient_routes.bench.start import main


def become(words: list[str], folder: str, environment: dict[str, str], files: list[str | None], nobody: int) -> None:
    """This process is one that was started so; a file of None, and the descriptor `nobody`, are pipes nobody reads."""
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.path[0] = str(Path(sys.executable).parent)  # as the program `routes` has it
    sys.path[1:1] = [path for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]
    sys.argv = ["routes", *words]
    for file, number in zip(files, (0, 1, 2), strict=True):
        unread(number) if file is None else open_as(file, number)
    unread(nobody)


def open_as(path: str, number: int) -> None:
    flags = os.O_WRONLY | os.O_CREAT if number else os.O_RDONLY
    opened = os.open(path, flags, 0o666)
    os.dup2(opened, number)
    os.close(opened)


def unread(number: int) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    os.dup2(writing, number)
    os.close(writing)


given: Any
for line in sys.stdin:
    given = json.loads(line)
    if not (process := os.fork()):
        break
    print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)
else:
    sys.exit()
become(**given)
main()
