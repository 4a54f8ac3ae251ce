"""A pool of processes: whatever a job does ends that job only, and nothing is left."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
import time
from collections.abc import AsyncGenerator, Coroutine, Iterator
from contextlib import aclosing
from functools import partial
from typing import Any, cast

import psutil
import pytest

from gradient_routes.bench.cases.status import Status
from gradient_routes.bench.execution.isolation.channel import Call, Job
from gradient_routes.bench.execution.isolation.messages import Ended, Message, Returned
from gradient_routes.bench.lab.pool import Begun, Lane, Pool

Loop = asyncio.AbstractEventLoop
LONG = 600.0  # [s] longer than any test
PID, SLEEP, NOTHING = Call(os.getpid), Call(time.sleep, (LONG,)), Call(int)


@pytest.fixture(scope="module")
def loop() -> Iterator[Loop]:
    made = asyncio.new_event_loop()
    yield made
    made.close()


@pytest.fixture(scope="module")
def one(loop: Loop) -> Iterator[Pool]:
    """With one process."""
    pool = Pool(Lane(workers=1, timeout=LONG, first=NOTHING))
    yield pool
    pool.close()


async def messages(pool: Pool, job: Job) -> list[Message]:
    """All but the first, which says that the job begins."""
    begun, *others = [message async for message in pool.messages(job)]
    assert begun == Begun()
    return others


async def end(pool: Pool, job: Job) -> Ended:
    return cast(Ended, (await messages(pool, job))[-1])


def test_a_process_stays_for_the_next_job(one: Pool, loop: Loop) -> None:
    first, second = (loop.run_until_complete(messages(one, PID)) for _ in range(2))
    assert first == second
    assert first[0].value != os.getpid()
    assert first[1] == Ended(Status.OK)


def test_jobs_are_done_in_the_order_in_which_they_came(one: Pool, loop: Loop) -> None:
    done: list[int] = []
    before: dict[int, int] = {}

    async def job(k: int) -> None:
        async for _ in one.messages(NOTHING, partial(before.__setitem__, k)):
            pass
        done.append(k)

    async def many() -> dict[int, int]:
        tasks = [asyncio.create_task(job(k)) for k in range(6)]
        await asyncio.sleep(0)
        first = dict(before)
        tasks[3].cancel()  # while it waits
        await asyncio.gather(*tasks, return_exceptions=True)
        return first

    first = loop.run_until_complete(many())
    assert [first[k] - first[1] for k in range(1, 6)] == [0, 1, 2, 3, 4]
    assert done == [0, 1, 2, 4, 5]
    assert {before[k] for k in done[1:]} == {1}, "each was next in the end"


@pytest.mark.parametrize(
    ("job", "status", "says"),
    [
        (Call(os._exit, (3,)), Status.CRASHED, "exit code 3"),
        (Call(os.kill, (0, signal.SIGKILL)), Status.CRASHED, "SIGKILL"),
        (Call(int, ("x",)), Status.FAILED, "invalid literal"),
        (Call(bytearray, (2**40,)), Status.OUT_OF_MEMORY, ""),
        (Call(lambda: None), Status.FAILED, "lambda"),  # it cannot be sent
    ],
)
def test_a_job_that_fails_ends_alone(one: Pool, loop: Loop, job: Job, status: Status, says: str) -> None:
    ended = loop.run_until_complete(end(one, job))
    assert (ended.status, says in ended.reason) == (status, True), ended.reason
    assert "\n" not in ended.reason
    assert loop.run_until_complete(end(one, PID)) == Ended(Status.OK)


def test_a_job_that_nobody_waits_for_is_ended(one: Pool, loop: Loop) -> None:
    async def left(ticks: int) -> Ended:
        task = asyncio.create_task(end(one, SLEEP))
        for _ in range(ticks):
            await asyncio.sleep(0.01)
        task.cancel()
        task.cancel()  # twice, as by a button and by the end of its page
        await asyncio.gather(task, return_exceptions=True)
        return await end(one, PID)

    for ticks in (0, 1, 20):
        assert loop.run_until_complete(left(ticks)) == Ended(Status.OK)


def test_messages_that_are_not_asked_for_any_more_end_the_job(one: Pool, loop: Loop) -> None:
    async def some() -> Ended:
        async with aclosing(cast(AsyncGenerator[Message], one.messages(Call(os.getpid)))) as told:
            async for message in told:
                if isinstance(message, Returned):
                    break
        return await end(one, PID)

    assert loop.run_until_complete(some()) == Ended(Status.OK)


def run(test: Coroutine[Any, Any, Any]) -> Any:
    """And see that nothing is left."""
    threads, processes = threading.active_count(), {*psutil.Process().children(recursive=True)}
    found = asyncio.run(test)
    assert not {*psutil.Process().children(recursive=True)} - processes
    assert threading.active_count() == threads
    return found


def test_a_job_is_ended_at_its_time() -> None:
    async def late() -> tuple[Ended, Ended]:
        pool = Pool(Lane(workers=1, timeout=0.2, first=NOTHING))
        try:
            return await end(pool, SLEEP), await end(pool, NOTHING)
        finally:
            pool.close()

    late_one, next_one = run(late())
    assert (late_one.status, late_one.reason) == (Status.TIMEOUT, "after 0.2 s")
    assert next_one == Ended(Status.OK)


def test_a_process_that_ends_while_it_starts_is_said() -> None:
    async def broken() -> list[Ended]:
        pool = Pool(Lane(workers=1, timeout=LONG, first=Call(os._exit, (4,))))
        try:
            return [await end(pool, NOTHING) for _ in range(2)]
        finally:
            pool.close()

    for ended in run(broken()):
        assert (ended.status, "exit code 4" in ended.reason) == (Status.CRASHED, True)


def test_pools_that_are_closed_leave_nothing() -> None:
    async def closed() -> None:
        pools = [Pool(Lane(workers=1, timeout=LONG, first=NOTHING)) for _ in range(2)]
        pools[0].warm()
        tasks = [asyncio.create_task(end(pool, SLEEP)) for pool in pools]
        await end(one_more := Pool(Lane(workers=1, timeout=LONG, first=NOTHING)), NOTHING)
        for pool in (*pools, one_more):
            pool.close()
        for ended in await asyncio.gather(*tasks):
            assert ended.status is not Status.OK

    run(closed())
