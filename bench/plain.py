"""Text of others, before a terminal sees it."""

from __future__ import annotations

CONTROLS = dict.fromkeys(code for code in (*range(32), *range(127, 160)) if chr(code) not in "\n\t")


def plain(text: str) -> str:
    """Without control characters, which could recolour a terminal, retitle it or overwrite what it shows."""
    return text if text.isprintable() else text.translate(CONTROLS)
