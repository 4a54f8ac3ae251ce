"""How fast the laboratory answers: milliseconds from a slider to its numbers, one page alone, then twenty.

python -m benchmarks.laboratory
"""

from __future__ import annotations

import asyncio
import json
import secrets
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median, quantiles
from typing import Any

import psutil
from tornado.httpclient import AsyncHTTPClient, HTTPRequest
from tornado.websocket import WebSocketClientConnection, websocket_connect

from benchmarks.invented_store import fill
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.store.store import Store

PAGES, MOVES, EVERY = 20, 10, 1.0  # pages, moves of each, seconds between them
ALLOWED_MS, CROWDED_MS = 150.0, 1000.0
LAST = "routes run&lt;/code&gt;&lt;/th"  # in the last of the texts that one move changes


class Browsed:
    """A page as a browser holds it, in Bokeh's messages: nothing is drawn."""

    def __init__(self, line: WebSocketClientConnection, slider: str) -> None:
        self.line, self.slider, self.value = line, slider, 0.0

    @classmethod
    async def opened(cls, url: str) -> Browsed:
        text = (await AsyncHTTPClient().fetch(f"{url}/derivation")).body.decode()
        token = text.partition('"token":"')[2].partition('"')[0]
        line = await websocket_connect(
            HTTPRequest(f"{url}/derivation/ws".replace("http", "ws", 1), headers={"Origin": url}),
            subprotocols=["bokeh", token],
        )
        page = cls(line, "")
        await page.heard("ACK")
        await page.say("PULL-DOC-REQ", {})
        document = await page.heard("PULL-DOC-REPLY")
        page.slider = next(o["id"] for o in objects(document) if o.get("attributes", {}).get("title") == "E_2")
        ready = {"type": "event", "name": "document_ready", "values": {"type": "map"}}
        event = {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": ready}
        await page.say("PATCH-DOC", {"events": [event]})
        await page.numbers()
        return page

    async def say(self, kind: str, content: dict[str, Any]) -> None:
        for part in ({"msgid": secrets.token_hex(8), "msgtype": kind}, {}, content):
            await self.line.write_message(json.dumps(part))

    async def heard(self, kind: str) -> dict[str, Any]:
        """The content of the next message of this kind."""
        while True:
            header, _, content = [await self._part() for _ in range(3)]
            for _ in range(2 * header.get("num_buffers", 0)):
                await self.line.read_message()
            if header["msgtype"] == kind:
                return content

    async def _part(self) -> dict[str, Any]:
        text = await self.line.read_message()
        if text is None:
            raise ConnectionError("the page was closed")
        return dict(json.loads(text))

    async def numbers(self) -> None:
        """Wait for the next ones."""
        while not any(LAST in str(e.get("new")) for e in (await self.heard("PATCH-DOC"))["events"]):
            pass

    async def move(self) -> float:
        """Move the slider: milliseconds until other numbers are there."""
        self.value = 0.05 if self.value != 0.05 else 0.1
        start = time.perf_counter()
        change = {"kind": "ModelChanged", "model": {"id": self.slider}, "attr": "value", "new": self.value}
        await self.say("PATCH-DOC", {"events": [change]})
        await self.numbers()
        return 1e3 * (time.perf_counter() - start)


def objects(tree: Any) -> Iterator[dict[str, Any]]:
    """All objects of a document."""
    if isinstance(tree, dict):
        yield tree
    for inner in tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ():
        yield from objects(inner)


@contextmanager
def served(store: Path) -> Iterator[tuple[str, psutil.Process]]:
    """The address of a laboratory, and its process."""
    command = [sys.executable, "-m", "gradient_routes", "lab", "--no-browser", "--port", "0", "--store", str(store)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().split()[0].rstrip("/"), psutil.Process(process.pid)
        finally:
            process.send_signal(signal.SIGINT)


async def moves(page: Browsed, count: int, first: float = 0.0) -> list[float]:
    """Milliseconds of each of so many moves, one after the other, at most one in EVERY seconds."""
    found = []
    await asyncio.sleep(first)
    for _ in range(count):
        begun = time.perf_counter()
        found.append(await page.move())
        await asyncio.sleep(max(0.0, EVERY - (time.perf_counter() - begun)))
    return found


async def latencies(url: str, server: psutil.Process) -> tuple[list[float], list[float], tuple[float, float]]:
    """Of one page alone, of all pages together; seconds of CPU that the server, and its processes, took for these."""
    page = await Browsed.opened(url)
    alone = [await page.move() for _ in range(2 * MOVES)][MOVES:]
    pages = [page, *[await Browsed.opened(url) for _ in range(PAGES - 1)]]
    processes = [server, *server.children(recursive=True)]
    before = [cpu(process) for process in processes]
    crowded = await asyncio.gather(*(moves(page, MOVES, k * EVERY / PAGES) for k, page in enumerate(pages)))
    taken = [cpu(process) - then for process, then in zip(processes, before, strict=True)]
    return alone, [ms for of in crowded for ms in of], (taken[0], sum(taken[1:]))


def cpu(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)


def main() -> None:
    out = console()
    with tempfile.TemporaryDirectory() as folder:
        fill(Store(Path(folder) / "routes.sqlite"), 1000)
        with served(Path(folder) / "routes.sqlite") as (url, server):
            alone, crowded, taken = asyncio.run(latencies(url, server))
            out.print(f"a slider's numbers, one page: {said(alone)} (<= {ALLOWED_MS:g} ms)")
            out.print(f"{PAGES} pages, a move a second each: {said(crowded)} (95 % <= {CROWDED_MS:g} ms)")
            served_ms, computed_ms = (1e3 * seconds / len(crowded) for seconds in taken)
            out.print(f"CPU for a move: {served_ms:.0f} ms of the server, {computed_ms:.0f} ms of its processes")


def said(ms: list[float]) -> str:
    return f"median {median(ms):.0f} ms, 95 % within {quantiles(ms, n=20)[-1]:.0f} ms"


if __name__ == "__main__":
    main()
