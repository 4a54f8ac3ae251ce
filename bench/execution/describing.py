"""What code of the user's own declares, found out in a process of its own: the runner does not import it."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass
from typing import ClassVar

from gradient_routes.bench.cases import case, declared
from gradient_routes.bench.cases.declared import Declared
from gradient_routes.bench.cases.imported import is_reference
from gradient_routes.bench.cases.registry import Kind
from gradient_routes.bench.cases.selector import parse
from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.isolation.messages import Ended, Returned
from gradient_routes.bench.execution.isolation.worker_process import WorkerProcess
from gradient_routes.problems.errors import InputError, RoutesError

Named = tuple[Kind, str]  # by a selector


@dataclass(frozen=True)
class Describe:
    """Imports what selectors name, refuses options that are wrong, and says of each what its code declares."""

    selectors: list[Named]
    name: ClassVar[str] = "import"

    def __call__(self, channel: Channel) -> None:
        for kind, text in self.selectors:
            if kind == "problem":
                case.problems([text])
            else:
                case.routes([text])
            found = declared.known(kind, parse(text).name)
            assert found is not None
            channel.say(Returned(found.plain(parse(text).name)))


def described(problems: Iterable[str], routes: Iterable[str], limits: Limits) -> declared.Told:
    """What the references among these selectors declare, by kind and name; a process is started where there are some.

    Raises InputError for what cannot be asked of them, RoutesError where their code fails or its process ends.
    """
    named: list[Named] = [*(("problem", text) for text in problems), *(("route", text) for text in routes)]
    waiting = [(kind, text) for kind, text in named if is_reference(parse(text).name)]
    told: dict[Named, Declared] = {}
    if not waiting:
        return told
    with closing(WorkerProcess(Describe(waiting), limits, echo=True, last_words=0.0)) as line:
        for kind, text in waiting:
            message = line.hear()
            if not isinstance(message, Returned):
                raise _failed(kind, text, message)
            told[kind, parse(text).name] = message.value
    return told


def _failed(kind: Kind, text: str, end: Ended) -> BaseException:
    if end.status is Status.INTERRUPTED:
        return KeyboardInterrupt()
    if end.status is Status.REFUSED:
        return InputError(end.reason)
    if not end.status.todo:
        return RoutesError(end.reason)
    return RoutesError(f"{kind} '{text}': {end.status} while it was imported: {end.reason} - {end.status.todo}")
