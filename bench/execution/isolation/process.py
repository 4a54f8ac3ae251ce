"""A process in its own process group: watched, and killed with its descendants when it exceeds a limit."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import IO, Any

import psutil

from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation import descendants
from gradient_routes.bench.execution.isolation.limits import KERNELS, Limits
from gradient_routes.bench.execution.isolation.messages import Ended
from gradient_routes.bench.execution.isolation.stack import ASKED, without
from gradient_routes.bench.sanitize import pass_on
from gradient_routes.bench.units import size

TICK = 0.1  # [s] between two checks of its memory
GRACE = 5.0  # [s] for a process to exit after it has closed its connection
KEPT = 20_000  # bytes of stderr that are kept
LAST = 60  # lines of them that are reported
STACK = None if ASKED is None else (ASKED, 0.2)  # the signal that asks for its stack, and seconds to write it
EXHAUSTED = (
    *("bad_alloc", "MemoryError", "RESOURCE_EXHAUSTED", "Cannot allocate memory", "Out of memory"),
    "Memory allocation still failed",  # OpenBLAS
)


class Killed(Exception):
    """The process was killed at a limit: `status` is timeout or out-of-memory, `reason` has the numbers."""

    def __init__(self, status: Status, reason: str) -> None:
        super().__init__(reason)
        self.status, self.reason = status, reason


class Confined:
    """`python -P -m MODULE ARGUMENTS` under limits.

    watch(until, deadline) waits; kill() ends it and its descendants; `stderr` holds its last lines. `last_words` is a
    signal that is sent at the deadline, and the seconds until the process is killed. Where there is no /proc, a daemon,
    which has left the process group and has lost its parent, is not reached.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str],
        limits: Limits,
        *,
        talkative: bool = False,
        last_words: tuple[int, float] | None = STACK,
        **popen: Any,
    ) -> None:
        self.limits = limits
        self._oom_kills = _oom_kills()
        self._mark = descendants.new_mark()
        self._killing, self._killed = threading.RLock(), False
        self._talkative, self._stderr, self._last_words = talkative, bytearray(), last_words
        ours = {name: value for name, value in os.environ.items() if name not in KERNELS}
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", module, *arguments],
            env={**ours, **limits.environment, descendants.MARK: self._mark},
            stderr=subprocess.PIPE,
            start_new_session=True,
            **popen,
        )
        self._pump = threading.Thread(target=self._listen, args=(self.process.stderr,), daemon=True)
        self._pump.start()

    def watch(self, until: Callable[[float], bool], deadline: float) -> None:
        """Return once `until(seconds)` is true. Raises Killed after the process was killed at a limit.

        until     waits for at most `seconds`
        deadline  on the clock time.monotonic
        """
        while not until(max(0.0, min(TICK, deadline - time.monotonic()))):
            taken = self._memory() if self.limits.memory is not None else 0
            if self.limits.memory is not None and taken > self.limits.memory:
                self.kill()
                raise Killed(Status.OUT_OF_MEMORY, f"{size(taken)} > {size(self.limits.memory)} of --memory")
            if time.monotonic() >= deadline:
                self._hear_out()
                self.kill()
                raise Killed(Status.TIMEOUT, f"after {self.limits.timeout:g} s of --timeout")

    def _hear_out(self) -> None:
        if self._last_words is not None:
            number, seconds = self._last_words
            with suppress(OSError):
                self.process.send_signal(number)
            self.ended(seconds)

    def ended(self, seconds: float) -> bool:
        """Whether it ends within so many seconds."""
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            return False
        return True

    @property
    def gone(self) -> bool:
        """Whether it has ended."""
        return self.process.poll() is not None

    def kill(self) -> None:
        """Send SIGKILL to the group and to all descendants; once, since the system may reuse its number."""
        with self._killing:
            if self._killed:
                return
            strays = descendants.of(self.process.pid)
            with suppress(OSError):
                if os.name == "posix":
                    os.killpg(self.process.pid, signal.SIGKILL)
                else:
                    self.process.kill()
            for stray in strays:
                with suppress(psutil.Error):
                    stray.kill()
            self.process.wait()
            descendants.kill_marked(self._mark)
            self._killed = True
        self._pump.join(1.0)

    def ending(self) -> Ended:
        """How a process ended that sent no Ended: its exit code or signal as a status and a reason."""
        ended = self.ended(GRACE)
        self.kill()  # what it started may still run
        if not ended:
            return Ended(Status.CRASHED, f"it closed its connection and was still running {GRACE:g} s later")
        code = self.process.wait()
        if any(word in self._last_line() for word in EXHAUSTED) and code != -signal.SIGSEGV:
            cap = "" if self.limits.memory is None else f" of {size(self.limits.memory)}"
            return Ended(Status.OUT_OF_MEMORY, f"an allocation failed within --memory{cap}: {self._last_line()}")
        if code >= 0:
            return Ended(Status.CRASHED, f"its process ended with exit code {code}")
        name = signal.Signals(-code).name if -code in {*signal.Signals} else f"signal {-code}"
        if -code == signal.SIGKILL and _oom_kills() > self._oom_kills:
            return Ended(Status.OUT_OF_MEMORY, "killed by the system, which ran out of memory")
        return Ended(Status.CRASHED, f"its process was ended by {name}")

    @property
    def stderr(self) -> str:
        """The last lines written so far."""
        return "\n".join(bytes(self._stderr).decode(errors="backslashreplace").splitlines()[-LAST:])

    def _last_line(self) -> str:
        return next((line.strip() for line in reversed(without(self.stderr).splitlines()) if line.strip()), "")

    def _listen(self, stream: IO[bytes]) -> None:
        with suppress(OSError, ValueError), stream:
            while piece := os.read(stream.fileno(), 65536):
                self._stderr = (self._stderr + piece)[-KEPT:]
                if self._talkative:
                    with suppress(OSError, ValueError):  # stderr is closed here: go on reading, or the process blocks
                        pass_on(piece)

    def _memory(self) -> int:
        """Resident bytes of the process and its descendants."""
        total = 0
        for process in (psutil.Process(self.process.pid), *descendants.of(self.process.pid)):
            with suppress(psutil.Error):
                total += process.memory_info().rss
        return total


def _oom_kills() -> int:
    """Processes that the system has killed for memory since it started; 0 where it does not count them."""
    try:
        with open("/proc/vmstat") as file:
            return next(int(line.split()[1]) for line in file if line.startswith("oom_kill "))
    except (OSError, StopIteration):
        return 0
