"""A state is a command and a URL; the newest state wins."""

from __future__ import annotations

import asyncio
import shlex
from collections.abc import AsyncGenerator
from pathlib import Path
from typing import Any, ClassVar, cast
from urllib.parse import parse_qsl

import panel as pn
import param
import pytest

from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.messages import Ended
from gradient_routes.bench.lab.part import Part
from gradient_routes.bench.lab.place import Place
from gradient_routes.bench.lab.pool import Pool
from gradient_routes.bench.lab.shell import Command, Exited, Row, Said
from gradient_routes.problems.errors import InputError


class Tried(Part):
    """One parameter of each kind."""

    slug, title, lead = "tried", "", ""

    n = param.Integer(8, bounds=(1, 100))
    noise = param.Number(0.0, bounds=(0.0, 1.0))
    nodes = param.List([1, 2], item_type=int)
    each: ClassVar = {"nodes": (1, 8)}
    stop_at_tip = param.Boolean(False)
    route = param.Selector(default="adjoint", objects=["adjoint", "tangent"])

    def command(self) -> tuple[str, ...]:
        if self.n == 99:
            raise InputError("tried: n=99 - choose another")
        return ("run", "--problem", f"bar[n={self.n}]", "--route", self.route)

    def content(self) -> pn.Column:
        self.drawn = (pn.Row(),)
        return pn.Column(*self.drawn)

    def take(self, message: Any) -> None:
        self.__dict__.setdefault("taken", []).append(message)

    @property
    def said(self) -> str:
        return str(self.status.object)


class Pools:
    """Answers a command by its own words, slowly."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    async def messages(self, job: Command, told: Any) -> AsyncGenerator[Any]:
        self.asked.append(shlex.join(job.arguments))
        yield Row({"problem": job.arguments[2]})
        await asyncio.sleep(0.01)
        yield Said("routes: a note")
        yield Exited(0)
        yield Ended(Status.OK)


def made(query: dict[str, str] | None = None) -> tuple[Tried, Pools]:
    pools = Pools()
    pool = cast(Pool, pools)
    return Tried(Place(pool, pool, Path("/")), query), pools


def settled(part: Tried, *states: dict[str, Any]) -> None:
    """Take one state after the other, faster than they are computed, and wait for what runs."""

    async def move() -> None:
        for state in states:
            part.param.update(**state)
            await asyncio.sleep(0)
        while part.running:
            await asyncio.sleep(0.01)

    asyncio.run(move())


def test_a_url_holds_the_state() -> None:
    part, _ = made()
    settled(part, {"n": 12, "noise": 1e-3, "nodes": [3, 5], "stop_at_tip": True, "route": "tangent"})
    assert part.url() == "/tried?n=12&noise=0.001&nodes=3,5&stop_at_tip=yes&route=tangent"
    again, _ = made(dict(parse_qsl(part.query())))
    assert {name: getattr(again, name) for name in again.fields} == {name: getattr(part, name) for name in part.fields}
    assert made()[0].url() == "/tried"


@pytest.mark.parametrize(
    "query",
    [
        {"n": "many"},
        {"n": "1_0"},
        {"n": "0"},
        {"noise": "nan"},
        {"nodes": "a,b"},
        {"nodes": "1,9"},
        {"stop_at_tip": "1"},
        {"route": "fd; rm"},
    ],
    ids=lambda query: str(query),
)
def test_a_url_that_is_wrong_is_told_and_changes_nothing(query: dict[str, str]) -> None:
    part, _ = made(query)
    assert part.url() == "/tried"
    (name,) = query
    assert name in part.said
    assert "stays" in part.said


def test_the_newest_state_wins() -> None:
    part, pools = made()
    settled(part, {"n": 9}, {"n": 10}, {"n": 11})
    assert pools.asked == ["run --problem 'bar[n=9]' --route adjoint", "run --problem 'bar[n=11]' --route adjoint"]
    assert part.__dict__["taken"][-1] == Row({"problem": "bar[n=11]"})
    assert "a note" in part.said
    assert "bar[n=11]" in str(part.shown.object)


def test_a_state_without_a_command_says_why() -> None:
    part, pools = made()
    settled(part, {"n": 99})
    assert not pools.asked
    assert "choose another" in part.said


def test_a_word_that_a_page_lacks_is_told() -> None:
    part, _ = made({"sensor": "1"})
    assert "sensor: no word of this page" in part.said


def test_what_is_drawn_of_another_state_fades() -> None:
    part, _ = made()
    (panel,) = part.content()
    settled(part, {"n": 9})
    assert panel.styles == {}
    settled(part, {"n": 99})
    assert panel.styles["opacity"] == "0.4"
    settled(part, {"n": 9})
    assert panel.styles["opacity"] == "1"


def test_what_runs_can_be_stopped() -> None:
    part, _ = made()

    async def move() -> None:
        part.n = 9
        await asyncio.sleep(0.001)
        part.stop()
        while part.running:
            await asyncio.sleep(0.01)

    asyncio.run(move())
    assert "stopped" in part.said
