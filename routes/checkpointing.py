"""States of a march in backward order, with few of them kept: which to keep, and what has to be computed again.

Reversing step t takes u_t, which is at hand from step t + 1, and u_{t-1}, which is kept or computed again.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import comb

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

March = Callable[[int, Array], Array]  # (t, u_{t-1}) -> u_t
Step = tuple[int, Array, Array]  # t, u_{t-1}, u_t
CHOICES = "whole, all, none, sqrt, every=K or revolve=S"


@dataclass(frozen=True)
class Schedule:
    """all        every state is kept
    every      those after 0, k, 2 k, .. steps, and on the way back those of one interval (`sqrt`: k = sqrt(T))
    revolve    s of them: binomial checkpointing (Griewank & Walther 2000); s = 1 is `none`, the initial state alone
    """

    kind: str
    count: int = 0

    @classmethod
    def of(cls, text: str, steps: int, who: str) -> Schedule:
        """From `all`, `none`, `sqrt`, `every=K` or `revolve=S`. Raises InputError."""
        named = {"all": cls("every", 1), "none": cls("revolve", 1), "sqrt": cls("every", math.isqrt(steps - 1) + 1)}
        if text in named:
            return named[text]
        found = re.fullmatch(r"(every|revolve)=(\d{1,9})", text)
        if found is None:
            raise InputError(f"{who}: checkpoint={text} - choose {CHOICES}")
        kind, count = found[1], int(found[2])
        if not 1 <= count <= steps:
            raise InputError(f"{who}: checkpoint={text} of {steps} steps - choose 1 to {steps}")
        return cls(kind, count)

    def recomputed(self, steps: int) -> int:
        """Steps that are marched again: (k - 1) floor((T - 1)/k) for every=k; for revolve=s
        r T - C(s + r, r - 1) - T + 1, r the least with C(s + r, s) >= T.
        """
        if self.kind == "every":
            return (self.count - 1) * ((steps - 1) // self.count)
        s, r = self.count, 0
        while comb(s + r, s) < steps:
            r += 1
        return r * steps - comb(s + r, r - 1) - steps + 1 if r else 0

    def backwards(self, march: March, u_0: Array, steps: int) -> Iterator[Step]:
        """t, u_{t-1} and u_t for t = T..1."""
        if self.kind == "every":
            return by_intervals(march, u_0, steps, self.count)
        return reverse(march, u_0, 0, steps, self.count, None)


def by_intervals(march: March, u_0: Array, steps: int, k: int) -> Iterator[Step]:
    """Steps T..1, with u_0, u_k, u_2k, .. kept, and all states of the interval that is reversed."""
    kept, begin = [u_0], (steps - 1) // k * k
    for first in range(0, begin, k):
        kept.append(marched(march, kept[-1], first, first + k)[-1])
    states = marched(march, kept.pop(), begin, steps)
    while True:
        while len(states) > 1:
            u = states.pop()
            yield begin + len(states), states[-1], u
        if not kept:
            return
        begin -= k
        states = [*marched(march, kept.pop(), begin, begin + k - 1), states[0]]


def marched(march: March, u: Array, begin: int, end: int) -> list[Array]:
    """u_begin..u_end."""
    states = [u]
    for t in range(begin + 1, end + 1):
        states.append(march(t, states[-1]))
    return states


def reverse(march: March, u: Array, begin: int, end: int, slots: int, at_end: Array | None) -> Iterator[Step]:
    """Steps end..begin + 1 from u = u_begin, with `slots` states kept, u among them; at_end: u_end, if it is known."""
    while end > begin:
        ahead = split(end - begin, slots) if slots > 1 else 0
        if ahead:
            middle = u
            for t in range(begin + 1, begin + ahead + 1):
                middle = march(t, middle)
            yield from reverse(march, middle, begin + ahead, end, slots - 1, at_end)
            end, at_end = begin + ahead, middle
            continue
        before = u
        for t in range(begin + 1, end):
            before = march(t, before)
        yield end, before, march(end, before) if at_end is None else at_end
        end, at_end = end - 1, before


def split(length: int, slots: int) -> int:
    """Steps to march before the next state is kept, so that as few as possible are marched again; 0: none is."""
    if length < 2:
        return 0
    r = 0
    while comb(slots + r, slots) < length:
        r += 1
    return min(comb(slots + r - 1, slots), length - comb(slots + r - 2, slots - 1))
