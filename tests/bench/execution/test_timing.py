"""Rounds on a clock that tests set, and cases that take turns; no time is measured here."""

from __future__ import annotations

import gc
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.samples import LEAST, Samples
from gradient_routes.bench.execution import timing
from gradient_routes.bench.execution.cost_model import contained
from gradient_routes.bench.execution.executors import running
from gradient_routes.bench.execution.executors.running import interleaved
from gradient_routes.bench.execution.timing import LONG, MOST, TURNS, Rounds
from gradient_routes.routes.forward_work import ForwardWork
from gradient_routes.routes.tally import Work


class Clock:
    """Moves by what calls take."""

    def __init__(self) -> None:
        self.now, self.calls = 0.0, []

    def taking(self, name: str, *seconds: float) -> Callable[[], None]:
        """A call that takes these in turn, the last one ever after."""
        left = list(seconds)

        def call() -> None:
            self.calls.append(name)
            assert not gc.isenabled()
            self.now += left.pop(0) if len(left) > 1 else left[0]

        return call


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(timing.time, "perf_counter", lambda: clock.now)
    return clock


def turns(rounds: Rounds) -> int:
    count = 1
    while rounds.turn():
        count += 1
    return count


def test_rounds_go_on_until_the_gradient_has_run_for_the_least_time(clock: Clock) -> None:
    """In turns that leave room for others; a sample of forward solves beside every one of the gradient."""
    rounds = Rounds(clock.taking("g", 0.02), clock.taking("f", 0.02), 0.02, 1.0)
    assert turns(rounds) == TURNS
    samples = rounds.samples
    assert samples.calls == 1
    assert len(samples.gradient) == len(samples.forward) == 50
    assert sum(samples.gradient) == pytest.approx(1.0)
    assert samples.ratio == pytest.approx(1.0)
    assert clock.calls[6:14] == ["g", "f", "f", "g"] * 2, "three calls of each calibrate"


def test_neither_of_a_round_is_always_the_second(clock: Clock) -> None:
    """Which waits more often on a busy machine: an adjoint was printed at 0.58 forward solves for it. Also where a turn
    is one round.
    """
    each = {"g": 0.3, "f": 0.2}
    waited = {"g": 0, "f": 0}

    def call(name: str) -> None:
        clock.calls.append(name)
        second = len(clock.calls) > 6 and len(clock.calls) % 2 == 0
        waited[name] += second
        clock.now += each[name] * (3.0 if second else 1.0)

    rounds = Rounds(lambda: call("g"), lambda: call("f"), 0.3, 0.9)
    assert turns(rounds) == len(rounds.samples.gradient)
    assert abs(waited["g"] - waited["f"]) <= 1


def test_both_of_a_round_last_as_long_as_the_longer_of_them(clock: Clock) -> None:
    rounds = Rounds(clock.taking("g", 0.03), clock.taking("f", 0.0101), 0.03, 0.3)
    turns(rounds)
    assert (clock.calls[6:14], rounds.samples.calls) == (["g", *"fff", *"fff", "g"], 1)
    cheap = Rounds(clock.taking("g", 0.01), clock.taking("f", 0.0401), 0.01, 0.3)
    turns(cheap)
    assert cheap.samples.calls == 4
    assert cheap.samples.ratio == pytest.approx(0.01 / 0.0401)


def test_forward_solves_beside_a_long_gradient_need_not_last_as_long(clock: Clock) -> None:
    rounds = Rounds(clock.taking("g", 0.9), clock.taking("f", 0.01), 0.9, 0.5)
    turns(rounds)
    there, back = ["g", *"f" * 10], [*"f" * 10, "g"]
    assert clock.calls == ["g", *"fff", *there, *back, *there, *back, *there], "one call of what is long calibrates it"


def test_what_slows_a_round_down_slows_both_of_it_down() -> None:
    """A machine half as fast for some rounds changes both medians, and no quotient."""
    slow = Samples((3.0, 6.0, 6.0, 3.0, 3.3), (1.0, 2.0, 2.0, 1.0, 1.1))
    assert slow.ratio == pytest.approx(3.0)


def test_short_calls_are_repeated_within_a_sample(clock: Clock) -> None:
    """So that the clock can tell them: a sample is a hundredth of the least time, and a millisecond at least."""
    rounds = Rounds(clock.taking("g", 1e-6), clock.taking("f", 1e-5), 1e-6, 0.2)
    turns(rounds)
    assert rounds.samples.calls == pytest.approx(0.2 / MOST / 1e-6, abs=1)
    assert len(rounds.samples.gradient) == pytest.approx(MOST, abs=1)
    assert rounds.samples.gradient == pytest.approx([1e-6] * len(rounds.samples.gradient))
    assert rounds.samples.forward == pytest.approx([1e-5] * len(rounds.samples.forward))
    few = Rounds(clock.taking("g", 1e-6), clock.taking("f", 1e-5), 1e-6, 1e-9)
    turns(few)
    assert (few.samples.calls, len(few.samples.gradient)) == (pytest.approx(1000, abs=1), LEAST)


