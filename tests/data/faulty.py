"""Problems, routes and models whose code does what none should: what tests of isolation run."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from problems.problem import Array, Offers, Parameters, Problem
from routes.model import Model as Solved
from routes.route import Result, Work, route

C = ctypes.CDLL(None)
C.malloc.restype = ctypes.c_void_p
SLEEPS = "import time; time.sleep(987)"
TAKES = "import sys\nheld = []\nwhile True: held.append(bytearray(b'x' * 10**7))"


class Faulty(Problem):
    """J = |p|^2 / 2; call number `when` of it does something else first, or building where that is 0."""

    name = "faulty"
    offers = Offers.VALUE

    def __init__(self, *, n: int = 2, does: str = "nothing", when: int = 1) -> None:
        self.does, self.when, self.calls = does, when, 0
        self.parameters = Parameters(start=np.ones(n), scale=np.ones(n))
        if when == 0:
            MISDEEDS[does]()

    def value(self, p: Array) -> float:
        self.calls += 1
        if self.calls == self.when:
            MISDEEDS[self.does]()
        return float("nan") if self.does == "nan" else 0.5 * float(p @ p)

    def reference(self, p: Array):
        from problems.problem import Reference

        return Reference("closed form", p.copy(), 1.0)


@route("itself", needs=Offers.VALUE, cost=lambda n_p, forward, **options: Work())
def itself(model: Solved, p: Array) -> Result:
    """The gradient p."""
    return Result(0.5 * float(p @ p), p.copy())


@route("wrong-then-hangs", needs=Offers.VALUE, cost=lambda n_p, forward, **options: Work())
def wrong_then_hangs(model: Solved, p: Array) -> Result:
    """Twice the gradient, and no end where it is called again."""
    if os.environ.get("CALLED"):
        hang()
    os.environ["CALLED"] = "1"
    return Result(None, 2.0 * p)


class Hanging:
    """For `routes check`."""

    start = np.ones(2)

    def objective(self, p: Array) -> float:
        return sleeping()

    def gradient(self, p: Array) -> Array:
        return p


class Leaving(Hanging):
    """Ends the process as if all were well."""

    def objective(self, p: Array) -> float:
        os._exit(0)


def sleeping() -> None:
    """Waits for a child that does not end."""
    subprocess.Popen([sys.executable, "-c", SLEEPS]).wait()


def hang() -> None:
    """In C, the lock of the interpreter held: no signal handler runs."""
    ctypes.PyDLL(None).sleep(987)


def spin() -> None:
    while True:
        pass


def stubborn() -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    spin()


def escaping() -> None:
    """Its child leaves the process group."""
    subprocess.Popen([sys.executable, "-c", SLEEPS], start_new_session=True).wait()


def leaving_children() -> None:
    """Goes on while they run."""
    subprocess.Popen([sys.executable, "-c", SLEEPS])
    if os.fork() == 0:
        time.sleep(987)


def take() -> None:
    held = []
    while True:
        held.append(np.ones(10**6))


def take_by_jax() -> None:
    import jax.numpy as jnp

    jnp.ones(10**11).block_until_ready()


def take_in_c() -> None:
    """As C++ does: an allocation that fails ends it, the address 0 being written to."""
    while True:
        ctypes.memset(C.malloc(ctypes.c_size_t(10**6)) or 0, 1, 10**6)


def take_by_child() -> None:
    subprocess.run([sys.executable, "-c", TAKES], preexec_fn=uncapped, check=False)


def uncapped() -> None:
    """Nothing that a process does to itself may lift the cap."""


def garbage() -> None:
    """By C, whose own buffer is written when it is full or at the end, by the system and by Python."""
    C.printf(b"garbage of C\n")
    os.write(1, b"\x00\xff garbage of the system\n")
    print("garbage of Python")
    sys.stderr.write("\x1b[31mred")


def flood() -> None:
    for _ in range(100):
        os.write(2, b"x" * 10**6)
    os.write(2, b"\nthe end\n")


def closing() -> None:
    """All it has open, its line to the runner, too."""
    os.closerange(3, 256)


def closing_and_hanging() -> None:
    closing()
    hang()


def scribbling() -> None:
    """Into all it has open, the line to the runner among them: the head of a message that never comes."""
    for descriptor in range(3, 64):
        try:
            os.write(descriptor, b"\x00\xff\xff\xff")
        except OSError:
            continue
    hang()


MISDEEDS: dict[str, Callable[[], object]] = {
    "nothing": lambda: None,
    "nan": lambda: None,
    "raise": lambda: 1 / 0,
    "exit": lambda: os._exit(3),
    "leave": lambda: os._exit(0),
    "quit": lambda: sys.exit(4),
    "segfault": lambda: ctypes.string_at(0),
    "abort": os.abort,
    "kill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "memory": lambda: np.ones(10**12),
    "sleep": sleeping,
    **{
        f.__name__: f
        for f in (
            *(hang, spin, stubborn, escaping, leaving_children),
            *(take, take_by_jax, take_in_c, take_by_child),
            *(garbage, flood, closing, closing_and_hanging, scribbling),
        )
    },
}
