"""An adapter at work: its process, and the errors that it and its end become."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import weakref
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from gradient_routes.problems.errors import (
    Crashed,
    DomainError,
    NotConverged,
    RoutesError,
    SingularMatrix,
    Unsupported,
)
from gradient_routes.problems.text import shortened
from gradient_routes.routes.foreign.protocol import VERSION, Ended, NoMessage, receive, send

NAME = 80  # characters of a name, a version, a wrong value
GRACE_S = 5.0  # for an adapter to end by itself
FORCED = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE", "XLA_FLAGS")  # of our process, to which a peer is not bound
THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NPROC")


class AdapterError(RoutesError):
    """An adapter has not answered as the protocol has it, or with an error of its own."""


def environment(threads: int | None = None) -> dict[str, str]:
    """Of an adapter's process: ours, with `threads` or one thread unless told otherwise, without our own Python."""
    ours = {name: value for name, value in os.environ.items() if name not in FORCED and not name.startswith("PYTHON")}
    said = {name: str(threads or 1) for name in THREADS if threads is not None or name not in ours}
    return ours | said


class Peer:
    """A started adapter that speaks the protocol. `who` is named in errors; its process ends with this object.

    Raises AdapterError where it cannot be started, is of another version, or does not answer as the protocol has it,
    Crashed where it ends.
    """

    def __init__(self, command: Sequence[str], who: str, variables: Mapping[str, str] | None = None) -> None:
        self.who, self._numbers = who, itertools.count(1)
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=variables or environment()
            )
        except OSError as error:
            raise AdapterError(f"{who}: {command[0]} cannot be started: {error.strerror} - check the command") from None
        self._finalize = weakref.finalize(self, _end, self._process)
        self.about = self.ask("describe")
        if self.about.get("protocol") != VERSION:
            raise AdapterError(
                f"{who}: speaks version {self.about.get('protocol')} of the protocol, this is version {VERSION}"
                " - renew the adapter"
            )

    @property
    def name(self) -> str:
        """As it calls itself; empty where it does not."""
        return shortened(str(self.about.get("name", "")), NAME)

    @property
    def versions(self) -> dict[str, str]:
        """Of what it runs on."""
        given = self.about.get("versions")
        return {str(name): shortened(str(of), NAME) for name, of in given.items()} if isinstance(given, dict) else {}

    def ask(self, method: str, **arguments: Any) -> dict[str, Any]:
        """The result. Raises the error that the adapter answers with, AdapterError for no proper answer."""
        number = next(self._numbers)
        try:
            send(self._in, {"id": number, "method": method, **arguments})
            answer = receive(self._out)
        except (BrokenPipeError, Ended):
            raise Crashed(f"{self.who}: {self._last_words()} in {method}() - see its output") from None
        except NoMessage as odd:
            raise AdapterError(f"{self.who}: {method}(): {odd} - stdout is for messages alone") from None
        if "error" in answer:
            raise _error(f"{self.who}: {method}()", answer["error"])
        result = answer.get("result")
        if answer.get("id") != number or not isinstance(result, dict):
            raise AdapterError(f"{self.who}: {method}(): no result with id {number} - mend the adapter")
        return result

    def close(self) -> None:
        """Says bye."""
        with suppress(RoutesError):
            self.ask("bye")
        self._finalize()

    @property
    def _in(self) -> Any:
        return self._process.stdin

    @property
    def _out(self) -> Any:
        return self._process.stdout

    def _last_words(self) -> str:
        try:
            code = self._process.wait(GRACE_S)
        except subprocess.TimeoutExpired:
            return "has closed its output"
        name = signal.Signals(-code).name if -code in {*signal.Signals} else -code
        return f"was ended by signal {name}" if code < 0 else f"ended with exit code {code}"


def _end(process: subprocess.Popen[bytes]) -> None:
    for stream in (process.stdin, process.stdout):
        with suppress(OSError):
            if stream is not None:
                stream.close()
    try:
        process.wait(GRACE_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def shown(value: Any) -> str:
    """What an adapter gave in place of something else."""
    return f"an array of {value.dtype}" if isinstance(value, np.ndarray) else shortened(repr(value), NAME)


def _error(who: str, error: Any) -> Exception:
    kind = error.get("kind") if isinstance(error, dict) else None
    said = shortened(" ".join(str(error.get("message", "no message") if isinstance(error, dict) else error).split()))
    message = f"{who}: {said}"
    if kind == "not-converged":
        return NotConverged(message, ())
    if kind == "memory":
        return MemoryError(message)
    known: dict[Any, type[RoutesError]] = {
        "singular": SingularMatrix,
        "domain": DomainError,
        "unsupported": Unsupported,
    }
    return known.get(kind, AdapterError)(message)
