"""Coroutines in a thread of their own: Playwright keeps a loop running in that of the tests."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from typing import Any


def aside(work: Coroutine[Any, Any, Any]) -> Any:
    """What it returns."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, work).result()


class Loop:
    """One for several coroutines, one after the other."""

    def __init__(self) -> None:
        self._thread, self._loop = ThreadPoolExecutor(1), asyncio.new_event_loop()

    def run_until_complete(self, work: Coroutine[Any, Any, Any]) -> Any:
        return self._thread.submit(self._loop.run_until_complete, work).result()

    def close(self) -> None:
        self._thread.shutdown()
        self._loop.close()
