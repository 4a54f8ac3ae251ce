"""What a gradient costs in time: linear, Newmark, N = 200, T = 10 000; ours, and the same steps in other frameworks.

    python -m benchmarks.march                       in a few minutes
    --elements 20 --steps 100                        smaller
    --peers diffrax torch-march                      these beside ours, where their environments are

Times are CPU times, of all threads, within one run. Memory is the peak of a call above what was held before (VmHWM); of
another framework it is that of a second call in a process of its own, so that neither imports nor compilation count.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import process_time
from typing import Any

import numpy as np
import psutil
from rich.table import Table

from gradient_routes.bench.execution.memory import peak_of
from gradient_routes.bench.render.terminal.tables import console
from gradient_routes.bench.units import duration, size
from gradient_routes.problems.problem import Array
from gradient_routes.problems.vibrating_bar import VibratingBar
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.foreign.command import Command
from gradient_routes.routes.foreign.foreign import Foreign
from gradient_routes.routes.foreign.manifest import manifest, shipped
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.march import March
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.route import Route
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

ELEMENTS, STEPS, SLOTS = 200, 10_000, 100
DT = 0.002  # [s]: the wave passes the bar 20 times
PEERS = ("diffrax", "torch-march")
REPEATS = 3
STOPS = ("none", "softplus", "quadratic", "penalty")
EXACT: tuple[tuple[Route, dict[str, Any]], ...] = (
    (tangent, {}),
    (adjoint, {}),
    (adjoint, {"checkpoint": "sqrt"}),
    (unrolled_ad, {}),
    (implicit_ad, {}),
    (implicit_ad, {"checkpoint": "sqrt"}),
)


@dataclass
class Cost:
    """Of one way to the gradient, or of the march alone: [s] of CPU, bytes, steps taken."""

    what: str
    seconds: float
    peak: int
    steps: int | None = None
    gradient: Array | None = None


def ours(bar: VibratingBar) -> Iterator[Cost]:
    """The march alone, then every way back; prepared, called once, then timed."""
    p, slots = bar.parameters.start, min(SLOTS, bar.steps)

    def march() -> None:
        forward, u = March(Model(bar), p), bar.initial_state(p)
        for t in range(0, bar.steps, bar.together):
            u = forward(t, min(t + bar.together, bar.steps), u)[-1]

    yield cost("march, forward", march)
    for route, options in ways(slots):
        model = Model(bar)
        gradient = partial(route.prepare(model, p, **options), p)
        before = model.tally.work.steps
        g, steps = gradient().gradient, model.tally.work.steps - before
        yield replace(cost(named(route, options), gradient), steps=steps, gradient=g)


def ways(slots: int) -> Iterator[tuple[Route, dict[str, Any]]]:
    """To the gradient."""
    for checkpoint in ("whole", "all", "sqrt", f"revolve={slots}"):
        yield adjoint, {"checkpoint": checkpoint}
    for checkpoint in ("whole", "sqrt"):
        yield implicit_ad, {"checkpoint": checkpoint}
    yield unrolled_ad, {}
    yield unrolled_ad, {"checkpoint": slots}


def cost(what: str, call: Callable[[], Any]) -> Cost:
    call()
    seconds = []
    for _ in range(REPEATS):
        start = process_time()
        call()
        seconds.append(process_time() - start)
    return Cost(what, min(seconds), peak_of(call)[0])


def theirs(bar: VibratingBar, name: str) -> Cost | str:
    """Another framework's second gradient, the first compiles; or why there is none."""
    found, p = manifest(shipped()[name]), bar.parameters.start
    if not found.ready:
        return f"{name} has no environment here: routes environments create {name}"
    foreign = Foreign(Command(found.command(found.defaults), found.defaults), name, bar)
    process, seconds = psutil.Process().children()[-1], []
    for _ in range(2):
        before = sum(process.cpu_times()[:2])
        result = foreign.gradient(p, Solver())
        seconds.append(sum(process.cpu_times()[:2]) - before)
    return Cost(name, seconds[-1], int((result.peer or {})["peak_bytes"]), gradient=result.gradient)


def named(route: Route, options: dict[str, Any]) -> str:
    return route.name + "".join(f"[{name}={value}]" for name, value in options.items())


def off(g: Array, reference: Array) -> float:
    """|g - g_ref| / |g_ref|."""
    return float(np.linalg.norm(g - reference) / np.linalg.norm(reference))


def errors(stop: str, steps: int) -> dict[str, float]:
    """Of the exact routes against complex step, N = 8, with a stop that yields."""
    bar = with_synthetic_data(VibratingBar(steps=steps, stop=stop))  # type: ignore[arg-type]
    p = bar.parameters.start
    expected = complex_step.prepare(Model(bar), p)(p).gradient
    return {named(route, of): off(route.prepare(Model(bar), p, **of)(p).gradient, expected) for route, of in EXACT}


def table_of_costs(costs: Sequence[Cost], steps: int) -> Table:
    forward, kept = costs[0], next(each for each in costs if each.what == "adjoint[checkpoint=all]")
    table = Table(box=None, pad_edge=False)
    for name in ("", "CPU time", "a step", "/ forward", "memory", "all /", "steps again", "gradient"):
        table.add_column(name, justify="right" if name else "left")
    for each in costs:
        again = "" if each.steps is None else str(each.steps - steps)
        g = each.gradient
        equal = (
            "" if g is None else "same bits" if np.array_equal(g, kept.gradient) else f"off {off(g, kept.gradient):.1e}"
        )
        times = duration(each.seconds), duration(each.seconds / steps), f"{each.seconds / forward.seconds:.2f}"
        table.add_row(each.what, *times, size(each.peak), f"{kept.peak / max(1, each.peak):.1f}", again, equal)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.march")
    parser.add_argument("--elements", type=int, default=ELEMENTS)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--peers", nargs="*", default=PEERS, choices=sorted(shipped()))
    parser.add_argument("--stops-at", type=int, default=60, help="steps of the bar with stops")
    asked = parser.parse_args()
    out = console()
    bar = with_synthetic_data(VibratingBar(n=asked.elements, steps=asked.steps, dt=DT * ELEMENTS / asked.elements))
    found = [*ours(bar)]
    for name in asked.peers:
        peer = theirs(bar, name)
        found.append(peer) if isinstance(peer, Cost) else out.print(peer)
    out.print(f"vibrating-bar, newmark, n = {bar.n}, {bar.steps} steps")
    out.print(table_of_costs(found, bar.steps))
    out.print(f"\nerror of gradients against complex step, n = 8, {asked.stops_at} steps")
    table = Table(box=None, pad_edge=False)
    judged = {stop: errors(stop, asked.stops_at) for stop in STOPS}
    for name in ("", *STOPS):
        table.add_column(f"stop={name}" if name else "", justify="right" if name else "left")
    for way in judged["none"]:
        table.add_row(way, *(f"{judged[stop][way]:.1e}" for stop in STOPS))
    out.print(table)


if __name__ == "__main__":
    main()
