"""The process of an adapter: its end, whenever it comes, and the variables that it is started with."""

from __future__ import annotations

import gc
import os
import sys

import numpy as np
import psutil
import pytest

from gradient_routes.problems.errors import Crashed
from gradient_routes.routes.foreign import peer
from gradient_routes.routes.foreign.peer import Peer, environment

ABOUT = r"""input(); print('{"id": 1, "result": {"protocol": 1}}', flush=True); import os, time; """


def started(code: str) -> Peer:
    return Peer([sys.executable, "-ISc", ABOUT + code], "it")


def test_one_that_ends_while_it_is_sent_an_array_has_crashed() -> None:
    it = started("os._exit(4)")
    with pytest.raises(Crashed, match=r"^it: ended with exit code 4 in gradient\(\) - see its output$"):
        it.ask("gradient", p=np.zeros(10**6))
    with pytest.raises(Crashed, match=r"ended with exit code 4 in value\(\)"):
        it.ask("value", p=np.zeros(1))


def test_one_that_closes_its_output_and_stays_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(peer, "GRACE_S", 0.1)
    it = started("os.close(1); time.sleep(3600)")
    process = psutil.Process(it._process.pid)
    with pytest.raises(Crashed, match=r"^it: has closed its output in load\(\) - see its output$"):
        it.ask("load", case={})
    it.close()
    assert not process.is_running()


def test_its_process_ends_with_the_object() -> None:
    it = started("input()")
    process = psutil.Process(it._process.pid)
    del it
    gc.collect()
    assert not process.is_running()


def test_it_runs_with_one_thread_and_without_our_python(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in peer.THREADS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PYTHONPATH", "/ours")
    monkeypatch.setenv("OPENBLAS_CORETYPE", "Haswell")
    found = environment()
    assert {found[name] for name in peer.THREADS} == {"1"}
    assert not {"PYTHONPATH", "OPENBLAS_CORETYPE"} & found.keys()
    assert found["PATH"] == os.environ["PATH"]
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert environment()["OMP_NUM_THREADS"] == "3"
    assert {environment(2)[name] for name in peer.THREADS} == {"2"}
