"""Every framework on the same problems, with one thread and in one run: results/frameworks.md and .csv.

    python -m benchmarks.frameworks            measures what is missing in results/frameworks.sqlite, then writes both
    python -m benchmarks.frameworks --again    measures everything anew, in a quarter of an hour
    --timeout 400                              seconds for a case, on a machine that is busy
    --marches                                  only marches in time; what else the table has is kept

Gradients are judged by an adjoint that is polished until |R| stagnates: at n = 4 it agrees with complex steps to 1e-14.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.column import Row
from gradient_routes.bench.cases.environment import environment
from gradient_routes.bench.cases.row import measured
from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.store.store import Store
from gradient_routes.bench.studies.options import one_problem
from gradient_routes.bench.units import duration, size
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.foreign.foreign import PHASES
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data

STORE, PAGE, TABLE = (Path("results/frameworks").with_suffix(suffix) for suffix in (".sqlite", ".md", ".csv"))
LIMIT_S = 120.0  # for a case: start, compilation, two gradients and their judgement
BARS, BLOCKS = (100,), (4, 8, 12, 16)
OURS = ["adjoint", "implicit-ad"]
ON_BAR = (
    "executable jax[strategy=implicit|unrolled] torch[strategy=implicit|unrolled]"
    " lineax[solver=tridiagonal|cg|newton|newton-unrolled] torch-fem[solver=direct|cg] taichi warp-unrolled"
).split()
ON_BLOCK = (
    "jax-fem[tolerances=default|tight] torch-fem[solver=direct|cg] dolfinx[ranks=1]"
    " dolfinx-adjoint feax[tolerances=default|tight] warp"
).split()
MARCH = "vibrating-bar[scheme={scheme},dt=0.002,steps=1000]"  # `benchmarks.march` has ten times as many steps
MARCHED = {"central-difference": ["taichi-march", "warp-march"], "newmark": ["diffrax", "torch-march"]}
LONG, KEPT = 200, ["adjoint[checkpoint=all|sqrt]"]
RANKS = ["dolfinx[ranks=2]"]  # alone: ranks that wait keep a processor busy
FAST = "adjoint adjoint[correct=yes] dolfinx dolfinx-adjoint".split()
SLOW = "torch-fem[solver=direct] warp jax-fem[tolerances=tight] feax[tolerances=tight]".split()
DIRECT = {4: FAST + SLOW, 16: FAST}
DEFAULT, TIGHT = 1e-12, 1e-14  # rtol
POLISHED = Solver(rtol=1e-14, adjoint_rtol=1e-15, polish=2)
COLUMNS = (
    "problem n route status reason name versions J error off_adjoint first_s compile_s forward_s backward_s peak_bytes"
    " tape_bytes memory_by rtol started"
).split()
WHOLE = ("n", "peak_bytes", "tape_bytes")
REAL = ("J", "error", "off_adjoint", "first_s", "compile_s", "forward_s", "backward_s", "rtol")
KEY = ("problem", "n", "route", "rtol")
NOT_MEASURED = {"status": "not measured", "reason": "run make adapters-all"}
NAMED = ("strategy", "solver", "tolerances", "ranks", "correct", "checkpoint")
LEFT_OUT = ("no", "whole")  # defaults
BUSY = 1.5  # wall over CPU time of forward solves
SECONDS = ("first_s", "compile_s", "forward_s", "backward_s")
HEAD = ("route", "first call", "compile", "forward", "backward", "peak memory", "tape", "error", "off our adjoint")


def measure(timeout: float) -> None:
    """Cases that the store lacks. Other codes time themselves: see the column `peer`."""
    measure_marches(timeout)
    for problem, sizes, peers in (("bar", BARS, (ON_BAR,)), ("block", BLOCKS, (ON_BLOCK, RANKS))):
        for selector in (f"{problem}[n={n}]" for n in sizes):
            _run(selector, OURS, timeout)
            for routes in peers:
                _run(selector, routes, timeout, "--no-timing")
    for n, routes in DIRECT.items():
        _run(f"block[n={n}]", routes, timeout, "--rtol", str(TIGHT), "--no-timing")


def measure_marches(timeout: float) -> None:
    for scheme, peers in MARCHED.items():
        selector = selected(MARCH.format(scheme=scheme), LONG)
        _run(selector, KEPT, timeout)
        _run(selector, peers, timeout, "--no-timing")


def selected(problem: str, n: int) -> str:
    """A problem of the table as it is asked for."""
    name, _, options = problem.rstrip("]").partition("[")
    return f"{name}[n={n}{options and ','}{options}]"


def _run(problem: str, routes: Sequence[str], timeout: float, *options: str) -> None:
    asked = [word for route in routes for word in ("--route", route)]
    kept = ["--store", str(STORE), "--only", "missing", "--gradient", "--json"]
    limits = ["--budget", "inf", "--timeout", str(timeout)]
    command = [str(Path(sys.executable).with_name("routes")), "run", "--problem", problem, *asked, *kept, *limits]
    done = subprocess.run([*command, *options], stdout=subprocess.DEVNULL)
    if done.returncode not in (0, 1):  # a case that fails is a row
        sys.exit(f"frameworks: {problem} ended with exit code {done.returncode} - see what it says above")


@dataclass(frozen=True)
class References:
    """Of one problem at its start: a polished gradient, and that of our adjoint at default tolerances."""

    polished: Array
    ours: Array


@cache
def references(problem: str, n: int) -> References:
    """Where gradients of a problem with n elements, or n^3, are compared with."""
    built = with_synthetic_data(one_problem(selected(problem, n))())
    p = built.parameters.start
    gradients = (adjoint.prepare(Model(built, solver), p)(p).gradient for solver in (POLISHED, Solver()))
    return References(*gradients)


def off(g: Array, reference: Array) -> float:
    """|g - g_ref| / |g_ref|."""
    return norm2(g - reference) / norm2(reference)


def record(row: Row) -> dict[str, Any]:
    """What the table has of a row."""
    problem, n, peer = named(row), row["problem_options"]["n"], row["peer"] or {}
    told = {name: row[name] for name in ("status", "reason", "first_s", "peak_bytes", "tape_bytes", "started")}
    seconds = {name: peer.get(name) for name in PHASES}
    if row["seconds"] is not None:  # timed by us
        seconds = {"forward_s": row["forward_s"]}
    if row["forward_ratio"] is not None:
        seconds["backward_s"] = row["forward_s"] * (row["forward_ratio"] - 1.0)
    of_ours = {"gradient-routes": environment()["versions"]["gradient-routes"]} if row["route"] in OURS else {}
    versions = peer.get("versions") or of_ours
    found = {
        "problem": problem,
        "n": n,
        "route": label(row["route"], row["route_options"] or {}),
        "J": row["objective"],
        **told,
        **seconds,
    }
    found |= {"versions": " ".join(f"{name} {of}" for name, of in versions.items()), "memory_by": row["memory_method"]}
    found |= {"name": peer.get("name", "gradient-routes"), "rtol": (row["settings"] or {}).get("rtol", DEFAULT)}
    if measured(row) and row["gradient"] is not None:
        g, known = np.array(row["gradient"]), references(problem, n)
        found |= {"error": off(g, known.polished), "off_adjoint": off(g, known.ours)}
    return found


def named(row: Row) -> str:
    """The problem of a row, a march with its scheme."""
    options = row["problem_options"]
    return MARCH.format(**options) if row["problem"] == "vibrating-bar" else str(row["problem"])


def label(route: str, options: Mapping[str, Any]) -> str:
    """A route with those of its options that the comparison names."""
    given = [f"{name}={options[name]}" for name in NAMED if options.get(name, "no") not in LEFT_OUT]
    return route + (f"[{','.join(given)}]" if given else "")


def in_order(records: Sequence[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """As they are asked for, with a row for what has not been measured; then the others."""
    known = {tuple(each[name] for name in KEY): each for each in records}
    marched = [(MARCH.format(scheme=scheme), (LONG,), KEPT + peers) for scheme, peers in MARCHED.items()]
    steady = [("bar", BARS, OURS + ON_BAR), ("block", BLOCKS, OURS + ON_BLOCK + RANKS)]
    for problem, sizes, routes in (*steady, *marched):
        for n, spec in product(sizes, case.routes(routes)):
            key = (problem, n, label(spec.name, spec.options), DEFAULT)
            yield known.pop(key, dict(zip(KEY, key, strict=True)) | NOT_MEASURED)
    yield from known.values()


def page(records: Sequence[dict[str, Any]], busy: float) -> Iterator[str]:
    """The Markdown, line by line."""
    where = environment()
    yield "# Frameworks\n"
    yield (
        "The same problems, J and p in every framework, by `make adapters-all`. One run, one thread each,"
        f" {where['cpu']}, {where['cores']} processors. Every call starts from u = 0. `first call` is cold and may"
        " compile; forward, backward and memory are those of a call after it. Other frameworks measure themselves:"
        " memory is what a call takes above what its process held before, and MUMPS keeps its own; of ranks it is that"
        " of the first. Our backward time is that of the gradient less that of a forward solve, where both can be told"
        " apart.\n"
    )
    yield (
        f"Our forward solves took {busy:.1f} times their CPU time in the median"
        + (": the machine was busy, and times are too long.\n" if busy > BUSY else ".\n")
    )
    yield (
        "`error` is |g - g_ref| / |g_ref| against an adjoint polished until |R| stagnates, `off our adjoint` against"
        " ours. At rtol 1e-12 Newton's method mostly stops at one iterate in all codes, 1e-12 from the solution. They"
        " measure |R| in different norms: where ours takes a step more, the others are 1e-12 off it.\n"
    )
    for problem, n in dict.fromkeys((each["problem"], each["n"]) for each in records):
        rows = [each for each in records if (each["problem"], each["n"], each["rtol"]) == (problem, n, DEFAULT)]
        yield f"## {problem}, n = {n}\n"
        yield from table(HEAD, map(cells, rows))
    tight = [each for each in records if each["rtol"] == TIGHT]
    yield f"## Direct solvers at `--rtol {TIGHT:g}`, block\n"
    errors = ((str(each["n"]), each["route"], short(each.get("error")) or each["reason"]) for each in tight)
    yield from table(("n", "route", "error"), errors)
    yield "## Versions\n"
    about = {each["name"]: each["versions"] for each in records if each.get("versions")}
    yield from table(("measured by", "versions"), sorted(about.items()))


def cells(each: dict[str, Any]) -> tuple[str, ...]:
    """A row of a problem's table; of one that has no numbers, its reason."""
    if each.get("error") is None:
        return each["route"], f"{each['status']}: {each['reason']}", *("",) * (len(HEAD) - 2)
    times = (None if each.get(name) is None else duration(each[name]) for name in SECONDS)
    memory = (None if each[name] is None else size(each[name]) for name in ("peak_bytes", "tape_bytes"))
    return each["route"], *(it or "" for it in (*times, *memory)), short(each["error"]), short(each["off_adjoint"])


