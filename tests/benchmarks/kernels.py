"""Timings of pytest-benchmark against a committed baseline, which another machine may have measured.

Compared is the fastest call divided by the calibration of the same minutes (calibration.py), which a slower machine
slows as much. Work counts are exact.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from statistics import median
from typing import Any

from gradient_routes.bench.regression.finding import Finding, Judgement
from gradient_routes.bench.regression.rules import counted
from gradient_routes.bench.render.format import number
from gradient_routes.problems.errors import InputError

FACTOR = 1.6  # of 304 ratios of equal kernels (two cores, load 5) none was beyond x 1.5 of its median, 5 beyond 1.25
MARK, VERSION = "gradient-routes kernels", 1
REMEDY = "write it anew with `make benchmark-baseline`"
MALFORMED = (KeyError, TypeError, ValueError, AttributeError, ZeroDivisionError)  # what a foreign JSON may lead to


@dataclass(frozen=True)
class Kernel:
    """Of one benchmark: the fastest call in units of the calibration, and the work of a call where it was counted."""

    ratio: float
    work: dict[str, int] | None = None


Kernels = Mapping[str, Kernel]


def of_session(path: Path) -> Kernels:
    """What pytest-benchmark's JSON says, by node id. Raises InputError for a session that measured nothing."""
    benchmarks = _json(path, "a session of pytest-benchmark", "measure again").get("benchmarks")
    if not benchmarks:
        raise InputError(f"{path}: no benchmark in it - measure again")
    try:
        return {b["fullname"]: Kernel(_ratio(b), b["extra_info"].get("work")) for b in benchmarks}
    except MALFORMED as error:
        says = f"{type(error).__name__}: {error}"
        raise InputError(f"{path}: a benchmark without its time or calibration: {says} - measure again") from error


def _ratio(benchmark: Mapping[str, Any]) -> float:
    return _positive(benchmark["stats"]["min"] / min(benchmark["extra_info"]["calibration_s"]))


def _positive(ratio: Any) -> float:
    if not 0.0 < float(ratio) < inf:
        raise ValueError(f"a ratio of {ratio}")
    return float(ratio)


def read(path: Path) -> Kernels:
    """What `write` wrote. Raises InputError."""
    given = _json(path, "a baseline of kernels", REMEDY)
    if given.get(MARK) != VERSION:
        raise InputError(f"{path}: is no baseline of kernels of version {VERSION} - {REMEDY}")
    try:
        kernels = {name: Kernel(_positive(k["ratio"]), k.get("work")) for name, k in given["kernels"].items()}
    except MALFORMED as error:
        raise InputError(f"{path}: broken: {type(error).__name__}: {error} - {REMEDY}") from error
    if not kernels:
        raise InputError(f"{path}: no kernel in it - {REMEDY}")
    return kernels


def _json(path: Path, what: str, todo: str) -> Mapping[str, Any]:
    try:
        given = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: {error.strerror or error} - {todo}") from error
    except ValueError as error:
        raise InputError(f"{path}: is not {what}: {error} - {todo}") from error
    if not isinstance(given, dict):
        raise InputError(f"{path}: is not {what} - {todo}")
    return given


def write(path: Path, kernels: Kernels) -> None:
    """One line a kernel, sorted, three digits."""
    lines = []
    for name, kernel in sorted(kernels.items()):
        work = {} if kernel.work is None else {"work": {kind: n for kind, n in kernel.work.items() if n}}
        lines.append(f"{json.dumps(name)}: {json.dumps({'ratio': float(f'{kernel.ratio:.3g}')} | work)}")
    joined = ",\n".join(lines)
    path.write_text(f'{{\n"{MARK}": {VERSION},\n"kernels": {{\n{joined}\n}}\n}}\n', encoding="utf-8")


def typical(sessions: Sequence[Kernels]) -> Kernels:
    """Of several sessions the median ratio, kernel by kernel."""
    first = sessions[0]
    return {name: Kernel(median(s[name].ratio for s in sessions if name in s), k.work) for name, k in first.items()}


def again(first: Kernels, second: Kernels) -> Kernels:
    """What was measured twice at its faster: noise only adds."""
    better = {name: Kernel(min(k.ratio, first[name].ratio), k.work) for name, k in second.items() if name in first}
    return {**first, **better}


def judge(base: Kernels, new: Kernels, factor: float = FACTOR) -> list[Finding]:
    """A kernel slower by `factor`, with more work or no longer there is worse."""
    findings = []
    for name, before in base.items():
        if name not in new:
            findings.append(Finding({"name": name}, "case", "measured", None, "worse", "no longer measured"))
            continue
        findings += [_time(name, before.ratio, new[name].ratio, factor), _work(name, before.work, new[name].work)]
    findings += [Finding({"name": n}, "case", None, "measured", "shown", "new") for n in new if n not in base]
    return findings


def _time(name: str, before: float, now: float, factor: float) -> Finding:
    growth = now / before
    judgement: Judgement = "worse" if growth > factor else "better" if growth < 1 / factor else "same"
    says = f"{number(before)} -> {number(now)} calibrations: x {growth:.2f}, limit x {factor:g}"
    return Finding({"name": name}, "time", before, now, judgement, says)


def _work(name: str, before: dict[str, int] | None, now: dict[str, int] | None) -> Finding:
    if before is None or now is None:
        lost = before is not None
        return Finding({"name": name}, "work", before, now, "worse" if lost else "same", "not counted" if lost else "")
    judgement, says = counted(before, now)
    return Finding({"name": name}, "work", before, now, judgement, says)
