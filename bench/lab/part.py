"""A part of the laboratory: what is chosen on the page is a state, the state is a command of `routes` and a URL."""

from __future__ import annotations

import asyncio
import html
import shlex
from collections.abc import Callable, Mapping
from contextlib import aclosing
from functools import partial
from typing import Any, ClassVar
from urllib.parse import urlencode

import panel as pn
import param
from bokeh.document import Document

from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.channel import Job
from gradient_routes.bench.execution.isolation.messages import Ended, Message
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.lab.pool import Begun, Pool
from gradient_routes.bench.lab.shell import Command, Exited, Said
from gradient_routes.bench.lab.state import read, within, written
from gradient_routes.problems.errors import InputError

WRONG_USAGE = 2
SLOW = 1.0  # [s] after which what is drawn fades until its command says something
TOGETHER = 10  # [ms] in which changes are gathered: every message to a browser has its price


class Part(param.Parameterized):
    """Its state are its parameters: numbers, choices, switches, lists of numbers. A change computes the command anew.

    A part declares them, writes `command`, `content` and `take`, and draws what arrives. The newest state wins: those
    that were left while a command ran are skipped. Where `at_once` is False it runs at `start` only, in the long lane,
    until `stop`.
    """

    slug: ClassVar[str]
    title: ClassVar[str]
    lead: ClassVar[str]
    each: ClassVar[Mapping[str, tuple[Any, ...]]] = {}  # list -> bounds of its items, or the words that it may have

    def __init__(self, place: Place, query: Mapping[str, str] | None = None) -> None:
        super().__init__()
        self.place = place
        self.status = pn.pane.HTML("", sizing_mode="stretch_width", css_classes=["status"])
        self.shown = pn.pane.HTML("", sizing_mode="stretch_width", css_classes=["command"])
        self._defaults = {name: self.param[name].default for name in self.fields}
        self._document: Document | None = pn.state.curdoc
        self._moves, self._waits, self._faded, self._asked = 0, False, False, ""
        self.pushed: Callable[[], None] = lambda: None  # a document sends its changes by itself, a notebook is told to
        self.drawn: tuple[pn.viewable.Viewable, ...] = ()
        self._changes: list[Callable[[], None]] = []
        self._following: asyncio.Task[None] | None = None
        self._refused = self._read(query or {})
        self.param.watch(self._changed, self.fields)
        self._show()
        self.say(bad=bool(self._refused))

    # what a part writes

    @property
    def at_once(self) -> bool:
        """Whether the state, as it is now, is computed as soon as it changes."""
        return True

    def command(self) -> tuple[str, ...]:
        """The arguments of `routes` that compute what is shown. Raises InputError where the state has none."""
        raise NotImplementedError

    def job(self) -> Job:
        """What is computed: that command, unless a part needs more than its rows."""
        return Command(self.command(), self.place.folder)

    def pool(self) -> Pool:
        """Where it is computed."""
        return self.place.quick if self.at_once else self.place.long

    def content(self) -> pn.viewable.Viewable:
        """What is seen; asked for once. `drawn` is set to what fades while it is not of the state."""
        raise NotImplementedError

    def queue(self, before: int) -> None:
        """The job waits; so many are before it."""
        self._waits = True
        self.say(f"waiting: {before} before you", bad=False)

    def begin(self) -> None:
        """A job begins."""

    def take(self, message: Message) -> None:
        """A row has come, or what `job` says."""

    def end(self, end: Ended, code: int) -> None:
        """The job has ended; its exit code."""

    # the state

    @property
    def fields(self) -> list[str]:
        """Names of the state."""
        return [name for name in self.param if name != "name" and (self.param[name].precedence or 0) >= 0]

    def query(self) -> str:
        """The state as the search of a URL: what differs from the defaults."""
        return self.query_of({name: getattr(self, name) for name in self.fields})

    def query_of(self, state: Mapping[str, Any]) -> str:
        """The same of another state."""
        return urlencode({name: written(v) for name, v in state.items() if v != self._defaults[name]}, safe=",")

    def url(self) -> str:
        """The address of this state."""
        return f"/{self.slug}?{self.query()}".rstrip("?")

    def _read(self, query: Mapping[str, str]) -> list[str]:
        """Take the state of a URL; why parts of it are not taken."""
        refused = []
        for name, text in query.items():
            if name not in self.fields:
                refused.append(f"{name[:40]}: no word of this page - choose from {', '.join(self.fields)}")
            else:
                try:
                    value = read(self.param[name], text)
                    if name in self.each:
                        within(self.each[name], value)
                    setattr(self, name, value)
                except (ValueError, TypeError) as error:
                    refused.append(
                        f"{name}={text[:40]}: {str(error)[:160]} - {name} stays {written(getattr(self, name))}"
                    )
        return refused

    def say(self, *lines: str, bad: bool = True) -> None:
        """Show lines where the page says how it stands; read aloud by screen readers.

        What of its URL was not taken is said before them, until the state changes.
        """
        lines = (*self._refused, *lines)
        kind = "bad" if bad and lines else "quiet"
        self.status.object = f'<p role="status" class="{kind}">{"<br>".join(map(html.escape, lines))}</p>'

    def _changed(self, *_: Any) -> None:
        self._refused = []
        with pn.io.hold(self._document):
            refused = self._show()
        if self.at_once:
            self.start()
        else:
            self._leave(refused or "changed: press Run to compute it", bad=bool(refused))

    def _fade(self, faded: bool) -> None:
        """What is drawn is that of another state, or of this one again, unless it was left while its command ran."""
        faded = faded or (not self.at_once and self.query() != self._asked)
        if faded != self._faded:
            self._faded = faded
            for panel in self.drawn:
                panel.styles = {"opacity": "0.4" if faded else "1"}  # no styles would leave it as it is

    def _show(self) -> str:
        """The command and the URL of the state; why there is no command."""
        link = f'<button type="button" class="copy" data-link="{html.escape(self.url())}">copy link</button>'
        try:
            text = html.escape(f"routes {shlex.join(self.command())}")
        except InputError as error:
            refused, shown = str(error), f"<code></code>{link}"
        else:
            refused = ""
            copy = f'<button type="button" class="copy" data-copy="{text}">copy command</button>'
            shown = f'<code tabindex="0">{text}</code>{copy}{link}'
        self.shown.object = f'<div class="command">{shown}</div>'
        if pn.state.location is not None and self._document is not None:
            pn.state.location.search = f"?{self.query()}".rstrip("?")
        return refused

    def start(self) -> None:
        """Compute the newest state, now or when what runs has ended."""
        self._moves += 1
        if not self.running:
            self._following = asyncio.get_running_loop().create_task(self._follow())

    def stop(self) -> None:
        """End what runs."""
        if self._following is not None:
            self._following.cancel()

    @property
    def running(self) -> bool:
        """Whether a command runs, or waits for a process, and is not to stop."""
        following = self._following
        return following is not None and not following.done() and not following.cancelling()

    async def _follow(self) -> None:
        """Run the command of the state until it is that of the newest one."""
        done = -1
        while done != self._moves:
            done, self._asked = self._moves, self.query()
            try:
                job = self.job()
            except InputError as error:
                self._later(self._leave, str(error))
            else:
                await self._run(job)

    async def _run(self, job: Job) -> None:
        said: list[str] = []
        code = 0
        slow = asyncio.get_running_loop().call_later(SLOW, self._later, self._fade, True)
        told = (lambda before: None) if self.at_once else partial(self._later, self.queue)
        try:
            async with aclosing(self.pool().messages(job, told)) as messages:
                async for message in messages:
                    match message:
                        case Begun():
                            self._later(self._begun)
                        case Said(text):
                            said.append(text.removeprefix("routes: "))
                        case Exited(code):
                            pass
                        case Ended():
                            self._later(self._ended, message, code, said)
                        case _:
                            slow.cancel()
                            self._later(self._take, message)
        except asyncio.CancelledError:
            if self._following is asyncio.current_task():  # else a newer one has begun
                self._later(self._ended, Ended(Status.INTERRUPTED, "stopped"), code, said)
            raise
        finally:
            slow.cancel()

    def _leave(self, line: str, bad: bool = True) -> None:
        """Nothing computes the state as it is now: why."""
        self._fade(True)
        self.say(line, bad=bad)

    def _begun(self) -> None:
        if self._waits:
            self._waits = False
            self.say()
        self.begin()

    def _take(self, message: Message) -> None:
        self._fade(False)
        self.take(message)

    def _ended(self, end: Ended, code: int, said: list[str]) -> None:
        failed = end.status is not Status.OK
        self.say(*said, *([end.line(self.slug)] if failed else []), bad=failed or code == WRONG_USAGE)
        self._fade(failed or code == WRONG_USAGE)
        self.end(end, code)

    def _later(self, change: Callable[..., None], *arguments: Any) -> None:
        """Change what is shown, in the turn of its document where there is one: all that has come by then together."""
        if self._document is None or self._document.session_context is None:
            change(*arguments)
            self.pushed()
            return
        self._changes.append(partial(change, *arguments))
        if len(self._changes) == 1:
            self._document.add_timeout_callback(self._change, TOGETHER)

    def _change(self) -> None:
        changes, self._changes = self._changes, []
        with pn.io.hold(self._document):  # one message to the browser
            for change in changes:
                change()
