"""The cost of a gradient as counted work: declared by formulas, measured by counting, compared by ==."""

from __future__ import annotations

import operator
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Work:
    """Numbers of expensive operations.

    forward_solves     solves of R(u, p) = 0 from start to finish
    newton_iterations  steps inside them (a chord step on given factors counts as one)
    residuals          evaluations of R
    matvecs            products with R_u or R_u^T, traced iterations included
    assemblies         assemblies of R_u
    factorizations     numeric factorizations of R_u, all its load cases together. Not those of R_u^T that PARDISO makes
                       for the first transposed substitution with a matrix that is not symmetric
    solves             substitutions with factors of R_u, one per right-hand side
    transposed_solves  substitutions with factors of R_u^T, one per right-hand side
    steps              forward in time, of transient problems, repeated ones included
    """

    forward_solves: int = 0
    newton_iterations: int = 0
    residuals: int = 0
    matvecs: int = 0
    assemblies: int = 0
    factorizations: int = 0
    solves: int = 0
    transposed_solves: int = 0
    steps: int = 0

    def __add__(self, other: Work) -> Work:
        return Work(*map(operator.add, vars(self).values(), vars(other).values()))

    def __sub__(self, other: Work) -> Work:
        return Work(*map(operator.sub, vars(self).values(), vars(other).values()))

    def __rmul__(self, times: int) -> Work:
        return Work(*(times * a for a in vars(self).values()))


KINDS = tuple(f.name for f in fields(Work))


class Tally:
    """Counts the work of a Model. It only grows: subtract the `work` before from the `work` after."""

    def __init__(self) -> None:
        self._counts = dict.fromkeys(KINDS, 0)

    def count(self, kind: str, times: int = 1) -> None:
        self._counts[kind] += times

    @property
    def work(self) -> Work:
        """The counts so far, as a value that later counting does not change."""
        return Work(**self._counts)
