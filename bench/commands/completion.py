"""Shell completion of --problem, --route and --at; registered names are read without importing what they name."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from gradient_routes.routes.entry_points import group

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class Selector(click.types.StringParamType):
    """Text that names problems or routes, completed by registered names, else by files."""

    def __init__(self, group: str) -> None:
        self.group = group

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        names = {point.name for point in group(self.group)} | ({"all"} if param.multiple else set())
        matching = [CompletionItem(name) for name in sorted(names) if name.startswith(incomplete)]
        return matching or [CompletionItem(incomplete, type="file")]


class Point(click.types.StringParamType):
    """Text that names a point p, completed by the words for one and by files."""

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        from click.shell_completion import CompletionItem

        words = [CompletionItem(word) for word in ("start", "true") if word.startswith(incomplete)]
        return [*words, CompletionItem(incomplete, type="file")]


COMPLETED = {f"--{kind}": Selector(f"gradient_routes.{kind}s") for kind in ("problem", "route")} | {"--at": Point()}


def with_completion(command: click.Command) -> click.Command:
    """The command, these options of it completed."""
    for parameter in command.params:
        for option in parameter.opts:
            parameter.type = COMPLETED.get(option, parameter.type)
    return command