def short(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def table(head: Sequence[str], rows: Any) -> Iterator[str]:
    for row in (head, ("---",) * len(head), *rows):
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
    yield ""


def earlier() -> list[dict[str, Any]]:
    """What the table has, for cases that the store lacks."""
    if not TABLE.exists():
        return []
    with TABLE.open(newline="") as file:
        rows = [{name: read(name, text) for name, text in row.items()} for row in csv.DictReader(file)]
    return [row for row in rows if row["status"] != NOT_MEASURED["status"]]


def read(name: str, text: str) -> Any:
    """A cell of the table."""
    if not text:
        return None
    return int(text) if name in WHOLE else float(text) if name in REAL else text


def write() -> None:
    """The page and the table of what the store has."""
    rows = list(Store(STORE).latest().values())
    new = [*map(record, rows)]
    records = [*in_order([*earlier(), *new])]
    prices = [row["price_s"] / row["price_cpu_s"] for row in rows if row["price_s"] and row["price_cpu_s"]]
    PAGE.write_text("\n".join(page(records, median(prices or [1.0]))))
    with TABLE.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(records)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.frameworks")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--timeout", type=float, default=LIMIT_S)
    parser.add_argument("--marches", action="store_true")
    asked = parser.parse_args()
    if asked.again:
        STORE.unlink(missing_ok=True)
    (measure_marches if asked.marches else measure)(asked.timeout)
    write()


if __name__ == "__main__":
    main()