@pytest.mark.parametrize(("first", "min_time"), [(0.5, 0.0), (LONG, 0.0), (LONG, 0.1), (LONG, 10.0)])
def test_what_is_long_or_not_to_be_timed_has_one_round_of_one_call(clock: Clock, first: float, min_time: float) -> None:
    rounds = Rounds(clock.taking("g", first), clock.taking("f", 0.1), first, min_time)
    assert turns(rounds) == 1
    assert clock.calls == ["g", "f"]
    assert rounds.samples == Samples((pytest.approx(first),), (pytest.approx(0.1),), 1)
    assert rounds.long == (first >= LONG)


def test_the_least_rounds_are_had_however_long_a_call_takes(clock: Clock) -> None:
    rounds = Rounds(clock.taking("g", 0.9), clock.taking("f", 0.1), 0.9, 0.1)
    assert turns(rounds) == LEAST
    assert len(rounds.samples.gradient) == LEAST


def test_the_garbage_collector_is_as_it_was() -> None:
    """Off in every sample, which `taking` asserts; on again, whatever a call does."""
    assert gc.isenabled()

    def fails() -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        Rounds(fails, fails, 0.0, 0.1).turn()
    assert gc.isenabled()
    gc.disable()
    try:
        Rounds(lambda: None, lambda: None, 0.0, 0.0).turn()
        assert not gc.isenabled()
    finally:
        gc.enable()


def test_quartiles_and_what_is_unstable() -> None:
    even = Samples((1.0, 2.0, 3.0, 4.0, 5.0), (1.0,) * 5)
    assert (even.quartiles, even.unstable, even.ratio) == ((2.0, 4.0), True, 3.0)
    assert Samples((1.0, 1.0, 1.0, 1.0, 9.0), (1.0,) * 5).unstable is False, "one that stands out is none"
    assert Samples((1.0, 1.0, 1.05, 1.1, 1.1), (1.0,) * 5).unstable is False
    assert Samples((1.0, 1.0, 1.05, 1.11, 1.11), (1.0,) * 5).unstable is True
    assert Samples((1.0, 9.0, 1.0, 9.0), (1.0,) * 4).unstable is None, "too few to tell"
    assert Samples((7.0,), (1.0,)).quartiles == (7.0, 7.0)


@pytest.mark.parametrize(
    ("ratio", "floor", "impossible"),
    [(0.58, 1.0, True), (0.99, 1.0, True), (1.0, 1.0, False), (1.2, 1.0, False), (0.58, 0.0, False), (0.58, 0.5, False),
     (17.9, 18.0, False), (16.1, 18.0, True), (0.99, 1.05, True), (1.0, 1.05, False)],
)  # fmt: skip
def test_no_gradient_costs_less_than_the_forward_solves_it_contains(
    ratio: float, floor: float, impossible: bool
) -> None:
    """A tenth less is within what a timing resolves, but for less than one solve."""
    samples = Samples((ratio,) * 5, (1.0,) * 5)
    assert samples.resolved(floor) == (None if impossible else ratio)


def test_what_counted_work_contains_is_by_its_least_operation() -> None:
    cold = ForwardWork(
        Work(forward_solves=1, newton_iterations=4, residuals=5, assemblies=4, factorizations=4, solves=4)
    )
    adjoint = cold.cold + Work(assemblies=1, transposed_solves=1)
    assert contained(adjoint, cold) == 1.0
    assert contained(9 * cold.cold, cold) == 9.0
    assert contained(cold.cold + Work(forward_solves=8, residuals=16, newton_iterations=8), cold) == 1.0, "chords"
    assert contained(Work(forward_solves=1, matvecs=400), cold) == 0.0, "unrolled iterations are no forward solve"
    assert contained(Work(), ForwardWork(Work(forward_solves=1))) == 0.0, "of a route that counts nothing"


def fixed(monkeypatch: pytest.MonkeyPatch, *ratios: float) -> None:
    """Every timing gives these."""
    samples = Samples(ratios, (1.0,) * len(ratios))
    monkeypatch.setattr(Rounds, "samples", property(lambda rounds: samples))


