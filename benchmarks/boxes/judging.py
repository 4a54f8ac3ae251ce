"""Check boxes, in processes, and say what was misjudged."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import chain
from multiprocessing import get_context

from benchmarks.boxes.box import Box, Truth
from benchmarks.boxes.families import FAMILIES
from gradient_routes.bench.verification.api import check
from gradient_routes.problems.errors import InputError

CONVICTING = frozenset({"wrong-gradient", "inconsistent-discretization", "unrepeatable"})
REFUSED = "refused"  # instead of a verdict, where `check` does not take the box
Fault = str  # "", or one of FAULTS
FAULTS = ("acquitted", "convicted", "open", "other")


@dataclass(frozen=True)
class Judged:
    """One box and its verdict.

    named  right components that are named wrong
    """

    family: str
    kind: str
    box: str
    seed: int
    truth: Truth
    knowable: bool
    expect: tuple[str, ...]
    verdict: str
    says: str
    named: tuple[int, ...]
    calls: int
    gradients: int

    @property
    def id(self) -> str:
        """What --only selects it by."""
        return f"{self.family}/{self.box}@{self.seed}"

    @property
    def fault(self) -> Fault:
        """How the verdict is wrong; empty where it is right."""
        if self.verdict in self.expect:
            return ""
        if self.verdict == "agrees":
            return "acquitted"
        if self.truth == "right":
            return "convicted" if self.verdict in CONVICTING else "other"
        return "open" if self.knowable and self.verdict not in CONVICTING else "other"


def judge(box: Box, family: str, kind: str, seed: int) -> Judged:
    """Check one box at the default plan."""
    named: tuple[int, ...] = ()
    calls = gradients = 0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = check(box.objective, box.gradient, box.start, name=box.name, **box.options)
        verdict, says, calls, gradients = found.verdict, found.says, found.calls, found.gradients
        if box.truth != "right" and box.wrong is not None and verdict in CONVICTING:
            named = tuple(w["index"] for w in found.as_dict()["worst_components"] if w["index"] not in box.wrong)
    except InputError as refusal:
        verdict, says = REFUSED, str(refusal)
    about = (box.name, seed, box.truth, box.knowable, tuple(sorted(box.expect)))
    return Judged(family, kind, *about, verdict, says, named, calls, gradients)


def judge_family(name: str, only: str, seed: int) -> list[Judged]:
    """All boxes of a family whose id contains `only`."""
    family = FAMILIES[name]
    chosen = [box for box in family.boxes(seed) if only in f"{name}/{box.name}@{seed}"]
    return [judge(box, name, family.kind, seed) for box in chosen]


def judge_all(seeds: int, only: str, jobs: int) -> list[Judged]:
    """All boxes of seeds 0, 1, ... in the order of families, whatever process came first."""
    names, numbers = zip(*((name, seed) for name in FAMILIES for seed in range(seeds)), strict=True)
    task = partial(_task, only)
    if jobs == 1:
        return list(chain.from_iterable(map(task, names, numbers)))
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        return list(chain.from_iterable(pool.map(task, names, numbers, chunksize=4)))


def _task(only: str, name: str, seed: int) -> list[Judged]:
    return judge_family(name, only, seed)


def misjudged(found: Iterable[Judged]) -> Iterator[Judged]:
    return (judged for judged in found if judged.fault or judged.named)
