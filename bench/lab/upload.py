"""A file that is dropped on a page: one, small, under a plain name in the folder of its page."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath

from gradient_routes.bench.units import size
from gradient_routes.problems.errors import InputError

MOST = 5 * 2**20  # [byte]
LONGEST = 60  # characters of a name
ENDINGS = (".csv", ".txt", ".tsv", ".dat")


def plain(name: str) -> str:
    """A name without folders and without signs that selectors or shells read; one that is hidden is not.

    >>> plain("../../etc/my data (2).csv"), plain("twin"), plain("..")
    ('my_data_2_.csv', 'twin.csv', 'data.csv')
    """
    bare = PurePosixPath(name.replace("\\", "/")).name
    kept = re.sub(r"[^A-Za-z0-9._-]+", "_", bare).lstrip("._-")[-LONGEST:] or "data"
    return kept if kept.lower().endswith(ENDINGS) else f"{kept}.csv"


def keep(folder: Path, name: str, content: bytes | str) -> str:
    """Write it, in place of an earlier one of that name; its plain name. Raises InputError for too large a file."""
    found = content.encode() if isinstance(content, str) else content
    if len(found) > MOST:
        raise InputError(f"{plain(name)}: {size(len(found))} > {size(MOST)} - drop a smaller file")
    (folder / plain(name)).write_bytes(found)
    return plain(name)
