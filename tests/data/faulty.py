"""Problems, routes and objects for `routes check` whose code does what none should: what tests of isolation run."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np

from gradient_routes.problems.problem import Array, Offers, Parameters, Problem, Reference
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Result, Work, route

C = ctypes.CDLL(None)
C.malloc.restype = ctypes.c_void_p
SLEEPS = [sys.executable, "-c", "import time; time.sleep(987)"]
HOARD = """import time
held = []
try:
    while True:
        held.append(bytearray(b"x" * 10**6))
except MemoryError:
    time.sleep(987)  # within its own cap, not within that of the group
"""
TAKES = [sys.executable, "-c", HOARD]
MEGABYTE = 10**6
REACHED = "ROUTES_TEST_REACHED"  # names a folder for what has been reached


class Faulty(Problem):
    """J = |p|^2 / 2; call number `when` of it does something else first, its building where that is 0.

    taken      megabytes of p's at n = 1, all the more at n
    reference  p, or half of it
    """

    name = "faulty"
    offers = Offers.VALUE

    def __init__(
        self, *, n: int = 2, does: str = "nothing", when: int = 1, taken: float = 0.0, halved: bool = False
    ) -> None:
        self.does, self.when, self.taken, self.halved, self.calls = does, when, taken, halved, 0
        self.parameters = Parameters(start=np.ones(n), scale=np.ones(n))
        if when == 0:
            MISDEEDS[does]()

    def value(self, p: Array) -> float:
        self.calls += 1
        if self.calls == self.when:
            if self.does != "nothing":
                reached()
            MISDEEDS[self.does]()
        _ = np.empty(int(len(p) * self.taken * MEGABYTE / 8))
        return float("nan") if self.does == "nan" else 0.5 * float(p @ p)

    def reference(self, p: Array) -> Reference:
        return Reference("p", 0.5 * p if self.halved else p.copy(), 1.0)


@route("itself", needs=Offers.VALUE, cost=lambda n_p, forward, **options: Work())
def itself(model: Model, p: Array) -> Result:
    """p."""
    return Result(0.5 * float(p @ p), p.copy())


@route("never-timed", needs=Offers.VALUE, cost=lambda n_p, forward, **options: Work())
def never_timed(model: Model, p: Array) -> Result:
    """p, twice; the third call ends the process."""
    model.calls = vars(model).get("calls", 0) + 1
    if model.calls > 2:
        os._exit(3)
    return itself.function(model, p)


class Sound:
    """For `routes check`."""

    start = np.ones(2)
    does = "nothing"

    def objective(self, p: Array) -> float:
        MISDEEDS[self.does]()
        return 0.5 * float(p @ p)

    def gradient(self, p: Array) -> Array:
        return p


class Sleeping(Sound):
    does = "sleep"


class Stubborn(Sound):
    does = "stubborn"


class Leaving(Sound):
    does = "leave"


class Chatty(Sound):
    does = "garbage"


def reached() -> None:
    """A file that says that this process is now at its misdeed."""
    if REACHED in os.environ:
        open(os.path.join(os.environ[REACHED], str(os.getpid())), "w").close()


def sleep() -> None:
    """Waits for a child that does not end."""
    subprocess.Popen(SLEEPS).wait()


def hang() -> None:
    """In C, the lock of the interpreter held: no signal handler runs."""
    ctypes.PyDLL(None).sleep(987)


def stubborn() -> None:
    """Neither an interrupt nor a request to terminate is heard."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    sleep()


def escape() -> None:
    """The child leaves the process group."""
    subprocess.Popen(SLEEPS, start_new_session=True).wait()


def abandon() -> None:
    """Goes on while its children run, one by exec and one by fork."""
    subprocess.Popen(SLEEPS)
    if os.fork() == 0:
        time.sleep(987)


def orphan() -> None:
    """Dies with all that is open in the hands of a child."""
    if os.fork() == 0:
        time.sleep(987)
    os.abort()


