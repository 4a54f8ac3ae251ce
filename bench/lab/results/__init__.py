"""What rows of commands look like on a page, one command a file: figures and tables that follow the rows."""

from __future__ import annotations

from typing import Any, Protocol

import panel as pn


class Result(Protocol):
    """Figures and tables of one command."""

    def panel(self) -> pn.viewable.Viewable:
        """What is seen. Asked for once."""

    def clear(self) -> None:
        """Another command begins: nothing is known."""

    def take(self, row: dict[str, Any], /) -> None:
        """What --json prints in one line."""

    def close(self) -> None:
        """All rows have come."""
