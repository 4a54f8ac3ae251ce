"""Text for whoever reads: nothing of others that commands a terminal, and nothing to whom reads no more."""

from __future__ import annotations

import os
from typing import IO

CONTROLS = dict.fromkeys(code for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t")


def plain(text: str) -> str:
    """Without control characters, which could recolour a terminal, retitle it or overwrite what it shows."""
    return text if text.isprintable() else text.translate(CONTROLS)


def unread(stream: IO[str]) -> None:
    """Its reader has gone: what is still printed goes nowhere, so that what was measured can be kept."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, stream.fileno())
    os.close(nowhere)
