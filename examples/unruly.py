"""A solver as it may come from elsewhere: it crashes, hangs or takes all the memory there is."""

from __future__ import annotations

import ctypes
from typing import Annotated, Literal

import numpy as np

from gradient_routes import Array, Offers, Parameters, Problem


class Solver(Problem):
    """J = |p|^2 / 2, by code nobody should have to trust."""

    name = "unruly"
    offers = Offers.VALUE

    def __init__(
        self,
        *,
        n: Annotated[int, "parameters"] = 2,
        does: Annotated[Literal["well", "crash", "hang", "hoard"], "what becomes of a solve"] = "well",
    ) -> None:
        self.does = does
        self.parameters = Parameters(start=np.ones(n), scale=np.ones(n))

    def value(self, p: Array) -> float:
        if self.does == "crash":
            ctypes.string_at(0)  # a segmentation fault
        if self.does == "hang":
            ctypes.PyDLL(None).sleep(3600)  # in C, the interpreter locked: no signal of Python's is handled
        hoard = []
        while self.does == "hoard":
            hoard.append(np.ones(10**6))
        return float(p @ p) / 2
