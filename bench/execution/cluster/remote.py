"""Functions that run on a Dask worker: its versions, and a case from start to end."""

from __future__ import annotations

import os
import pickle
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from threading import Event, Thread
from typing import Any

from distributed import Worker, get_worker
from distributed.core import Status

from gradient_routes.bench.cases.environment import Environment, environment
from gradient_routes.bench.cases.outcome import Record
from gradient_routes.bench.cases.status import Status as CaseStatus
from gradient_routes.bench.execution.cluster.shipped_case import ShippedCase
from gradient_routes.bench.execution.executors.isolated import Isolated
from gradient_routes.bench.execution.executors.running import alone
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.units import now

TICK = 0.2  # [s] between two checks that the case is still wanted
ENDING = (Status.closing, Status.closing_gracefully, Status.closed, Status.failed)


@dataclass(frozen=True)
class Greeting:
    """The process of a worker, its host and the versions of its libraries."""

    hostname: str
    pid: int
    environment: Environment


def greeting() -> Greeting:
    """The Greeting of this process."""
    return Greeting(socket.gethostname(), os.getpid(), environment())


def packed(case: ShippedCase, limits: Limits, cwd: str) -> bytes:
    """The argument of carry, as bytes: Dask inspects all other types."""
    return pickle.dumps((case, limits, cwd))


def carry(parcel: bytes, pid: int) -> bytes | None:
    """Run a case in its own process. Returns its outcome and the references it found, pickled.

    None if this process is not `pid`: the worker was lost, and another one has its address.
    """
    if os.getpid() != pid:
        return None
    case, limits, cwd = pickle.loads(parcel)
    os.environ.pop("MALLOC_TRIM_THRESHOLD_", None)  # a nanny's, for its worker: it would slow down what cases allocate
    case = replace(case, asked=case.asked | {"host": socket.gethostname(), "started": now()})
    if not os.path.isdir(cwd):
        what = f"no folder {cwd} on {case.asked['host']} - start from one that all hosts have, or make it there"
        outcome = Record(case.asked).ended(CaseStatus.FAILED, f"{case.name}: {what}")
        return pickle.dumps((outcome, case.found))
    under_way = Isolated(case, limits, cwd)
    with while_wanted(under_way):
        outcome = under_way.prepared() or alone(under_way)
    return pickle.dumps((outcome, case.found))


@contextmanager
def while_wanted(case: Isolated) -> Iterator[None]:
    """End the process of the case with the block, or once the scheduler no longer waits for it."""
    worker, over = get_worker(), Event()
    key = worker.get_current_task()

    def watch() -> None:
        while not over.wait(TICK):
            if not wanted(worker, key):
                case.kill()
                return

    watching = Thread(target=watch, daemon=True)
    watching.start()
    try:
        yield
    finally:
        over.set()
        watching.join()
        case.close()


def wanted(worker: Worker, key: Any) -> bool:
    """Whether the scheduler still waits for the task and the worker can return it."""
    task = worker.state.tasks.get(key)
    return task is not None and task.state == "executing" and worker.status not in ENDING
