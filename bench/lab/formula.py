"""Formulas as MathML, which browsers set by themselves: no script, no font and no network is needed."""

from __future__ import annotations

import re
from functools import cache


@cache
def formula(latex: str, block: bool = False) -> str:
    r"""MathML of a formula.

    >>> formula(r"R_u^T \lambda = -J_u")[:25]
    '<math xmlns="http://www.w3'
    """
    from latex2mathml.converter import convert

    return str(convert(latex, display="block" if block else "inline"))


def with_formulas(text: str) -> str:
    """HTML with its $formulas$ set, and its $$displayed ones$$."""
    text = re.sub(r"\$\$([^$]+)\$\$", lambda found: formula(found[1], block=True), text)
    return re.sub(r"\$([^$]+)\$", lambda found: formula(found[1]), text)
