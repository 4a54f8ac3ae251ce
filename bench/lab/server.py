"""The laboratory on a port of this machine: a session per page, their commands in processes apart."""

from __future__ import annotations

import asyncio
import logging
import re
import shutil
import signal
import socket
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import cast
from urllib.parse import parse_qsl

import panel as pn
from bokeh.server.server import Server
from panel.reactive import Syncable
from tornado.ioloop import IOLoop
from tornado.web import HTTPError, RequestHandler

from gradient_routes.bench.command_options import STORE
from gradient_routes.bench.lab.page import overview, page
from gradient_routes.bench.lab.parts import PARTS, load
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.lab.pool import LONG, QUICK, Pool

LOOPBACK = "127.0.0.1"
REFUSALS = ("tornado.access", "bokeh.server.views.ws")  # they are told to who asked
SOON = 10  # [ms] for which Panel waits for further moves of a slider, 50 else; a part skips those that it is late for
UPLOAD = 20 * 2**20  # [byte] of one message of a page, files included
IDLE = 60_000  # [ms] after which the session of a page that was closed ends


class Laboratory:
    """Pools for all sessions, a folder for each, and the server.

    address, port  where it listens
    store          that is looked at

    Raises OSError for a port in use.
    """

    def __init__(self, port: int, address: str = LOOPBACK, store: Path = STORE) -> None:
        self.port, self.address = free_port(address, port), address
        self.store = store
        self.pools = Pool(QUICK), Pool(LONG)

    @property
    def url(self) -> str:
        return f"http://{self.address}:{self.port}/"

    def session(self, slug: str) -> pn.Template:
        """A new session: one page with its part, as its URL says."""
        folder = Path(mkdtemp(dir=self.root))
        search = pn.state.location.search if pn.state.location is not None else ""
        query = dict(parse_qsl(search.removeprefix("?"), keep_blank_values=True))  # Panel would read 1.50 as a number
        part = load(slug)(Place(*self.pools, folder, self.store), query)

        def end(_: object) -> None:
            part.stop()
            shutil.rmtree(folder, ignore_errors=True)

        pn.state.on_session_destroyed(end)
        pn.state.onload(part.start)
        return page(part)

    def _application(self, slug: str) -> Callable[[], pn.Template]:
        return lambda: self.session(slug)  # Panel takes functions and methods only

    def serve(self, ready: Callable[[str], None]) -> None:
        """Serve until SIGINT or SIGTERM; `ready` is called with the address. Raises OSError for a port in use, at the
        end KeyboardInterrupt.
        """
        logging.basicConfig(level=logging.WARNING, format="routes lab: %(name)s: %(message)s", force=True)
        for name in REFUSALS:
            logging.getLogger(name).setLevel(logging.CRITICAL)
        with ExitStack() as closing:
            self.root = Path(
                closing.enter_context(TemporaryDirectory(prefix="routes-lab-", ignore_cleanup_errors=True))
            )
            for pool in self.pools:
                closing.callback(pool.close)
            Syncable._debounce = SOON
            server = self._server()
            closing.callback(server.stop)
            loop = IOLoop.current()
            for number in (signal.SIGINT, signal.SIGTERM):
                asyncio.get_event_loop().add_signal_handler(number, loop.stop)
            server.start()
            for pool in self.pools:
                pool.warm()
            loop.add_callback(ready, self.url)
            loop.start()
        raise KeyboardInterrupt

    def _server(self) -> Server:
        """Listening; nothing is served before it is started."""
        hosts = {self.address, "localhost", LOOPBACK}
        server = pn.serve(
            {slug: self._application(slug) for slug in PARTS},
            title={slug: f"{load(slug).title} - gradient-routes" for slug in PARTS},
            port=self.port,
            address=self.address,
            websocket_origin=[f"{host}:{self.port}" for host in hosts],
            show=False,
            start=False,
            verbose=False,
            extra_patterns=[("/", Words, {"text": overview()})],
            websocket_max_message_size=UPLOAD,
            unused_session_lifetime_milliseconds=IDLE,
            check_unused_sessions_milliseconds=IDLE // 4,
        )
        # a name of somebody's that leads to this machine (DNS rebinding); what would import any module by its name
        others = f"(?!(?:{'|'.join(map(re.escape, hosts))})$).*"
        server._tornado.add_handlers(others, [(".*", Refused)])
        server._tornado.add_handlers(".*", [("/components/.*", Refused), (".*/autoload.js", Refused)])
        return cast(Server, server)


class Words(RequestHandler):
    """A page that does not change."""

    def initialize(self, text: str) -> None:
        self.text = text

    def get(self) -> None:
        self.write(self.text)


class Refused(RequestHandler):
    """Nothing is served here, whatever is asked."""

    def prepare(self) -> None:
        raise HTTPError(403)


def free_port(address: str, port: int = 0) -> int:
    """This one, for 0 any, that nobody listens on now. Raises OSError where it is in use."""
    with socket.create_server((address, port)) as found:
        return int(found.getsockname()[1])
