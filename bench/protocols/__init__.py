"""Protocols that other software speaks: foreign models as subjects of a check, and our problems served to others."""

from __future__ import annotations

PROTOCOLS = ("umbridge:", "tesseract:")


def is_foreign(target: str | None) -> bool:
    """Whether it names a model behind one of them."""
    return target is not None and target.startswith(PROTOCOLS)
