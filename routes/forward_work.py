"""Declared work is composed of this: the work of one forward solve, and estimates for solves near it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gradient_routes.routes.newton import Newton, Solver
from gradient_routes.routes.tally import Work


@dataclass(frozen=True)
class ForwardWork:
    """The work of one cold forward solve, and estimates for others, exact once steps and products are counted.

    cold         counted for one solve at p; of a black box, the one solve
    linear       R is affine in u
    rtol         of the solver
    counted      of a whole gradient, once known: the numbers of Newton steps and refinements are taken from it
    matrix_free  products with R_u need no assembly
    newton       the steps, see Solver.newton: k that are not full take k + m substitutions with m products. Those of
                 auto are full but for cold solves
    """

    cold: Work
    linear: bool = True
    rtol: float = Solver.rtol
    counted: Work | None = None
    matrix_free: bool = False
    newton: Newton = "full"

    def polished(self) -> Work:
        """A cold solve and one step more."""
        return self.cold if self.linear else self.cold + self._newton(1)

    def full(self, times: int, polish: int) -> Work:
        """`times` cold solves near p by full steps, which complex p takes whatever the solver says."""
        if self.newton == "full":
            return self.solves(times, polish)
        steps = times * (self.cold.newton_iterations + polish)
        steps = steps if self.counted is None else self.counted.newton_iterations
        return Work(forward_solves=times, residuals=times * (1 + self.halvings())) + self._newton(steps)

    def solves(self, times: int, polish: int = 0) -> Work:
        """`times` cold solves near p, each with `polish` steps more: see Model.solve."""
        if self.newton != "full":
            return self._iterated(times, cold=times) or times * self.cold
        extra = 0 if self.linear else times * polish
        if self.counted is not None and not self.linear:
            extra = self.counted.newton_iterations - times * self.cold.newton_iterations
        return times * self.cold + self._newton(extra)

    def factors_at_solution(self) -> Work:
        """See Model.factors_at."""
        return Work() if self.linear else Work(assemblies=1, factorizations=1)

    def sweeps(self, solves: int) -> int:
        """Products of `solves` linearized solves together: estimated as one each until they are counted."""
        return solves if self.counted is None else self.counted.matvecs - self.cold.matvecs

    def renewals(self) -> int:
        """Factorizations after the forward solve."""
        return 0 if self.counted is None else self.counted.factorizations - self.cold.factorizations

    def warm(self, times: int, h: float) -> Work:
        """A polished solve and `times` from its state, where |R| ~ h: a step squares that (linear: one is enough)."""
        if self.newton == "inexact" and (iterated := self._iterated(1 + times, cold=1)):
            return iterated
        each = 1 if self.linear else max(1, math.ceil(math.log2(self._decades(h))))
        solves = Work(forward_solves=times, residuals=times, steps=times * self.cold.steps)
        return self.polished() + solves + self._newton(self._near(times * each))

    def chord(self, times: int, h: float) -> Work:
        """The same on the factors of the first: every step multiplies |R| by about h."""
        if self.newton == "inexact" and (
            iterated := self._iterated(1 + times, cold=1, directions=self.cold.newton_iterations + 1)
        ):
            return iterated
        steps = self._near(times * max(1, math.ceil(self._decades(h)) - 1))
        return self.polished() + Work(times, steps, times + steps, solves=steps, steps=times * self.cold.steps)

    def _iterated(self, solves: int, cold: int, directions: int | None = None) -> Work | None:
        """`solves` inexact ones, `cold` from scratch, R_u used by `directions` steps [all]; None if uncounted."""
        if self.counted is None:
            return None
        k, m, f = self.counted.newton_iterations, self.counted.matvecs, self.counted.factorizations
        assemblies = f if self.matrix_free else (k if directions is None else directions)
        return Work(solves, k, k + solves + cold * self.halvings(), m, assemblies, f, k + m)

    def marched_again(self, steps: int) -> Work:
        """Newton's method in `steps` steps of a march once more: in proportion, until they are counted."""
        if self.linear:
            return Work()
        k, residuals = self.cold.newton_iterations, self.cold.residuals - 1
        if self.counted is None:
            k, residuals = (n * steps // self.cold.steps for n in (k, residuals))
        else:
            k, residuals = self.counted.newton_iterations - k, self.counted.residuals - residuals - 2
        return Work(newton_iterations=k, residuals=residuals, assemblies=k, factorizations=k, solves=k)

    def marched_iterates(self, k: int, steps: int, again: int) -> Work:
        """k Newton steps in every step of a march, `again` of these taken twice, and k transposed solves in each."""
        newton = k * (steps + again)
        residuals = 1 + newton + steps + again if self.counted is None else self.counted.residuals
        return Work(1, newton, residuals, 0, newton, newton, newton, k * steps, steps + again)

    def halvings(self) -> int:
        """Residuals that a cold solve's line searches take."""
        return self.cold.residuals - self.cold.newton_iterations - self.cold.forward_solves

    def _near(self, estimate: int) -> int:
        """Newton steps of the perturbed solves together, exactly once they are counted."""
        if self.counted is None:
            return estimate
        return self.counted.newton_iterations - self.polished().newton_iterations

    def _decades(self, h: float) -> float:
        """log rtol / log h, how often the perturbation must multiply itself to vanish."""
        return math.log(self.rtol) / math.log(min(h, 0.5))

    @staticmethod
    def _newton(k: int) -> Work:
        return Work(newton_iterations=k, residuals=k, assemblies=k, factorizations=k, solves=k)