def test_a_ratio_that_cannot_be_is_unresolved_wherever_it_is_shown(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    """The adjoint contains one forward solve, and unrolled conjugate gradients none."""
    fixed(monkeypatch, 0.5, 0.58, 1.4, 0.5, 0.6)
    command = ("run", "--min-time", "0", "--problem", "bar", "--route", "adjoint", "--route", "unrolled-ad")
    adjoint, unrolled = cli(*command, "--json").rows
    assert (adjoint["forward_ratio"], adjoint["ratio_floor"]) == (None, 1.0)
    assert (unrolled["forward_ratio"], unrolled["ratio_floor"]) == (0.58, 0.0)
    assert adjoint["note"].split("; ")[-1] == (
        "adjoint: cost / forward solve unresolved, 0.58 in the median of 5 rounds, 1 by counted work: raise --min-time"
    )
    assert adjoint["seconds"] == 0.58
    shown = cli(*command)
    (line,) = [line for line in shown.out.splitlines() if line.startswith("  adjoint")]
    assert "unresolved" in line
    assert re.search(r"unrolled-ad.* 0\.58 1 fwd", shown.out)
    assert cli("report", "-o", "page.html").code == 0
    page = Path("page.html").read_text()
    assert "unresolved ·" in page
    assert "unresolved: less than the forward solves that it contains" in page
    assert "0.58× ·" in page


def test_what_is_not_timed_is_not_unresolved(cli) -> None:
    ran = cli("run", "--no-timing", "--problem", "bar", "--route", "adjoint")
    assert "unresolved" not in ran.out + ran.err


class Fake:
    """A case that says when it is called; `ends` in its preparation, in its second turn, or raises there."""

    def __init__(self, name: str, log: list[str], rounds: int = 2, long: bool = False, ends: str = "") -> None:
        self.name, self.log, self.rounds, self.long, self.ends = name, log, rounds, long, ends

    def prepared(self) -> Outcome | None:
        self.log.append(f"{self.name} prepared")
        if self.ends == "interrupt":
            raise KeyboardInterrupt
        return self.made("failed", 0) if self.ends == "prepared" else None

    def turn(self) -> bool:
        self.log.append(f"{self.name} turn")
        self.rounds -= 1
        if self.ends == "turn":
            raise KeyboardInterrupt
        return self.rounds > 0

    def outcome(self, interleaved: int) -> Outcome:
        return self.made("ok", interleaved)

    def close(self) -> None:
        self.log.append(f"{self.name} closed")

    def made(self, status: str, interleaved: int) -> Outcome:
        self.log.append(f"{self.name} {status} beside {interleaved}")
        return Outcome({"route": self.name, "status": status})


@pytest.fixture
def plenty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "scarce", lambda: False)


@pytest.mark.usefixtures("plenty")
def test_cases_take_turns_once_all_are_prepared() -> None:
    log: list[str] = []
    outcomes = interleaved([Fake("a", log), Fake("b", log, rounds=3), Fake("c", log, rounds=1)])
    assert [outcome.row["route"] for outcome in outcomes] == ["a", "b", "c"]
    assert log == [
        *("a prepared", "b prepared", "c prepared"),
        *("a turn", "b turn", "c turn", "a turn", "b turn", "b turn"),
        *("a ok beside 3", "b ok beside 3", "c ok beside 3"),
    ]


@pytest.mark.usefixtures("plenty")
def test_what_fails_or_takes_long_waits_for_nobody() -> None:
    log: list[str] = []
    outcomes = interleaved([Fake("a", log, rounds=1), Fake("b", log, ends="prepared"), Fake("c", log, long=True)])
    assert [outcome.row["route"] for outcome in outcomes] == ["b", "c", "a"]
    assert log == [
        *("a prepared", "b prepared", "b failed beside 0"),
        *("c prepared", "c turn", "c turn", "c ok beside 1", "a turn", "a ok beside 1"),
    ]


def test_no_case_waits_where_memory_is_scarce(monkeypatch: pytest.MonkeyPatch) -> None:
    for left, whole, beside in ((40, 100, 1), (60, 100, 2), (None, 100, 2), (40, None, 2)):
        monkeypatch.setattr(running, "available_bytes", lambda left=left: left)
        monkeypatch.setattr(running, "total_bytes", lambda whole=whole: whole)
        log: list[str] = []
        assert len(list(interleaved([Fake("a", log), Fake("b", log)]))) == 2
        assert f"a ok beside {beside}" in log


@pytest.mark.usefixtures("plenty")
@pytest.mark.parametrize("ends", ["interrupt", "turn"])
def test_an_interrupt_ends_every_case_that_waits(ends: str) -> None:
    log: list[str] = []
    with pytest.raises(KeyboardInterrupt):
        list(interleaved([Fake("a", log), Fake("b", log, ends=ends), Fake("c", log)]))
    waiting = ["a", "b"] if ends == "interrupt" else ["a", "b", "c"]
    assert [line for line in log if "closed" in line] == [f"{name} closed" for name in waiting]


@pytest.mark.usefixtures("plenty")
def test_nobody_listening_any_more_ends_every_case_that_waits() -> None:
    log: list[str] = []
    outcomes = interleaved([Fake("a", log), Fake("b", log), Fake("c", log)])
    next(outcomes)
    outcomes.close()
    assert [line for line in log if "closed" in line] == ["b closed", "c closed"]
