"""The workers of a Dask cluster: who is there, on which host, with which libraries."""

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

GREETING = 10.0  # [s] in which workers that are there at the start say who they are
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Member:
    """A worker that has said who it is."""

    address: str
    greeting: Greeting

    def beside(self, other: Member) -> bool:
        """Whether both are on one host, as far as names and addresses tell."""
        mine, others = (urlsplit(member.address).hostname for member in (self, other))
        return mine == others or self.greeting.hostname == other.greeting.hostname


class Crew:
    """All workers of a client's cluster that may run cases. wake() is called when there is a reason to look again."""

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
        """Who is there? Newcomers are asked who they are. Raises InputError where one differs, at the start."""
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
        """It is gone; what comes back there is another."""
        self._asked.pop(address, None)
        self._members.pop(address, None)
        self._refused.discard(address)

    def free(self, busy: Iterable[Member]) -> Member | None:
        """One that may have a case beside those that are busy: where cases are timed, none on their hosts."""
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
            self.forget(address)  # gone by now, or to be asked again
        except Exception as error:
            self._refuse(address, f"cannot say who it is: {one_line(error)}")
        else:
            others = difference(said.environment, environment())
            if others is None:
                self._members[address] = Member(address, said)
            else:
                self._refuse(address, f"has {others}")

    def _refuse(self, address: str, why: str) -> None:
        """The whole run, at the start; later only what has joined."""
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
    """A function of bench.execution.cluster.remote on this worker, once, or not at all.

    It is sent by its name: an object that a worker, or the scheduler, cannot import would end it.
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
    """What numbers and keys depend on and is another version there, in words."""
    mine, others = (found["versions"] | {"Python": found["python"]} for found in (ours, theirs))
    odd = [f"{name} {others.get(name)} (here {mine[name]})" for name in mine if others.get(name) != mine[name]]
    return ", ".join(odd) or None
