"""Rich's console, for text of others."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from gradient_routes.bench.sanitize import plain, unread


class Terminal(Console):
    """No text has control characters; those of styles and of live displays are the console's own. A reader who leaves
    ends nothing.
    """

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text), style, control)

    def on_broken_pipe(self) -> None:
        self.quiet = True
        unread(self.file)