def daemonize() -> None:
    """The child of a child that has ended, in a session of its own: nobody's any more."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            time.sleep(987)
        os._exit(0)
    os.wait()


def take() -> None:
    """What is allocated counts, written to or not; the system takes a second to hand out pages."""
    held = []
    while True:
        held.append(np.empty(MEGABYTE))


def take_by_jax() -> None:
    import jax.numpy as jnp

    jnp.ones(10**11).block_until_ready()


def take_in_c() -> None:
    """Until there is no more; it says so as C programs do."""
    while C.malloc(ctypes.c_size_t(MEGABYTE)):
        pass
    C.perror(b"malloc")
    os.abort()


def take_by_child() -> None:
    subprocess.run(TAKES, check=False)


def factorize() -> None:
    """With next to no memory left, a matrix that is positive definite."""
    from gradient_routes.problems.matrices.sparse import SymmetricPattern
    from gradient_routes.routes.solvers.factorization import Factorizer

    def laplacian(n: int):
        nodes, one, other = np.arange(n**3).reshape(n, n, n), range(n - 1), range(1, n)
        edges = [np.stack([nodes.take(one, axis).ravel(), nodes.take(other, axis).ravel()], 1) for axis in range(3)]
        pattern = SymmetricPattern.of_elements(np.concatenate(edges), n**3)
        return pattern.assemble(np.tile([1.1, -1.0, 1.1], (3 * len(edges[0]), 1)))

    A = laplacian(22)
    Factorizer("pardiso")(laplacian(3), "faulty")  # what it loads is no part of what is left
    with open("/proc/self/status") as file:
        most = next(1024 * int(line.split()[1]) for line in file if line.startswith("VmData")) + 12 * MEGABYTE
    resource.setrlimit(resource.RLIMIT_DATA, (most, most))
    Factorizer("pardiso")(A, "faulty")


def garbage() -> None:
    """By C, whose own buffer is written when it is full or at the end, by the system and by Python."""
    C.printf(b"garbage of C\n")
    os.write(1, b"\x00\xff garbage of the system\n")
    print("garbage of Python")
    sys.stderr.write("\x1b[31mgarbage without an end")


def flood() -> None:
    for _ in range(100):
        os.write(2, b"x" * MEGABYTE)
    os.write(2, b"\nthe end\n")


def close() -> None:
    """All that is open, the line to the runner, too."""
    os.closerange(3, 256)


def hang_up() -> None:
    close()
    hang()


def scribble() -> None:
    """Into all that is open, the line to the runner, too: the head of a long message that never comes."""
    for descriptor in range(3, 64):
        with suppress(OSError):
            os.write(descriptor, b"\x00\xff\xff\xff")
    hang()


def fingers() -> None:
    """Where it may run."""
    print("processors", sorted(os.sched_getaffinity(0)))


def busy(call: Callable[[], object]) -> None:
    """What of the work of a while the busiest thread has done."""

    def spent() -> dict[str, float]:
        ticks = {}
        for thread in os.listdir("/proc/self/task"):
            with open(f"/proc/self/task/{thread}/stat") as file:
                fields = file.read().rpartition(")")[2].split()
            ticks[thread] = float(fields[11]) + float(fields[12])
        return ticks

    call()
    before, start = spent(), time.process_time()
    while time.process_time() < start + 0.3:
        call()
    worked = [ticks - before.get(thread, 0.0) for thread, ticks in spent().items()]
    print("busiest", max(worked) / sum(worked))


def by_blas() -> None:
    A = np.ones((600, 600))
    busy(lambda: A @ A)


def by_xla() -> None:
    import jax
    import jax.numpy as jnp

    A, product = jnp.ones((600, 600)), jax.jit(lambda A: jnp.sin(A @ A).sum())
    busy(lambda: product(A).block_until_ready())


def by_pardiso() -> None:
    import scipy.sparse as sp
    from pymklpardiso import PardisoSolver

    A = sp.csr_array(sp.triu(sp.diags_array([-1.0, 4.0, -1.0], offsets=[-90, 0, 90], shape=(8000, 8000))))
    busy(lambda: PardisoSolver(A, 2, {}))


NAMED = (
    *(
        sleep,
        hang,
        stubborn,
        escape,
        abandon,
        orphan,
        daemonize,
        take,
        take_by_jax,
        take_in_c,
        take_by_child,
        factorize,
    ),
    *(garbage, flood, close, hang_up, scribble, fingers, by_blas, by_xla, by_pardiso),
)
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
    **{function.__name__: function for function in NAMED},
}
