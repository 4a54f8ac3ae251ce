"""Rich's console for foreign text and for pipes that close."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from gradient_routes.bench.sanitize import plain, unread


class Terminal(Console):
    """Removes control characters from text, but not those of the console's own styles; output to a closed pipe is
    discarded.
    """

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else plain(text), style, control)

    def on_broken_pipe(self) -> None:
        self.quiet = True
        unread(self.file)
