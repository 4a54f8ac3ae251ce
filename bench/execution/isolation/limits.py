"""Limits of a process: wall time, memory, threads, processors."""

from __future__ import annotations

import math
import os
import sys
from dataclasses import dataclass

from gradient_routes.problems.errors import InputError

UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "KIB": 2**10, "MIB": 2**20, "GIB": 2**30}
POOLS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
KERNELS = ("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE")  # set for a machine, not for a case; peers are rid of them, too
LEAST = 64 * 2**20  # [byte] less than an interpreter with NumPy takes


@dataclass(frozen=True)
class Limits:
    """Limits of a process and its descendants.

    timeout   wall time [s]
    memory    resident bytes; None: what the machine has
    threads   of BLAS, PARDISO and XLA each
    affinity  numbers of the processors it may use; None: any
    """

    timeout: float = math.inf
    memory: int | None = None
    threads: int = 1
    affinity: tuple[int, ...] | None = None

    @property
    def environment(self) -> dict[str, str]:
        """Variables that set the number of threads; they are read when the libraries are loaded.

        XLA takes the size of its pool from NPROC, and has a flag to compute in one thread.
        """
        pools = dict.fromkeys((*POOLS, "NPROC"), str(self.threads))
        one = ["--xla_cpu_multi_thread_eigen=false"] if self.threads == 1 else []
        given = [flag for flag in os.environ.get("XLA_FLAGS", "").split() if flag not in one]
        return pools | ({"XLA_FLAGS": " ".join(given + one)} if given + one else {})

    def pin(self) -> None:
        """Limit threads and processors of this process, by variables for libraries that are not loaded yet."""
        os.environ.update(self.environment)
        if "numpy" in sys.modules:
            from threadpoolctl import threadpool_limits

            threadpool_limits(self.threads)
        if self.affinity is not None:
            os.sched_setaffinity(0, self.affinity)


def memory_of(text: str | None) -> int | None:
    """Bytes of `4GiB`, `500MB` or a plain number; None for none. Raises InputError."""
    if text is None or text.lower() == "none":
        return None
    number = text.strip().rstrip("BbIiKkMmGg")
    unit = text.strip()[len(number) :].upper()
    try:
        size = float(number) * UNITS[unit if unit in UNITS else f"{unit}IB"]
    except (ValueError, KeyError):
        size = math.nan
    if not LEAST <= size < 2**60:
        raise InputError(f"--memory {text} - give a size from 64MiB on, 4GiB say, or none")
    return int(size)


def affinity_of(text: str | None) -> tuple[int, ...] | None:
    """Processor numbers of `0,2-3`; None for any. Raises InputError for those this process may not use."""
    if text is None:
        return None
    if not hasattr(os, "sched_setaffinity"):
        raise InputError(f"--affinity {text}: this system binds no process to processors - leave it out")
    usable, chosen = os.sched_getaffinity(0), set()
    for item in text.split(","):
        first, dash, last = item.strip().partition("-")
        if not dash:
            last = first
        if not first.isdecimal() or not last.isdecimal():
            raise InputError(f"--affinity {text}: {item!r} is no processor - write 0 or 0,2-3")
        chosen |= set(range(int(first[:6]), int(last[:6]) + 1)) or {-1}
    if not chosen <= usable:
        raise InputError(f"--affinity {text}: usable are {_listed(usable)} - choose among them")
    return tuple(sorted(chosen))


def _listed(numbers: set[int]) -> str:
    return ",".join(map(str, sorted(numbers)))
