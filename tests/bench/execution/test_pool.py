"""Cases side by side."""

from __future__ import annotations

import threading
from itertools import repeat
from typing import Any

import pytest

from gradient_routes.bench.execution.executors import pool
from gradient_routes.bench.execution.isolation.limits import Limits


def test_who_listens_to_a_case_closes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two threads that close one descriptor may close another's; the pool only kills, once it is closed early."""
    closed_by: list[threading.Thread] = []

    class Case:
        def __init__(self, job: Any, limits: Limits) -> None:
            self._killed, self._last = threading.Event(), job == "long"

        def prepared(self) -> str:
            if self._last:
                assert self._killed.wait(60)
            return "its outcome"

        def kill(self) -> None:
            self._killed.set()

        def close(self) -> None:
            closed_by.append(threading.current_thread())

    monkeypatch.setattr(pool, "Isolated", Case)
    jobs: Any = iter(["short", *repeat("long", 3)])
    outcomes = pool.outcomes(jobs, 3, Limits())
    assert next(outcomes) == "its outcome"
    outcomes.close()  # type: ignore[attr-defined]
    assert len(closed_by) == 3
    assert threading.current_thread() not in closed_by
