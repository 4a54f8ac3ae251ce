"""Gradients of PDE-constrained objectives: every route to dJ/dp, its cost and its error.

What is named in `__all__` is the public interface; everything else is private and may change.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gradient_routes.bench.verification.api import assert_gradient as assert_gradient
    from gradient_routes.bench.verification.api import check as check

PUBLIC = {  # name -> the module that defines it, imported when the name is first used
    "assert_gradient": "gradient_routes.bench.verification.api",
    "check": "gradient_routes.bench.verification.api",
}
__all__ = ["assert_gradient", "check"]


def __getattr__(name: str) -> Any:
    if name in PUBLIC:
        return getattr(import_module(PUBLIC[name]), name)
    raise AttributeError(f"module 'gradient_routes' has no attribute '{name}'")
