"""Every problem by every exact route under loads from 1 to 1e-16: is any wrong gradient called ok?

    python -m benchmarks.loads [PART_OF_A_NAME ..]

The reference is a dense solve by NumPy: from 1e-6 on Newton's method on the problem itself, below on the linear problem
that it goes to, whose u and R_p scale with the load. A row that is not ok may be anything.
"""

from __future__ import annotations

import copy
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from gradient_routes.bench.api import run
from gradient_routes.problems.advection import Advection
from gradient_routes.problems.bar import Bar
from gradient_routes.problems.block import Block
from gradient_routes.problems.plate import Plate
from gradient_routes.problems.problem import Array, Problem, Reference
from gradient_routes.problems.rod import Rod
from gradient_routes.problems.wrapped import Wrapped
from gradient_routes.routes.synthetic_data import with_synthetic_data

ROUTES = ("tangent", "adjoint", "complex-step", "implicit-ad", "unrolled-ad")
LOADS = tuple(10.0**-i for i in range(17))
ACCURACY = 1e-8  # relative, of every gradient called ok
LINEAR = 1e-6  # below this load a problem is compared with its linear limit, from which it is off by O(load)
STEPS = 30  # of the reference's Newton iteration: more than any of these problems needs


class Loaded(Wrapped):
    """A problem whose load has been changed, so that its closed form no longer holds."""

    def reference(self, p: Array) -> Reference | None:
        return None


@dataclass(frozen=True)
class Kind:
    """A problem by its load, and the linear one that it goes to for loads that go to zero."""

    name: str
    problem: Callable[[float], Problem]
    limit: Callable[[float], Problem]
    linear: bool = False


def with_source(problem: Any, load: float) -> Problem:
    """A bar or an advection with `load` times its f."""
    other = copy.copy(problem)
    other.f = load * problem.f
    return Loaded(other)


def without_stop(bar: Bar) -> Bar:
    """The same bar, its data included, that meets nothing."""
    other = copy.copy(bar)
    other.stop, other.n_state, other.linear = None, bar.n, True
    return other


def kinds() -> Iterator[Kind]:
    """All of the registered problems, by every law and derivative that they have."""
    for stop in ("none", "penalty", "softplus", "quadratic", "multiplier"):
        bar = Bar(stop=stop)
        free = partial(with_source, without_stop(bar))
        yield Kind(f"bar[stop={stop}]", partial(with_source, bar), free, stop == "none")
    advection = partial(with_source, Advection(n=4))
    yield Kind("advection[n=4]", advection, advection, True)

    def block(load: float, **options: Any) -> Problem:
        return Block(n=2, traction=0.2 * load, **options)

    linear = partial(block, law="linear")
    for law in ("neo-hookean", "mooney-rivlin", "yeoh", "ogden", "linear"):
        yield Kind(f"block[n=2,law={law}]", partial(block, law=law), linear, law == "linear")
    for law in ("neo-hookean", "mooney-rivlin"):
        by_hand = partial(block, law=law, derivatives="hand")
        yield Kind(f"block[n=2,law={law},derivatives=hand]", by_hand, linear)
    yield Kind("block[n=2,load=follower]", lambda load: Block(n=2, traction=0.2 * load, load="follower"), linear)

    def plate(load: float, **options: Any) -> Problem:
        return Plate(nx=3, ny=2, traction=0.2 * load, **options)

    for kind in ("plane-stress", "plane-strain", "axisymmetric"):
        linear = partial(plate, law="linear", kind=kind)
        for law in ("neo-hookean", "linear"):
            yield Kind(f"plate[kind={kind},law={law}]", partial(plate, law=law, kind=kind), linear, law == "linear")

    def rod(load: float) -> Problem:
        return with_synthetic_data(Rod(n=4, flux=2e4 * load))

    yield Kind("rod[n=4,flux]", rod, rod, True)


def exact(kind: Kind, load: float) -> tuple[Array, float]:
    """dJ/dp (n_p,) and how far it may be off, relative."""
    small = load < LINEAR
    problem = (kind.limit if small else kind.problem)(load)
    p = problem.parameters.start
    u = problem.initial(p)
    for _ in range(STEPS):
        u = u - np.linalg.solve(dense(problem.tangent(u, p), len(u)), problem.residual(u, p))
    lin = problem.linearize(u, p)
    lam = np.linalg.solve(dense(problem.tangent(u, p), len(u)).T, -lin.J_u)
    return lin.J_p + lin.R_p.T @ lam, 10.0 * load if small and not kind.linear else 0.0


def dense(A: Any, n: int) -> Array:
    """A matrix of any kind by its products, (n, n)."""
    return np.stack([A @ e for e in np.eye(n)], axis=1)


def judged(kind: Kind, loads: Sequence[float] = LOADS, routes: Sequence[str] = ROUTES) -> Iterator[dict[str, Any]]:
    """One record a case: what it was called, how wrong it is, and whether that is a wrong gradient called ok."""
    for load in loads:
        g, nonlinear = exact(kind, load)
        rows = run(kind.problem(load), routes, timing=False)
        for row in rows.to_dict("records"):
            error = None
            if isinstance(row["gradient"], str):
                error = float(np.linalg.norm(np.array(json.loads(row["gradient"])) - g) / np.linalg.norm(g))
            wrong = row["status"] == "ok" and (error is None or error > ACCURACY + nonlinear)
            about = {"problem": kind.name, "load": load, "route": row["route"], "status": row["status"]}
            yield about | {"error": error, "wrong": wrong, "reason": row["reason"]}


def main(parts: Sequence[str]) -> int:
    found = []
    for kind in kinds():
        if not parts or any(part in kind.name for part in parts):
            of_kind = list(judged(kind))
            for record in of_kind:
                if record["wrong"]:
                    print("WRONG", *record.values(), flush=True)
            found += of_kind
            print(counted(kind.name, of_kind), flush=True)
    print(counted("all", found))
    return 1 if any(record["wrong"] for record in found) else 0


def counted(name: str, found: Sequence[dict[str, Any]]) -> str:
    wrong, refused = sum(r["wrong"] for r in found), sum(r["status"] != "ok" for r in found)
    largest = max((r["error"] for r in found if r["status"] == "ok" and r["load"] >= LINEAR), default=0.0)
    return f"{name}: {len(found)} cases, {refused} not ok, {wrong} wrong under ok; the largest error is {largest:.1e}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
