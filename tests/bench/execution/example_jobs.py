"""Jobs that say something and end in some way; workers import them alone, not what tests import."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import dataclass

from gradient_routes.bench.cases.study import Kept, Note
from gradient_routes.bench.execution.isolation.channel import Channel
from gradient_routes.problems.errors import DomainError, InputError, NotConverged, SingularMatrix

ERRORS: dict[str, Exception] = {
    "refused": InputError("n = 3 is odd - choose an even n"),
    "outside": DomainError("E_1 = -1 - choose E > 0"),
    "diverges": NotConverged("Newton stops at 1e-3 - loosen --rtol", (1.0, 1e-3)),
    "singular": SingularMatrix("R_u is singular - fix more"),
    "foreign": ZeroDivisionError("division by zero"),
    "exhausted": MemoryError("1 TB"),
    "XLA": RuntimeError("RESOURCE_EXHAUSTED: 1 TB"),
}


@dataclass(frozen=True)
class Work:
    """Says a row, then does what it is named for."""

    name: str

    def __call__(self, channel: Channel) -> None:
        print("garbage")
        channel.say(Kept("table", {"x": 1}))
        channel.say(Note("half of it"))
        if self.name in ERRORS:
            raise ERRORS[self.name]
        if self.name == "crashes":
            os._exit(3)
        if self.name == "takes":
            _ = b"x" * 10**10
        if self.name == "grows":
            held = []
            while True:
                held.append(b"x" * 10**6)
                time.sleep(1e-4)
        if self.name == "quits":
            sys.exit(4)


@dataclass(frozen=True)
class Endless:
    """Hands over what it has when it is told to end, unless it is deaf."""

    name: str = "endless"
    deaf: bool = False

    def __call__(self, channel: Channel) -> None:
        if self.deaf:
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGALRM})
        try:
            channel.say(Note("begins"))
            while True:
                time.sleep(0.01)
        except KeyboardInterrupt:
            channel.say(Kept("table", {"x": 10**6 * "x"}))
            raise
