"""What a forward solve is taken to cost, on clocks that tests set: no time is measured here."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.samples import Elapsed
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution import timing
from gradient_routes.bench.execution.case_context import CaseContext
from gradient_routes.bench.execution.cost_model import CALLS, TRIAL, Prices, price_of, unaffordable
from gradient_routes.bench.store.resume import state_of
from gradient_routes.problems.problem import Array
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State
from gradient_routes.routes.tally import Work

ONE = ForwardWork(Work(forward_solves=1))


@dataclass
class Clocks:
    """Wall and CPU time, and the CPU time of children; each call takes the next pair, the last one ever after."""

    wall: float = 0.0
    cpu: float = 0.0
    children: float = 0.0
    calls: int = 0
    takes: list[tuple[float, float]] = field(default_factory=list)

    def call(self) -> str:
        wall, cpu = self.takes.pop(0) if len(self.takes) > 1 else self.takes[0]
        self.wall, self.cpu, self.calls = self.wall + wall, self.cpu + cpu, self.calls + 1
        return f"result {self.calls}"


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    clocks = Clocks()
    monkeypatch.setattr(timing.time, "perf_counter", lambda: clocks.wall)
    monkeypatch.setattr(timing.time, "process_time", lambda: clocks.cpu)
    monkeypatch.setattr(timing.os, "times", lambda: os.times_result((0.0, 0.0, clocks.children, 0.0, 0.0)))
    return clocks


@pytest.mark.parametrize("first", [0.5, 9.0, 12.0, 1e4])
def test_a_first_call_that_compiles_is_never_the_price(clocks: Clocks, first: float) -> None:
    """fd-one-sided of 9 solves was skipped for 1.83 min: 12 s of a first call under load instead of 0.1 s."""
    clocks.takes = [(first, first), (0.1, 0.1)]
    assert price_of(clocks.call) == (Elapsed(pytest.approx(0.1), pytest.approx(0.1)), "result 1")
    assert clocks.calls == 1 + CALLS


def test_the_price_is_the_least_of_several_calls(clocks: Clocks) -> None:
    clocks.takes = [(0.4, 0.1), (0.3, 0.1), (0.1, 0.1), (0.2, 0.1)]
    assert price_of(clocks.call)[0].wall == pytest.approx(0.1)


def test_what_is_long_is_called_twice(clocks: Clocks) -> None:
    clocks.takes = [(30.0, 30.0), (20.0, 20.0)]
    assert price_of(clocks.call)[0].wall == pytest.approx(20.0)
    assert clocks.calls == 2


def test_more_calls_are_tried_while_the_machine_is_busy(clocks: Clocks) -> None:
    """Until one has not waited, or the trial is over."""
    clocks.takes = [(0.1, 0.02)] * 6 + [(0.02, 0.02)]
    found, _ = price_of(clocks.call)
    assert (found.wall, found.busy, clocks.calls) == (pytest.approx(0.02), False, 7)
    clocks.takes, clocks.calls = [(0.125, 0.02)], 0
    assert price_of(clocks.call)[0].busy
    assert clocks.calls == 1 + TRIAL / 0.125


def test_threads_and_child_processes_do_not_wait(clocks: Clocks) -> None:
    assert not Elapsed(1.0, 4.0).busy
    assert Elapsed(1.0, 0.5).busy

    def child() -> None:
        clocks.wall, clocks.children = clocks.wall + 1.0, clocks.children + 1.0

    found, _ = timing.elapsed(child)
    assert found == Elapsed(1.0, 1.0)
    assert not found.busy


def test_a_bill_says_that_its_price_is_of_a_busy_machine() -> None:
    idle, busy = (Prices(Elapsed(20.0, cpu), 0.0, 0.0, ONE) for cpu in (20.0, 2.0))
    nine = Work(forward_solves=9)
    assert (
        unaffordable(idle, None, nine, 60.0) == "predicted bill 3 min (9 fwd) > --budget 60 s; --budget inf forces it"
    )
    assert unaffordable(busy, None, nine, 60.0) == (
        "predicted bill 3 min (9 fwd) > --budget 60 s, priced on a busy machine; --budget inf forces it"
    )
    assert unaffordable(busy, None, nine, 200.0) is None
    assert unaffordable(busy, None, nine, 200.0, times=2) is not None


def slow(clocks: Clocks) -> Callable[[Model, Array], State]:
    solve = Model.solve

    def slowly(self: Model, p: Array, **options: object) -> State:
        clocks.call()
        return solve(self, p, **options)

    return slowly


@pytest.mark.parametrize(("after", "fits"), [((0.1, 0.1), True), ((12.0, 12.0), False), ((11.0, 0.5), False)])
def test_no_case_is_skipped_that_a_second_solve_shows_to_be_cheap(
    clocks: Clocks, monkeypatch: pytest.MonkeyPatch, after: tuple[float, float], fits: bool
) -> None:
    """And one that is skipped is stale only where the machine was busy."""
    monkeypatch.setattr(Model, "solve", slow(clocks))
    clocks.takes = [(12.0, 12.0), after]
    (problem,), (route,) = case.problems(["bar"]), case.routes(["fd-one-sided"])
    predicted = CaseContext(problem, Settings(budget=60.0)).predict(8, route.route, route.route.defaults)
    assert (predicted.objection is None) == fits
    kept = {"status": "skipped", "content_key": "a", "budget_s": 60.0, **predicted.columns}
    if not fits:
        assert state_of(kept, kept) == ("done" if after == (12.0, 12.0) else "stale")


def test_a_sweep_of_a_nonlinear_march_takes_a_factorization_in_every_step() -> None:
    """On an impact-block of 20 steps an adjoint took 1.6 forward solves and was predicted to take 1.02."""
    cold = Work(1, 60, 81, assemblies=60, factorizations=60, solves=60, steps=20)
    march = Prices(Elapsed(3.0, 3.0), 0.1, 0.0, ForwardWork(cold, linear=False))
    assert march.seconds(cold) == pytest.approx(3.0)
    assert march.seconds(7 * cold) == pytest.approx(21.0)
    back = Work(assemblies=1, factorizations=1, transposed_solves=1)
    assert march.seconds(cold + back) == pytest.approx(3.0 + 1.0 + 0.1)
    unrolled = Work(transposed_solves=60)  # by the factors of every Newton step, 3 in each of 20
    assert march.seconds(cold + unrolled) == pytest.approx(3.0 + 3 * 0.1)
