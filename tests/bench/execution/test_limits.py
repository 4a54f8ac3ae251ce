"""Limits as a user writes them."""

from __future__ import annotations

import os
import sys

import pytest

from gradient_routes.bench.execution.isolation.limits import affinity_of, memory_of
from gradient_routes.problems.errors import InputError


@pytest.mark.parametrize("text", ["64", "0", "-1GiB", "GiB", "1XiB", "nan", "inf", "1e30"])
def test_sizes_that_are_none(text: str) -> None:
    with pytest.raises(InputError, match="--memory"):
        memory_of(text)


def test_sizes() -> None:
    texts = {"4GiB": 2**32, "4G": 2**32, "500MB": 500 * 10**6, "1.5 GiB": 3 * 2**29, "100000000": 10**8, "none": None}
    assert {text: memory_of(text) for text in texts} == texts


@pytest.mark.skipif(sys.platform != "linux", reason="asks for the processors it may use")
@pytest.mark.parametrize("text", ["", "a", "0-", "-1", "3-1", "0,,1", "999999", "0-99999999"])
def test_processors_that_are_none(text: str) -> None:
    with pytest.raises(InputError, match="--affinity"):
        affinity_of(text)
    assert affinity_of(",".join(map(str, os.sched_getaffinity(0)))) == tuple(sorted(os.sched_getaffinity(0)))


def test_limits_without_processes_are_refused(cli) -> None:
    run = ("run", "--problem", "bar", "--route", "adjoint", "--no-store", "--no-isolate")
    for given, says in (
        (("--timeout", "3"), "--timeout: holds for processes of their own"),
        (("--memory", "1GiB"), "--memory: holds for processes of their own"),
        (("--jobs", "2", "--no-timing"), "--jobs 2: needs processes"),
        (("--threads", "0"), "--threads 0 - give a whole number from 1"),
    ):
        ran = cli(*run, *given)
        assert (ran.code, says in ran.err, ran.err.count("\n")) == (2, True, 1), ran.err
