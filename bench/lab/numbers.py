"""Numbers, vectors and matrices as HTML."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence

import numpy as np

from gradient_routes.problems.problem import Array

DIGITS = 4
ZERO = "·"  # in matrices, so that their pattern is seen


def number(x: float, digits: int = DIGITS, zero: str = "0") -> str:
    """So many digits, with a minus as wide as a plus.

    >>> number(-0.03572303), number(0.0), number(1.5e-9)
    ('−0.03572', '0', '1.5e−09')
    """
    return zero if x == 0.0 else f"{x:.{digits}g}".replace("-", "\u2212")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Cells are HTML; the first of each row names it."""
    top = "".join(f'<th scope="col"{_left(k)}>{cell}</th>' for k, cell in enumerate(head))
    lines = (
        "".join(f'<th scope="row" class="t">{c}</th>' if k == 0 else f"<td>{c}</td>" for k, c in enumerate(row))
        for row in rows
    )
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    named = f"<caption>{html.escape(caption)}</caption>" if caption else ""
    return f'<div class="scroll"><table>{named}<thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def vector(head: str, v: Array, labels: Sequence[str], name: str) -> str:
    """One row, a component a column."""
    return table([head, *labels], [[name, *map(number, map(float, v))]])


def matrix(name: str, A: Array, digits: int = 3) -> str:
    """Shaded by magnitude, so that its pattern is seen; zeros are dots."""
    largest = float(np.abs(A).max(initial=0.0)) or 1.0
    rows = "".join("<tr>" + "".join(_shaded(float(x), largest, digits) for x in row) + "</tr>" for row in A)
    return f'<div class="scroll"><table class="matrix"><caption>{name}</caption><tbody>{rows}</tbody></table></div>'


def _shaded(x: float, largest: float, digits: int) -> str:
    colour, share = "var(--warm)" if x < 0 else "var(--cold)", round(55.0 * abs(x) / largest)
    text = number(x, digits, ZERO)
    return f'<td style="background: color-mix(in srgb, {colour} {share}%, transparent)">{text}</td>'


def _left(k: int) -> str:
    return ' class="t"' if k == 0 else ""
