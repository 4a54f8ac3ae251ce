"""One side of a comparison: the latest row of every case, times relative to a forward solve, the latest verdicts."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import Environment
from gradient_routes.bench.cases.row import ENVIRONMENTS
from gradient_routes.bench.store.cases import IDS, cases
from gradient_routes.bench.store.store import Store
from gradient_routes.problems.errors import InputError

NAMES = ("problem", "problem_options", "route", "route_options", "at", "partial")
NUMBERS = ("work", "gradient_error", "seconds", "peak_bytes", "tape_bytes", "factor_bytes", "predicted_s")
HOW = ("reference", "memory_method", "unstable", "ratio_floor", "isolated", "threads", "budget_s")
DECLARED = ("problem_declared", "route_declared")
KEPT = ("case_key", *NAMES, *DECLARED, "settings", "status", "reason", *NUMBERS, *HOW)


@dataclass(frozen=True, slots=True)
class Case:
    """The columns KEPT of a row, its environment and its times.

    ratios   seconds of the gradient / seconds of a forward solve, round by round
    fastest  the least seconds of a gradient / the least of a forward solve
    """

    row: Row
    environment: Environment
    ratios: tuple[float, ...] = ()
    fastest: float | None = None

    @property
    def name(self) -> str:
        """Problem, route, their options and p: what identifies a case of an older version."""
        return json.dumps([self.row[name] for name in NAMES], sort_keys=True)

    @property
    def key(self) -> str:
        """The key of problem, route and settings, or `name` for rows of older versions."""
        return self.row["case_key"] or self.name

    @property
    def ok(self) -> bool:
        return bool(self.row["status"] == "ok")


@dataclass(frozen=True)
class Verdict:
    """The verdict of a check on a route, or on foreign code, at p."""

    problem: str
    route: str | None
    at: str
    verdict: str

    @property
    def key(self) -> tuple[str, str, str]:
        return self.problem, self.route or "", self.at

    @property
    def case(self) -> Row:
        """As `Finding.case`; problem and route are selectors with their options."""
        return {"problem": self.problem, "route": self.route or "", "at": self.at}


@dataclass(frozen=True)
class Measured:
    """Cases and verdicts of a store or a baseline, which `source` names."""

    source: str
    cases: tuple[Case, ...]
    verdicts: tuple[Verdict, ...]


def of_store(store: Store) -> Measured:
    """The latest cases and verdicts of a store. Raises InputError where there are none."""
    found, verdicts = _cases(store), _verdicts(store)
    if not found and not verdicts:
        raise InputError(f"store {store.path}: holds no case and no verdict - run `routes run` first, or name another")
    return Measured(str(store.path), tuple(found), tuple(verdicts))


def _cases(store: Store) -> list[Case]:
    environments, latest = _environments(store), {}
    for row in cases(store, (*KEPT, *IDS)):
        case_id, environment = row.pop("case_id"), environments.get(row.pop("environment_id"), {})
        case = Case(row, environment)
        latest[case.key] = case_id, case
    times = _times(store, {case_id for case_id, _ in latest.values()})
    return [Case(case.row, case.environment, *times.get(case_id, ())) for case_id, case in latest.values()]


def _environments(store: Store) -> Mapping[str, Environment]:
    return {
        record["environment_id"]: {column.name: record[column.name] for column in ENVIRONMENTS[1:]}
        for record in store.records("environments")
    }


def _times(store: Store, of: set[int]) -> dict[int, tuple[tuple[float, ...], float]]:
    """Ratios and `fastest` by case_id; the gradient and the forward solve of one round are measured in succession."""
    seconds: defaultdict[int, dict[str, dict[int, float]]] = defaultdict(lambda: {"gradient": {}, "forward": {}})
    names, records = store.table("samples")
    case, kind, of_round, value = (names.index(name) for name in ("case_id", "kind", "round", "seconds"))
    for record in records:
        if record[case] in of and record[value] > 0:
            seconds[record[case]][record[kind]][record[of_round]] = record[value]
    return {
        case_id: (tuple(g / f[i] for i, g in gs.items() if i in f), min(gs.values()) / min(f.values()))
        for case_id, (gs, f) in ((case_id, by.values()) for case_id, by in seconds.items())
        if gs and f
    }


def _verdicts(store: Store) -> list[Verdict]:
    latest = {}
    for record in store.records("checks"):
        verdict = Verdict(record["problem"], record["route"], record["at"], record["verdict"])
        latest[verdict.key] = verdict
    return list(latest.values())
