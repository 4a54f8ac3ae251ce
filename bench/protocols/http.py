"""Requests in JSON to an HTTP server, over one connection that is kept."""

from __future__ import annotations

import http.client
import json
import re
import socket
import weakref
from typing import Any
from urllib.parse import urlsplit

from gradient_routes.problems.errors import InputError, RoutesError
from gradient_routes.problems.text import shortened

CONNECT_S = 10.0  # to be reached within; an answer may take any time
BARE = re.compile(r"-?\b(nan|inf)\b")  # as Python and C++ print what JSON does not have
AS_READ = {"nan": "NaN", "-nan": "NaN", "inf": "Infinity", "-inf": "-Infinity"}


class NoValue(RoutesError):
    """A model has no value, or no derivative, at this p; the message is the model's own."""


class Server:
    """At `url`; the connection ends with this object. Raises InputError for what is no URL."""

    def __init__(self, url: str) -> None:
        try:
            parts, port = urlsplit(url), urlsplit(url).port
        except ValueError as error:
            raise InputError(f"{url}: {error} - give http://HOST:PORT") from None
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise InputError(f"{url}: is no address of a server - give http://HOST:PORT")
        kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
        self.url, self._folder = url, parts.path.rstrip("/")
        self._http = kind(parts.hostname, port, timeout=CONNECT_S)
        weakref.finalize(self, self._http.close)

    def ask(self, path: str, message: Any = None) -> Any:
        """The answer to a message, by POST, or by GET where there is none. Raises InputError where nobody answers,
        NoValue for an error of the server and for what is no JSON.
        """
        try:
            status, body = self._exchanged(path, message)
        except (OSError, http.client.HTTPException) as failure:
            self._http.close()
            said = getattr(failure, "strerror", None) or str(failure) or type(failure).__name__
            raise InputError(f"{self.url}: no answer to {path}: {said} - is the server running there?") from None
        answer = _read(body)
        error = answer.get("error") if isinstance(answer, dict) else None
        if status == 200 and answer is not None and error is None:
            return answer
        told = error.get("message") if isinstance(error, dict) else error
        text = " ".join(str(told or body.decode(errors="replace") or "no word").split())
        raise NoValue(f"{path}: {shortened(text)}{'' if status == 200 else f' (HTTP {status})'}")

    def _exchanged(self, path: str, message: Any) -> tuple[int, bytes]:
        body = None if message is None else json.dumps(message).encode()
        kept = self._http.sock is not None
        try:
            if not kept:
                self._connect()
            self._http.request(
                "GET" if body is None else "POST",
                f"{self._folder}/{path}",
                body,
                {"Content-Type": "application/json"},
            )
            answer = self._http.getresponse()
            return answer.status, answer.read()
        except (ConnectionError, http.client.BadStatusLine):
            self._http.close()
            if not kept:
                raise
        return self._exchanged(path, message)  # the server had closed the connection that was kept

    def _connect(self) -> None:
        self._http.connect()
        connected: socket.socket = self._http.sock
        connected.settimeout(None)


def _read(body: bytes) -> Any:
    """JSON, also with the nan and inf of servers that print numbers themselves; None for anything else."""
    text = body.decode(errors="replace")
    for each in (text, BARE.sub(lambda found: AS_READ[found[0]], text)):
        try:
            return json.loads(each)
        except (ValueError, RecursionError):
            continue
    return None
