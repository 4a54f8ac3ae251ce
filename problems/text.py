"""Texts of other people's code, as long as anybody reads."""

from __future__ import annotations

MOST = 4096  # characters


def shortened(text: str, most: int = MOST) -> str:
    """The text, or its head and its tail with the number of characters between them that are left out."""
    if len(text) <= most:
        return text
    kept = most - len(_gap(len(text)))
    head = kept // 2
    tail = kept - head
    return f"{text[:head]}{_gap(len(text) - kept)}{text[len(text) - tail :]}"


def _gap(count: int) -> str:
    return f" [... {count} characters left out ...] "
