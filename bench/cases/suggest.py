"""The next step for a mistyped name."""

from __future__ import annotations

from collections.abc import Iterable


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """`did you mean 'bar'?` where something is near, else the list of what there is, `` where there is nothing."""
    from difflib import get_close_matches  # only on the way to an error

    known = list(known)
    near = get_close_matches(name, known, n=1, cutoff=0.5)
    if near:
        return f"did you mean '{near[0]}'?"
    return f"choose from {', '.join(known)}" if known else ""
