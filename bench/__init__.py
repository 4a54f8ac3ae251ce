"""Floor 3, the bench: measures routes on problems, judges gradients, keeps the rows, shows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bench.checking.api import assert_gradient as assert_gradient
    from bench.checking.api import check as check

__all__ = ["assert_gradient", "check"]


def __getattr__(name: str) -> Any:
    """`from bench import check` imports NumPy; `routes --help` shall not."""
    if name in __all__:
        from bench.checking import api

        return getattr(api, name)
    raise AttributeError(f"module 'bench' has no attribute '{name}'")
