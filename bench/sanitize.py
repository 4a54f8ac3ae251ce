"""Output that is safe: no control characters of foreign text, no error for a closed pipe."""

from __future__ import annotations

import os
from typing import IO

CONTROLS = dict.fromkeys(code for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t")


def plain(text: str) -> str:
    """The text without control characters, which could recolour or overwrite a terminal."""
    return text if text.isprintable() else text.translate(CONTROLS)


def unread(stream: IO[str]) -> None:
    """Discard further output of a stream whose reader has gone, so that results can still be stored."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
