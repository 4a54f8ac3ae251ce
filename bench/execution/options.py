"""Options of the command line: limits, and who runs the cases of a sweep; what does not go together."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal

import click

from gradient_routes.bench.command_options import Command, complain, refuse_given
from gradient_routes.bench.ranges import SECONDS, Whole
from gradient_routes.problems.errors import InputError

if TYPE_CHECKING:
    from gradient_routes.bench.execution.isolation.limits import Limits
    from gradient_routes.bench.execution.sweep import How

    Executing = Callable[[bool, Limits, bool], How]  # isolate, limits, timed

STOPS = "Wall time [s] after which {} is stopped and, {:g} s later, killed with its child processes; inf: none."
ISOLATE = (
    "Run in a separate process, whose stdin is empty; needed for --timeout and --memory. With --no-isolate this process"
    " imports FILE.py:NAME itself: code that ends or hangs ends or hangs the command."
)
KILLS = "Wall time [s] after which {} is killed with its child processes; inf: none."
MEMORY = "Resident memory at which it is killed, as 4GiB or 500MB. [all of the machine]"
THREADS = "Number of threads of each of BLAS, PARDISO and XLA."
AFFINITY = "Processors to run on, as 0 or 0,2-3. [any]"
KINDS = ("local", "dask")
FEW = Whole(1, 4096)
EXECUTOR = "Run on this machine or on a Dask cluster, one case at a time per worker (timed: per host)."
SCHEDULER = "Address of the Dask scheduler, as tls://HOST:8786. [a local cluster]"
TLS = {
    "--tls-ca-file": "Certificate in PEM format of the authority that signs for the cluster at --scheduler.",
    "--tls-cert": "Certificate in PEM format by which that cluster knows you.",
    "--tls-key": "Its key in PEM format. [in the file of --tls-cert]",
}
WORKERS = "Number of workers of a local Dask cluster. [1; with --no-timing one per processor]"
JOBS = "Number of cases that run at the same time; more than 1 needs --no-timing."


def limit_options(what: str, timeout: float, last_words: float = 0.0) -> Callable[[Command], Command]:
    """--isolate, --timeout, --memory, --threads, --affinity; the command gets `isolate` and `limits`.

    What has `last_words` seconds at its limit of time is stopped before it is killed.
    """
    ends = STOPS.format(what, last_words) if last_words else KILLS.format(what)

    def decorate(command: Command) -> Command:
        @wraps(command)
        def with_limits(
            *, isolate: bool, timeout: float, memory: str | None, threads: int, affinity: str | None, **others: Any
        ) -> Any:
            from gradient_routes.bench.execution.isolation import limits as given

            if not isolate:
                refuse_given(("timeout", "memory"), "holds for processes of their own, not with --no-isolate")
            if isolate and os.name != "posix":
                raise InputError("--isolate: needs pipes and process groups of POSIX - give --no-isolate here")
            limits = given.Limits(
                timeout,
                given.memory_of(memory),
                threads,
                given.affinity_of(affinity),
            )
            return command(isolate=isolate, limits=limits, **others)

        options = (
            click.option("--isolate/--no-isolate", default=True, show_default=True, help=ISOLATE),
            click.option("--timeout", type=SECONDS, default=timeout, show_default=True, help=ends),
            click.option("--memory", metavar="SIZE", help=MEMORY),
            click.option("--threads", type=FEW, default=1, show_default=True, help=THREADS),
            click.option("--affinity", metavar="LIST", help=AFFINITY),
        )
        decorated: Command = with_limits
        for option in reversed(options):
            decorated = option(decorated)
        return decorated

    return decorate


def executor_options(command: Command) -> Command:
    """--executor, --scheduler, --tls-..., --workers, --jobs; the command gets how(isolate, limits, timed) as
    `executing`.
    """

    @wraps(command)
    def with_executor(
        *,
        executor: Literal["local", "dask"],
        scheduler: str | None,
        tls_ca_file: str | None,
        tls_cert: str | None,
        tls_key: str | None,
        workers: int | None,
        jobs: int,
        **others: Any,
    ) -> Any:
        tls = tls_ca_file, tls_cert, tls_key
        if executor == "local":
            refuse_given(("scheduler", "tls_ca_file", "tls_cert", "tls_key", "workers"), "is of --executor dask")
            return command(executing=lambda isolate, limits, timed: here(isolate, limits, timed, jobs), **others)
        refuse_given(("jobs",), "is of --executor local, a Dask cluster has workers")
        if scheduler is not None:
            refuse_given(("workers",), "of a cluster of this machine, not of one at --scheduler")
        else:
            refuse_given(("tls_ca_file", "tls_cert", "tls_key"), "of a cluster at --scheduler, this one makes its own")
        return command(
            executing=lambda isolate, limits, timed: by_dask(isolate, limits, timed, scheduler, tls, workers), **others
        )

    options = (
        click.option("--executor", type=click.Choice(KINDS), default="local", show_default=True, help=EXECUTOR),
        click.option("--scheduler", metavar="ADDRESS", help=SCHEDULER),
        *(click.option(name, type=click.Path(exists=True, dir_okay=False), help=says) for name, says in TLS.items()),
        click.option("--workers", type=FEW, metavar="N", help=WORKERS),
        click.option("--jobs", type=FEW, default=1, show_default=True, help=JOBS),
    )
    decorated: Command = with_executor
    for option in reversed(options):
        decorated = option(decorated)
    return decorated


def here(isolate: bool, limits: Limits, timed: bool, jobs: int) -> How:
    """On this machine. Raises InputError for what does not go together."""
    from gradient_routes.bench.execution.sweep import How

    if jobs > 1 and timed:
        raise InputError(f"--jobs {jobs}: cases side by side spoil each other's timing - add --no-timing")
    if jobs > 1 and not isolate:
        raise InputError(f"--jobs {jobs}: needs processes - drop --no-isolate")
    if not isolate:
        limits.pin()
    return How(isolate, limits, jobs)


def by_dask(
    isolate: bool,
    limits: Limits,
    timed: bool,
    scheduler: str | None,
    tls: tuple[str | None, str | None, str | None],
    workers: int | None,
) -> How:
    """On a cluster, which is joined or started when there is a first case. Raises InputError."""
    from gradient_routes.bench.execution.sweep import How

    if not isolate:
        raise InputError("--executor dask: cases on its workers run in processes of their own - drop --no-isolate")
    if workers is not None and workers > 1 and timed:
        raise InputError(f"--workers {workers}: cases side by side spoil each other's timing - add --no-timing")
    ca, cert, key = tls
    if None in (ca, cert) and tls != (None, None, None):
        raise InputError("--tls-ca-file, --tls-cert: go together - give both, and --tls-key")
    try:
        from gradient_routes.bench.execution.cluster.cluster import Cluster
        from gradient_routes.bench.execution.cluster.joining import Credentials, joined, local
    except ImportError as error:
        raise InputError(f"--executor dask: {error} - pip install 'gradient-routes[dask]'") from error
    if scheduler is not None:
        credentials = None if ca is None or cert is None else Credentials(ca, cert, key)
        cluster = Cluster(lambda: joined(scheduler, credentials), timed, complain)
    else:
        count = workers or (1 if timed else max(1, processors() // limits.threads))
        cluster = Cluster(lambda: local(count), timed, complain)
    click.get_current_context().call_on_close(cluster.close)  # however the run ends
    return How(isolate, limits, cluster=cluster)


def processors() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
