"""Connections to Dask clusters: an existing one, by the address of its scheduler, or a local one."""

from __future__ import annotations

import logging
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from multiprocessing import resource_tracker

from distributed import Client, LocalCluster, Security
from distributed.versions import VersionMismatchWarning

from gradient_routes.problems.errors import InputError

TIMEOUT = 10.0  # [s] for a scheduler to answer


TLS = "give the --tls-ca-file, --tls-cert and --tls-key of its cluster"


@dataclass(frozen=True)
class Credentials:
    """Files in PEM format: the authority that signs for scheduler and workers, the client's certificate and its key;
    None where the key is in the file of the certificate.
    """

    ca: str
    cert: str
    key: str | None

    @property
    def security(self) -> Security:
        return Security(
            require_encryption=True, tls_ca_file=self.ca, tls_client_cert=self.cert, tls_client_key=self.key
        )


@contextmanager
def joined(address: str, credentials: Credentials | None = None) -> Iterator[Client]:
    """A client of the scheduler at `address`, by `credentials`, else by those in Dask's own configuration, if any.

    Raises InputError if none answers, if it refuses the credentials, or if its Dask has another version.
    """
    quiet()
    security = None if credentials is None else credentials.security
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VersionMismatchWarning)  # DaskWorkers compares the versions that matter
            client = Client(address, timeout=TIMEOUT, set_as_default=False, security=security)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # the last two: for want of credentials or of TLS
        said = " ".join(str(error.__cause__ or error).split())
        todo = TLS if address.startswith("tls:") else "start one: dask scheduler; and give the address it prints"
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers within {TIMEOUT:g} s ({said}) - {todo}"
        ) from error
    with client:
        theirs, ours = client.run_on_scheduler(version, "distributed"), version("distributed")
        if theirs != ours:
            raise InputError(f"--scheduler {address}: has distributed {theirs} (here {ours}) - install the same here")
        yield client


@contextmanager
def local(workers: int) -> Iterator[Client]:
    """A client of a new cluster of so many workers on this machine, which ends with the client.

    They speak by TLS and certificates that only they hold: without, every user of the machine could run code as us.
    Raises InputError where `cryptography` is missing, which makes them.
    """
    quiet()
    try:
        security = Security.temporary()
    except ImportError as error:
        raise InputError(f"--executor dask: {error} - pip install 'gradient-routes[dask]'") from error
    with (
        LocalCluster(
            n_workers=0,
            threads_per_worker=1,
            host="127.0.0.1",
            protocol="tls://",
            security=security,
            memory_limit=0,  # cases have their own limits, in processes unknown to Dask
            dashboard_address="127.0.0.1:0",
            worker_dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster, timeout=TIMEOUT, set_as_default=False, security=security) as client,
    ):
        cluster.sync(ignore_interrupts)
        cluster.scale(workers)
        yield client


async def ignore_interrupts() -> None:
    """Block SIGINT in workers that this thread starts: only this process handles Ctrl-C in a terminal."""
    resource_tracker.ensure_running()  # started with the first worker it would unblock the signal
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def quiet() -> None:
    """Silence Dask's log: rows and messages of this project report what happens to workers."""
    for name in ("distributed", "distributed.client", "tornado"):  # Dask gives each a level
        logging.getLogger(name).setLevel(logging.CRITICAL)
