"""States of a march in backward order, with few of them kept: which to keep, and what has to be computed again.

Reversing step t takes u_t, which is at hand from step t + 1, and u_{t-1}, which is kept or computed again.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import comb

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

March = Callable[[int, int, Array], Array]  # (t_0, t_1, u_{t_0}) -> u_{t_0}..u_{t_1}, (t_1 - t_0 + 1, n)
Stretch = tuple[int, Array]  # t_0, u_{t_0}..u_{t_1}
CHOICES = "whole, all, none, sqrt, every=K or revolve=S"


@dataclass(frozen=True)
class Schedule:
    """every      those after 0, k, 2 k, .. steps, and on the way back those of one interval; `all`: k = T, `sqrt`:
               k = sqrt(T)
    revolve    s of them: binomial checkpointing (Griewank & Walther 2000); s = 1 is `none`, the initial state alone
    """

    kind: str
    count: int = 0

    @classmethod
    def of(cls, text: str, steps: int, who: str) -> Schedule:
        """From `all`, `none`, `sqrt`, `every=K` or `revolve=S`. Raises InputError."""
        named = {"all": cls("every", steps), "none": cls("revolve", 1), "sqrt": cls("every", math.isqrt(steps - 1) + 1)}
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

    def kept(self, steps: int) -> int:
        """States held at once, u_0 among them: floor((T - 1)/k) and those of the last interval or k for every=k, the
        longer; s for revolve=s. The state before and after the step that is reversed come on top.
        """
        if self.kind == "revolve":
            return self.count
        intervals = (steps - 1) // self.count
        return intervals + max(steps - intervals * self.count + 1, self.count if intervals else 0)

    def backwards(self, march: March, u_0: Array, steps: int, together: int = 1) -> Iterator[Stretch]:
        """t_0 and u_{t_0}..u_{t_1} of steps T..1, `together` steps at once where they are at hand."""
        if self.kind == "every":
            yield from by_intervals(march, u_0, steps, self.count, together)
        else:
            yield from reverse(march, u_0, 0, steps, self.count, None, together)


def by_intervals(march: March, u_0: Array, steps: int, k: int, together: int) -> Iterator[Stretch]:
    """Steps T..1, with u_0, u_k, u_2k, .. kept, and all states of the interval that is reversed."""
    kept, begin = [u_0], (steps - 1) // k * k
    for first in range(0, begin, k):
        kept.append(advanced(march, kept[-1], first, first + k, together))
    states, after = march(begin, steps, kept.pop()), np.empty((0, len(u_0)))  # after: u_end, where it is not in states
    while True:
        for first in range(0, len(states) + len(after) - 1, together)[::-1]:
            at_hand = states[first : first + together + 1]
            yield begin + first, np.concatenate([at_hand, after]) if len(at_hand) <= together else at_hand.copy()
        if not kept:
            return
        begin -= k
        after = states[:1].copy()
        del states, at_hand  # before others take their place
        states = march(begin, begin + k - 1, kept.pop())


def advanced(march: March, u: Array, begin: int, end: int, together: int) -> Array:
    """u_end from u = u_begin, with no more than `together` states between them."""
    for first in range(begin, end, together):
        u = march(first, min(first + together, end), u)[-1].copy()  # a view would keep them all
    return u


def reverse(
    march: March, u: Array, begin: int, end: int, slots: int, at_end: Array | None, together: int
) -> Iterator[Stretch]:
    """Steps end..begin + 1 from u = u_begin, with `slots` states kept, u among them; at_end: u_end, if it is known."""
    while end > begin:
        ahead = split(end - begin, slots) if slots > 1 else 0
        if ahead:
            middle = advanced(march, u, begin, begin + ahead, together)
            yield from reverse(march, middle, begin + ahead, end, slots - 1, at_end, together)
            end, at_end = begin + ahead, middle
            continue
        before = advanced(march, u, begin, end - 1, together)
        yield end - 1, march(end - 1, end, before) if at_end is None else np.stack([before, at_end])
        end, at_end = end - 1, before


def split(length: int, slots: int) -> int:
    """Steps to march before the next state is kept, so that as few as possible are marched again; 0: none is."""
    if length < 2:
        return 0
    r = 0
    while comb(slots + r, slots) < length:
        r += 1
    return min(comb(slots + r - 1, slots), length - comb(slots + r - 2, slots - 1))
