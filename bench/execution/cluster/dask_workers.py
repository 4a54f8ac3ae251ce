"""The workers of a Dask cluster, their hosts and the versions of their libraries."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit
from uuid import uuid4

from distributed import CancelledError, Client, Future

from gradient_routes.bench.cases.environment import Environment, environment, versions
from gradient_routes.bench.cases.status import one_line
from gradient_routes.bench.execution.cluster.remote import Greeting
from gradient_routes.problems.errors import InputError

GREETING = 10.0  # [s] for the workers present at the start to report their versions
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Member:
    """A worker with the same versions as this machine."""

    address: str
    greeting: Greeting

    def beside(self, other: Member) -> bool:
        """Whether both are on one host, by host name or address."""
        mine, others = (urlsplit(member.address).hostname for member in (self, other))
        return mine == others or self.greeting.hostname == other.greeting.hostname


class DaskWorkers:
    """Workers of a cluster that may run cases. wake() is called when look() has something to do."""

    def __init__(self, client: Client, timed: bool, tell: Tell, wake: Callable[[], None]) -> None:
        assert client.scheduler is not None
        self.scheduler = str(client.scheduler.address)
        self._client, self._timed, self._tell, self._wake = client, timed, tell, wake
        self._asked: dict[str, Future[Any]] = {}
        self._members: dict[str, Member] = {}
        self._refused: set[str] = set()
        self._start = time.monotonic()
        self._met = False

    def __contains__(self, member: Member) -> bool:
        return self._members.get(member.address) == member

    def __len__(self) -> int:
        return len(self._members)

    def look(self) -> None:
        """Update the list; new workers are asked for their versions. Raises InputError if one differs at the start."""
        present = set(self._client.nthreads())
        for address in self._asked.keys() - present:
            self.forget(address)
        for address in present - self._asked.keys():
            self._ask(address)
        for address, asked in list(self._asked.items()):
            if address not in {*self._members, *self._refused} and asked.done():
                self._take(address, asked)
        late = time.monotonic() > self._start + GREETING
        known = {*self._members, *self._refused}
        if not self._met and present and (late or known == present):
            self._met = True
            self._tell_idle()

    def forget(self, address: str) -> None:
        """Remove a worker that has ended; a later one at its address counts as new."""
        self._asked.pop(address, None)
        self._members.pop(address, None)
        self._refused.discard(address)

    def free(self, busy: Iterable[Member]) -> Member | None:
        """A worker that is not busy; where cases are timed, on a host without a busy one. None if there is none."""
        busy = list(busy)
        for member in self._members.values() if self._met else ():
            if member not in busy and not (self._timed and any(member.beside(other) for other in busy)):
                return member
        return None

    def _ask(self, address: str) -> None:
        asked = sent(self._client, address, "greeting")
        asked.add_done_callback(lambda _: self._wake())
        self._asked[address] = asked

    def _take(self, address: str, asked: Future[Any]) -> None:
        try:
            said: Greeting = asked.result(timeout=GREETING)
        except (CancelledError, TimeoutError):
            self.forget(address)  # it has ended, or is asked again
        except Exception as error:
            self._refuse(address, f"does not report its versions: {one_line(error)}")
        else:
            others = difference(said.environment, environment())
            if others is None:
                self._members[address] = Member(address, said)
            else:
                self._refuse(address, f"has {others}")

    def _refuse(self, address: str, why: str) -> None:
        """Refuse the run at the start; later leave out this worker only."""
        line = f"Dask worker {address} {why} - install the same there, gradient-routes {versions()['gradient-routes']}"
        if not self._met:
            raise InputError(line)
        self._refused.add(address)
        self._tell(f"{line}; it is left out")

    def _tell_idle(self) -> None:
        hosts: list[Member] = []
        for member in self._members.values():
            if not any(member.beside(other) for other in hosts):
                hosts.append(member)
        idle = len(self._members) - len(hosts)
        if self._timed and idle:
            self._tell(
                f"{idle} of {len(self._members)} Dask workers left idle: they share a host, and cases side by side"
                " spoil each other's timing - add --no-timing to use all"
            )


def sent(client: Client, address: str, function: str, *arguments: Any) -> Future[Any]:
    """Call a function of bench.execution.cluster.remote on this worker, at most once.

    It is sent by name: an object that the worker or the scheduler cannot import would end that process.
    """
    return client.submit(
        eval,
        f"__import__('importlib').import_module('gradient_routes.bench.execution.cluster.remote').{function}(*arguments)",
        {"arguments": arguments},
        key=f"routes-{uuid4()}",
        pure=False,
        retries=0,
        workers=[address],
        allow_other_workers=False,
    )


def difference(theirs: Environment, ours: Environment) -> str | None:
    """Libraries, of those that results depend on, whose versions differ, as text; None if none does."""
    mine, others = (found["versions"] | {"Python": found["python"]} for found in (ours, theirs))
    odd = [f"{name} {others.get(name)} (here {mine[name]})" for name in mine if others.get(name) != mine[name]]
    return ", ".join(odd) or None
