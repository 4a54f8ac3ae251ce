"""Cases on the workers of a Dask cluster: one at a time per worker, or per host where they are timed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack
from itertools import chain

from distributed import Client

from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.execution.cluster.dispatch import PATIENCE, Dispatch
from gradient_routes.bench.execution.isolation.limits import Limits
from gradient_routes.bench.execution.measurement import Measure


class Cluster:
    """An executor on the workers of a Dask client, which `connect` opens for the first case.

    tell(line) receives lines for the user. outcomes() raises InputError if a worker has other versions than this
    machine, Stranded if there is no worker for `patience` seconds.
    """

    def __init__(
        self,
        connect: Callable[[], AbstractContextManager[Client]],
        timed: bool,
        tell: Callable[[str], None],
        patience: float = PATIENCE,
    ) -> None:
        self._connect, self._timed, self._tell, self._patience = connect, timed, tell, patience
        self._opened = ExitStack()

    def outcomes(self, jobs: Iterator[Measure], slots: int, limits: Limits) -> Iterator[Outcome]:
        """Outcomes as they arrive; a job is taken when a worker is free. `slots` is for executors on this machine."""
        first = next(jobs, None)
        if first is None:
            return
        try:
            client = self._opened.enter_context(self._connect())
            dispatch = Dispatch(client, limits, self._timed, self._tell, self._patience)
            self._opened.callback(dispatch.cancel)
            yield from dispatch.outcomes(chain([first], jobs))
        finally:
            self.close()

    def close(self) -> None:
        """Cancel running cases, then close the connection."""
        self._opened.close()
