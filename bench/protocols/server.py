"""Models offered over UM-Bridge (protocol 1.0): https://um-bridge-benchmarks.readthedocs.io, lengths and indices
checked before a model is called.
"""

from __future__ import annotations

import json
import socket
import sys
import threading
from collections.abc import Callable, Mapping
from http.server import BaseHTTPRequestHandler
from socketserver import ThreadingTCPServer
from typing import Any

import numpy as np

from gradient_routes.bench.protocols.served import Served
from gradient_routes.bench.protocols.umbridge import VERSION
from gradient_routes.bench.verification.guarded import FOREIGN, one_line
from gradient_routes.problems.errors import DomainError, InputError, RoutesError
from gradient_routes.problems.problem import Array, Parameters

LONGEST = 2**28  # bytes of a request: 10^7 parameters
FEATURES = {"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False}


class Refused(Exception):
    """What is wrong with a request, by UM-Bridge's type of error."""

    def __init__(self, kind: str, message: str, status: int = 400) -> None:
        super().__init__(message)
        self.kind, self.status = kind, status


class Offered:
    """The answers to requests; models are called one at a time.

    Beside the sizes that the protocol has, ModelInfo tells the start of p and the names of its components.
    """

    def __init__(self, models: Mapping[str, Served], parameters: Parameters, who: str) -> None:
        self.models, self.parameters, self.who = models, parameters, who
        self.answered, self._one = 0, threading.Lock()

    def answer(self, endpoint: str, asked: Any) -> dict[str, Any]:
        """Raises Refused."""
        if endpoint == "Info":
            return {"protocolVersion": VERSION, "models": [*self.models]}
        if endpoint not in ANSWERS:
            raise Refused("NotFound", f"no endpoint '{endpoint}' - there are Info, {', '.join(ANSWERS)}", 404)
        if not isinstance(asked, dict):
            raise Refused("InvalidInput", "the request is no JSON object")
        name = asked.get("name")
        if not isinstance(name, str) or name not in self.models:
            raise Refused("ModelNotFound", f"no model {name} - there are {', '.join(self.models)}")
        if asked.get("config"):
            raise Refused("InvalidInput", f"{name} has no config - options are those of --problem")
        return ANSWERS[endpoint](self, self.models[name], asked)

    def info(self, model: Served, asked: dict[str, Any]) -> dict[str, Any]:
        parameters = self.parameters
        names = [parameters.label(i) for i in range(len(parameters))]
        return {"support": FEATURES, "start": parameters.start.tolist(), "names": names}

    def input_sizes(self, model: Served, asked: dict[str, Any]) -> dict[str, Any]:
        return {"inputSizes": [len(self.parameters)]}

    def output_sizes(self, model: Served, asked: dict[str, Any]) -> dict[str, Any]:
        return {"outputSizes": [model.m]}

    def evaluate(self, model: Served, asked: dict[str, Any]) -> dict[str, Any]:
        p = self._p(asked)
        return {"output": [self._called(lambda: model.value(p))]}

    def gradient(self, model: Served, asked: dict[str, Any]) -> dict[str, Any]:
        p, w = self._p(asked), self._vector(asked, "sens", model.m)
        return {"output": self._called(lambda: model.pullback(p, w))}

    def apply_jacobian(self, model: Served, asked: dict[str, Any]) -> dict[str, Any]:
        p, v = self._p(asked), self._vector(asked, "vec", len(self.parameters))
        return {"output": self._called(lambda: model.pushforward(p, v))}

    def _p(self, asked: dict[str, Any]) -> Array:
        blocks = asked.get("input")
        if not isinstance(blocks, list) or len(blocks) != 1:
            raise Refused("InvalidInput", "input is not a list of one list: there is one block of parameters")
        p = _numbers(blocks[0], len(self.parameters), "input 0")
        try:
            return self.parameters.check(p, self.who)
        except DomainError as failure:
            raise Refused("DomainError", str(failure)) from None

    def _vector(self, asked: dict[str, Any], name: str, length: int) -> Array:
        """`sens` or `vec`, of the only output and the only input."""
        for index in ("outWrt", "inWrt"):
            if asked.get(index) != 0 or isinstance(asked[index], bool):
                raise Refused("InvalidInput", f"{index} is {asked.get(index)} - there is one block, 0")
        return _numbers(asked.get(name), length, name)

    def _called(self, call: Callable[[], Array]) -> list[float]:
        with self._one:
            self.answered += 1
            try:
                found = np.asarray(call(), np.float64)
            except (InputError, DomainError) as failure:
                raise Refused(type(failure).__name__, str(failure)) from failure
            except MemoryError as failure:
                raise Refused("MemoryError", f"{self.who}: {failure or 'out of memory'}", 500) from failure
            except RoutesError as failure:
                raise Refused(type(failure).__name__, str(failure), 500) from failure
            except FOREIGN as failure:
                raise Refused(type(failure).__name__, f"{self.who}: {one_line(failure)}", 500) from failure
        if not np.isfinite(found).all():
            raise Refused("NoValue", f"{self.who}: the result is not finite", 500)
        numbers: list[float] = found.tolist()
        return numbers


ANSWERS: dict[str, Callable[[Offered, Served, dict[str, Any]], dict[str, Any]]] = {
    "ModelInfo": Offered.info,
    "InputSizes": Offered.input_sizes,
    "OutputSizes": Offered.output_sizes,
    "Evaluate": Offered.evaluate,
    "Gradient": Offered.gradient,
    "ApplyJacobian": Offered.apply_jacobian,
}


def _numbers(values: Any, length: int, what: str) -> Array:
    if not isinstance(values, list) or len(values) != length:
        given = f"a list of {len(values)}" if isinstance(values, list) else type(values).__name__
        raise Refused("InvalidInput", f"{what} is {given}, not a list of {length} numbers")
    if not all(isinstance(x, int | float) and not isinstance(x, bool) for x in values):
        raise Refused("InvalidInput", f"{what} holds something else than numbers")
    try:
        array = np.array(values, np.float64)
    except OverflowError:
        array = np.array([np.inf])
    if not np.isfinite(array).all():
        raise Refused("InvalidInput", f"{what} is not finite")
    return array


class Server(ThreadingTCPServer):
    """At `host` and `port`, 0 for any that is free; a thread for each connection. Raises InputError where it cannot."""

    allow_reuse_address = True
    daemon_threads = True

    def __init__(self, host: str, port: int, offered: Offered) -> None:
        self.offered = offered
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            super().__init__((host, port), Handler)
        except OSError as error:
            said = error.strerror or str(error)
            raise InputError(f"serve: {host}:{port}: {said} - give another --port or --host") from None

    @property
    def url(self) -> str:
        host, port = self.server_address[:2]
        return f"http://[{host!s}]:{port}" if ":" in str(host) else f"http://{host!s}:{port}"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A client that leaves is no error."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class Handler(BaseHTTPRequestHandler):
    """JSON in and out; every error has UM-Bridge's form."""

    server: Server
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True  # an answer is sent in two pieces

    def do_GET(self) -> None:
        self._answer(None)

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > LONGEST:
            self.close_connection = True  # what follows is not read
            self._say(
                413, {"error": {"type": "InvalidInput", "message": f"give a Content-Length of at most {LONGEST} bytes"}}
            )
            return
        try:
            self._answer(json.loads(self.rfile.read(int(length))))
        except (ValueError, RecursionError):
            self._say(400, {"error": {"type": "InvalidInput", "message": "the request is no JSON"}})

    def _answer(self, asked: Any) -> None:
        try:
            answer = self.server.offered.answer(self.path.strip("/"), asked)
        except Refused as refused:
            self._say(refused.status, {"error": {"type": refused.kind, "message": str(refused)}})
        else:
            self._say(200, answer)

    def _say(self, status: int, message: dict[str, Any]) -> None:
        body = json.dumps(message).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """No line a request."""
