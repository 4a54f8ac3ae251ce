"""The rule for time: ratios to a forward solve of the same round, compared by ranks and by a factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb, inf
from statistics import median

from gradient_routes.bench.cases.samples import impossible
from gradient_routes.bench.regression.finding import Finding, Judgement
from gradient_routes.bench.regression.machines import machine_differences
from gradient_routes.bench.regression.measured import Case
from gradient_routes.bench.render.format import number, ratio

FALSE_ALARM = 0.01  # probability of any false alarm by ranks in a comparison without changes
FACTOR = 1.25  # two processes differ significantly for reasons of their own: memory layout, load of the machine
ROUNDS = 15  # fewer may all lie in one burst of other load and are not independent


@dataclass(frozen=True)
class TimeRule:
    """Slower if a rank test of all rounds says so at level `p`, and median and fastest round both differ by `factor`.

    `p` is FALSE_ALARM over the number of cases (Bonferroni). The fastest round is used as well because load of the
    machine only adds time, and more to long calls than to short ones. Of 292 pairs of equal cases on two cores at a
    load of 4 to 8 none was called slower; of those made twice as slow, 267 were.
    """

    factor: float = FACTOR
    cases: int = 1

    @property
    def p(self) -> float:
        return FALSE_ALARM / max(1, self.cases)

    def __call__(self, base: Case, new: Case) -> Finding:
        before, now = (median(case.ratios) if case.ratios else None for case in (base, new))
        why = self._uncomparable(base, new)
        if why is not None or not before or not now:
            return Finding(new.row, "time", before, now, "not-compared", why or "")
        judgement: Judgement = "same"
        if self._slower(base, new):
            judgement = "worse"
        elif self._slower(new, base):
            judgement = "better"
        says = "" if judgement == "same" else self._says(base, new, before, now)
        return Finding(new.row, "time", before, now, judgement, says)

    def _uncomparable(self, base: Case, new: Case) -> str | None:
        differences = machine_differences(base, new)
        if differences:
            return f"time, the machines differ: {'; '.join(differences)}"
        for side, case in (("base", base), ("new", new)):
            found, floor = median(case.ratios or [inf]), case.row["ratio_floor"]
            if floor is not None and impossible(found, floor):
                least = f"its counted work contains {number(floor)}"
                return f"time, unresolved in {side}: {ratio(found)} forward solves, {least} - raise --min-time"
        n, m = len(base.ratios), len(new.ratios)
        if min(n, m) < ROUNDS:
            return f"time, of {n} and {m} rounds: too few, {ROUNDS} are needed - raise --min-time"
        if least_p(n, m) > self.p:
            return f"time, of {n} and {m} rounds: too few to tell p < {self.p:.1g} by ranks - raise --min-time"
        return None

    def _slower(self, one: Case, other: Case) -> bool:
        medians = median(other.ratios) / median(one.ratios)
        fastest = (other.fastest or 0.0) / (one.fastest or inf)
        return min(medians, fastest) > self.factor and greater(other.ratios, one.ratios) < self.p

    def _says(self, base: Case, new: Case, before: float, now: float) -> str:
        slower, faster = (new, base) if now > before else (base, new)
        p = greater(slower.ratios, faster.ratios)
        sides = {"base": base, "new": new}
        unstable = [side for side, case in sides.items() if case.row["unstable"]]
        remark = f", unstable in {' and '.join(unstable)}" if unstable else ""
        return (
            f"{ratio(before)} -> {ratio(now)} forward solves: x {number(now / before)}, limit x {self.factor:g}"
            f" (ranks of {len(base.ratios)} and {len(new.ratios)} rounds: p {p:.1g}, limit {self.p:.1g}){remark}"
        )


def greater(these: Sequence[float], those: Sequence[float]) -> float:
    """p-value of `these` being greater than `those` (Mann & Whitney 1947)."""
    from scipy.stats import mannwhitneyu

    return float(mannwhitneyu(these, those, alternative="greater").pvalue)


def least_p(n: int, m: int) -> float:
    """The least p-value of a rank test of n and m values: they are completely separated."""
    return 1 / comb(n + m, n)
