"""The laboratory on a port of this machine: a session per page, their commands in processes apart."""

from __future__ import annotations

import logging
import shutil
import socket
import tempfile
from collections.abc import Callable
from pathlib import Path

import panel as pn
from tornado.ioloop import IOLoop
from tornado.web import RequestHandler

from gradient_routes.bench.command_options import STORE
from gradient_routes.bench.lab.page import overview, page
from gradient_routes.bench.lab.part import Place
from gradient_routes.bench.lab.parts import PARTS, load
from gradient_routes.bench.lab.pool import LONG, QUICK, Pool

LOOPBACK = "127.0.0.1"
UPLOAD = 20 * 2**20  # [byte] of one message of a page, files included
IDLE = 60_000  # [ms] after which the session of a page that was closed ends


class Laboratory:
    """Pools for all sessions, a folder for each, and the server.

    address, port  where it listens
    store          that is looked at
    """

    def __init__(self, port: int, address: str = LOOPBACK, store: Path = STORE) -> None:
        self.port, self.address = port or free_port(address), address
        self.store = store
        self.pools = Pool(QUICK), Pool(LONG)
        self.root = Path(tempfile.mkdtemp(prefix="routes-lab-"))

    @property
    def url(self) -> str:
        return f"http://{self.address}:{self.port}/"

    def session(self, slug: str) -> pn.Template:
        """A new session: one page with its part, as its URL says."""
        folder = Path(tempfile.mkdtemp(dir=self.root))
        query = pn.state.location.query_params if pn.state.location is not None else {}
        part = load(slug)(Place(*self.pools, folder, self.store), {name: str(value) for name, value in query.items()})

        def end(_: object) -> None:
            part.stop()
            shutil.rmtree(folder, ignore_errors=True)

        pn.state.on_session_destroyed(end)
        pn.state.onload(part.start)
        return page(part)

    def _application(self, slug: str) -> Callable[[], pn.Template]:
        return lambda: self.session(slug)  # Panel takes functions and methods only

    def serve(self, ready: Callable[[str], None]) -> None:
        """Serve until it is interrupted; `ready` is called with the address. Raises OSError for a port in use."""
        logging.basicConfig(level=logging.WARNING, format="routes lab: %(name)s: %(message)s")
        first = overview()

        class Overview(RequestHandler):
            def get(self) -> None:
                self.write(first)

        server = pn.serve(
            {slug: self._application(slug) for slug in PARTS},
            title={slug: f"{load(slug).title} - gradient-routes" for slug in PARTS},
            port=self.port,
            address=self.address,
            websocket_origin=[f"{host}:{self.port}" for host in {self.address, "localhost", LOOPBACK}],
            show=False,
            start=False,
            verbose=False,
            extra_patterns=[("/", Overview)],
            websocket_max_message_size=UPLOAD,
            unused_session_lifetime_milliseconds=IDLE,
            check_unused_sessions_milliseconds=IDLE // 4,
        )
        server.start()
        for pool in self.pools:
            pool.warm()
        loop = IOLoop.current()
        loop.add_callback(ready, self.url)
        try:
            loop.start()
        finally:
            server.stop()
            for pool in self.pools:
                pool.close()
            shutil.rmtree(self.root, ignore_errors=True)


def free_port(address: str) -> int:
    """One that nobody listens on now."""
    with socket.create_server((address, 0)) as found:
        return int(found.getsockname()[1])
