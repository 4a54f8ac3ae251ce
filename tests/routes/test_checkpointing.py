"""Schedules: every state in its turn, and as few steps marched again as the literature says."""

from __future__ import annotations

import tracemalloc
from functools import cache

import numpy as np
import pytest

from gradient_routes.problems.errors import InputError
from gradient_routes.routes.checkpointing import Schedule


def steps_of(text: str, T: int, together: int = 1) -> int:
    """Steps marched by a schedule whose states are their own numbers."""
    marched = []

    def march(t_0: int, t_1: int, before: np.ndarray) -> np.ndarray:
        assert before[0] == t_0
        marched.extend(range(t_0, t_1))
        return np.arange(t_0, t_1 + 1)[:, None]

    seen = []
    for t_0, states in Schedule.of(text, T, "march").backwards(march, np.array([0]), T, together):
        assert 2 <= len(states) <= together + 1
        assert states[:, 0].tolist() == [*range(t_0, t_0 + len(states))]
        seen += [*range(t_0 + 1, t_0 + len(states))][::-1]
    assert seen == [*range(T, 0, -1)]
    return len(marched)


@cache
def fewest(T: int, slots: int) -> int:
    """Steps beside step T, by trying every place of the next state that is kept."""
    if T <= 1:
        return 0
    if slots == 1:
        return T * (T - 1) // 2
    return min(m + fewest(T - m, slots - 1) + fewest(m, slots) for m in range(1, T))


@pytest.mark.parametrize("T", [1, 2, 3, 7, 12, 25])
def test_steps_are_those_of_the_formula_and_the_fewest_there_can_be(T: int) -> None:
    for s in range(1, T + 1):
        again = Schedule.of(f"revolve={s}", T, "march").recomputed(T)
        assert steps_of(f"revolve={s}", T) == T + again == fewest(T, s) + 1
    for k in range(1, T + 1):
        assert steps_of(f"every={k}", T) == T + (k - 1) * ((T - 1) // k)
        assert steps_of(f"every={k}", T, together=4) == T + (k - 1) * ((T - 1) // k)
    assert steps_of("all", T, together=3) == T
    assert steps_of("none", T) == T + (T - 1) * (T - 2) // 2


def test_ten_thousand_steps_from_a_hundred_states() -> None:
    assert steps_of("revolve=100", 10_000) == 10_000 + 14_748
    assert steps_of("sqrt", 10_000) == 10_000 + 9_801


@pytest.mark.parametrize("text", ["all", "every=1", "every=4", "every=7", "sqrt", "every=29", "revolve=5", "none"])
def test_states_held_at_once_are_those_that_are_told(text: str) -> None:
    """By the allocations of a march of large states; up to seven come and go beside those that are kept."""
    n, T = 2**14, 30
    schedule = Schedule.of(text, T, "march")

    def march(t_0: int, t_1: int, before: np.ndarray) -> np.ndarray:
        return np.zeros((t_1 - t_0 + 1, n))

    u_0 = np.zeros(n)
    tracemalloc.start()
    for _ in schedule.backwards(march, u_0, T):
        pass
    held = 1 + tracemalloc.get_traced_memory()[1] / u_0.nbytes
    tracemalloc.stop()
    assert schedule.kept(T) <= held <= schedule.kept(T) + 7.1


@pytest.mark.parametrize("text", ["every=0", "revolve=11", "every=-1", "half", "revolve=", "every=1e3"])
def test_other_words_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=f"march: checkpoint={text}.* - choose"):
        Schedule.of(text, 10, "march")
