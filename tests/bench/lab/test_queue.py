"""Who waits is told how many are before it."""

from __future__ import annotations

import asyncio
from pathlib import Path

from gradient_routes.bench.lab.pool import Lane, Pool
from gradient_routes.bench.lab.shell import Command

from .aside import aside


def test_places_in_the_queue_move_up_when_somebody_leaves() -> None:
    told: dict[str, list[int]] = {"first": [], "second": []}

    async def wait() -> None:
        pool = Pool(Lane(workers=1, timeout=1.0))
        await pool._turns.acquire()  # its only process works
        job = Command(("run",), Path("/"))
        asked = {name: pool.messages(job, heard.append) for name, heard in told.items()}
        waiting = {name: asyncio.ensure_future(anext(messages)) for name, messages in asked.items()}
        await asyncio.sleep(0)
        assert told == {"first": [1, 1], "second": [2]}
        waiting["first"].cancel()
        await asyncio.sleep(0)
        await asyncio.sleep(0)
        assert told["second"] == [2, 1]
        waiting["second"].cancel()
        await asyncio.gather(*waiting.values(), return_exceptions=True)

    aside(wait())
