"""Projective dynamics against Newton's method, in time and at rest: CPU time of one thread, ratios within one run.

    OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python -m benchmarks.projective          20 minutes beside other work

Each pair is timed in turns, three times; the median of the ratios is printed. In time: impact-block[law=arap] until it
has touched. At rest: block[law=arap] under its traction, by global steps with the Laplacian alone.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from statistics import median
from time import process_time
from typing import Any

import numpy as np

from gradient_routes.problems.block import Block
from gradient_routes.problems.impact_block import ImpactBlock
from gradient_routes.problems.mechanics.global_step import global_step
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.anderson import Anderson
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import norm
from gradient_routes.routes.projective import MEMORY, Projective, projective
from gradient_routes.routes.solvers.global_step import GlobalFactors
from gradient_routes.routes.synthetic_data import with_synthetic_data

MARCHES = [(4, 0.03), (8, 0.03), (8, 0.1), (8, 0.2), (12, 0.03)]  # cells along every edge, h [s]
AT_REST = (8, 12)
LONG, TURNS = 0.36, 3  # [s]


def seconds(run: Callable[[], Any]) -> float:
    gc.collect()
    began = process_time()
    run()
    return process_time() - began


def ratio(run: Callable[[], Any], against: Callable[[], Any]) -> float:
    return median(seconds(run) / seconds(against) for _ in range(TURNS))


def in_time(n: int, h: float) -> str:
    steps = max(4, round(LONG / h))
    block = with_synthetic_data(ImpactBlock(n=n, law="arap", dt=h, steps=steps, sensors="everywhere"))
    p, model = block.parameters.start, Model(block)
    newton, ours = model.solve(p), Projective(model, p)
    states, _ = ours.states()
    assert norm(states.ravel() - newton.u) < 1e-10 * norm(newton.u)
    forward = ratio(lambda: Projective(model, p).states(), lambda: model.solve(p))
    exact, gradients = adjoint.prepare(model, p)(p).gradient, []
    for inner in ("cg", "plain"):
        found = projective.prepare(model, p, inner=inner)
        before = model.tally.work
        assert norm(found(p).gradient - exact) < 1e-8 * norm(exact)  # a short march depends little on moduli
        work = model.tally.work - before
        paid = ratio(lambda f=found: f(p), lambda: adjoint.prepare(model, p)(p))  # type: ignore[misc]
        gradients.append(f"{work.matvecs / steps:9.1f} {paid:8.2f}")
    k = work.newton_iterations / steps
    return f"{n:3} {h:5} {newton.work.newton_iterations / steps:8.1f} {k:8.1f} {forward:8.2f}  {'  '.join(gradients)}"


def at_rest(n: int) -> str:
    block = Block(n=n, law="arap")
    p, model, count = block.parameters.start, Model(block), 0

    def by_global_steps() -> Any:
        nonlocal count
        step = global_step(block.solid, p, 1.0, 0.0, np.zeros(0, dtype=int), lambda u: np.zeros(0))
        factors, accelerated = GlobalFactors(step, model.factorize(step.A)), Anderson(MEMORY)
        u, count = block.initial(p), 0
        R = block.residual(u, p)
        scale = norm(R)
        while norm(R) > model.solver.rtol * scale:
            u, count = accelerated(u, -factors.solve(R, np.zeros(0))), count + 1
            R = block.residual(u, p)
        return u

    newton = model.solve(p)
    assert norm(by_global_steps() - newton.u) < 1e-8 * norm(newton.u)
    paid = ratio(by_global_steps, lambda: model.solve(p))
    return f"{n:3}     - {newton.work.newton_iterations:8.1f} {count:8.1f} {paid:8.2f}"


def main() -> None:
    print("        iterations a step      time /    adjoint: cg      adjoint: plain")
    print("  n     h   Newton   global   Newton  products gradient  products gradient")
    for n, h in MARCHES:
        print(in_time(n, h), flush=True)
    for n in AT_REST:
        print(at_rest(n), flush=True)
    print(
        "time / Newton: of the march; gradient: of march and adjoint, over that of the adjoint by factors of every step"
    )
    print("h -: at rest")


if __name__ == "__main__":
    main()
