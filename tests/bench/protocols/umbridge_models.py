"""A server of UM-Bridge in the standard library, whose models do what models do: right, wrong, odd and failing."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import numpy as np

SIZES = {"InputSizes": {"inputSizes": [3, 2]}, "OutputSizes": {"outputSizes": [2, 1]}}
ODD = {  # what a model answers to Evaluate: status, body
    "null": (200, b'{"output": [[null, 1.0], [1.0]]}'),
    "nan": (200, b'{"output": [[1.0, -nan], [inf]]}'),
    "none": (200, b'{"output": null}'),
    "short": (200, b'{"output": [[1.0], [1.0]]}'),
    "text": (200, b'{"output": [["one", 1.0], [1.0]]}'),
    "crash": (500, b"Internal Server Error"),
    "raises": (500, b'{"error": {"type": "ValueError", "message": "the mesh is\\n tangled"}}'),
    "no-json": (200, b"<html>"),
}
NO_VALUE = {
    "null": "output 1, component 1 is null",
    "nan": "output 1, component 2 is nan",
    "none": "Evaluate is NoneType, not 2 lists: mend the model",
    "short": "output 1 is a list of 1, not a list of 2 numbers: mend the model",
    "text": "output 1 is a list of 2, not numbers: mend the model",
    "crash": "Evaluate: Internal Server Error (HTTP 500)",
    "raises": "Evaluate: the mesh is tangled (HTTP 500)",
    "no-json": "Evaluate: <html>",
}


def F(x: Any) -> Any:
    return np.array([np.sin(x).sum(), x[0] * x[3], x @ x])


def F_p(x: Any) -> Any:
    return np.array([np.cos(x), [x[3], 0.0, 0.0, x[0], 0.0], 2.0 * x])


def answer(endpoint: str, asked: dict[str, Any]) -> tuple[int, bytes]:
    if endpoint == "next/Info":
        return 200, b'{"protocolVersion": 2.0, "models": ["right"]}'
    if endpoint == "Info":
        return 200, json.dumps(
            {"protocolVersion": 1.0, "models": ["right", "sign", "product", "forward", "values", *ODD]}
        ).encode()
    if "name" not in asked:
        return 404, b"404: Not Found"
    name = asked["name"]
    if endpoint in SIZES:
        assert asked["config"] in ({}, {"level": 2})
        return 200, json.dumps(SIZES[endpoint]).encode()
    if endpoint == "ModelInfo":
        support = {"Evaluate": True, "Gradient": name not in ("values", "forward"), "ApplyJacobian": name != "values"}
        return 200, json.dumps({"support": support}).encode()
    if endpoint == "Evaluate" and name in ODD:
        return ODD[name]
    x = np.concatenate(asked["input"])
    if endpoint == "Evaluate":
        return 200, json.dumps({"output": [F(x)[:2].tolist(), F(x)[2:].tolist()]}).encode()
    rows, columns = slice(2 * asked["outWrt"], 2 + asked["outWrt"]), slice(3 * asked["inWrt"], 3 + 2 * asked["inWrt"])
    A = F_p(x)
    if endpoint == "ApplyJacobian":
        A[:, 1] *= -1.0 if name == "product" else 1.0
        return 200, json.dumps({"output": (A[rows, columns] @ asked["vec"]).tolist()}).encode()
    A[:, 1] *= -1.0 if name == "sign" else 1.0
    return 200, json.dumps({"output": (A[rows, columns].T @ asked["sens"]).tolist()}).encode()


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        self._answer({})

    def do_POST(self) -> None:
        self._answer(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))

    def _answer(self, asked: dict[str, Any]) -> None:
        status, body = answer(self.path.removeprefix("/"), asked)
        self.send_response(status)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Nothing: stderr is looked at."""


@contextmanager
def serving() -> Iterator[str]:
    """The URL of a server in a thread of this process."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
