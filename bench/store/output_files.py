"""Files written beside a store."""

from __future__ import annotations

from pathlib import Path

from gradient_routes.bench.cases.folder import located
from gradient_routes.problems.errors import InputError


def check_writable(option: str, path: Path, taken: list[Path]) -> None:
    file = located(path)
    if any(file.resolve() == located(other).resolve() for other in taken):
        raise InputError(f"{option} {path}: is another file of this run - name one of its own")
    new = not file.exists()
    try:
        file.open("ab").close()
    except OSError as error:
        raise InputError(f"{option} {path}: {error.strerror or error} - name a file you may write") from error
    if new:
        file.unlink()
