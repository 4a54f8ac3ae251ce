"""Files written beside a store."""

from __future__ import annotations

from pathlib import Path

from gradient_routes.problems.errors import InputError


def check_writable(option: str, path: Path, taken: list[Path]) -> None:
    if any(path.resolve() == other.resolve() for other in taken):
        raise InputError(f"{option} {path}: is another file of this run - name one of its own")
    new = not path.exists()
    try:
        path.open("ab").close()
    except OSError as error:
        raise InputError(f"{option} {path}: {error.strerror or error} - name a file you may write") from error
    if new:
        path.unlink()
