"""Load stepping: where Newton's method fails at the full load, reach it in increments."""

from __future__ import annotations

from collections.abc import Callable

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array

SMALLEST = 1.0 / 256.0  # increment of the load that is tried


def by_load_steps(solve: Callable[[float, Array], Array], u: Array, who: str) -> Array:
    """The state at load 1 by increments of the load fraction t, from the unloaded state u.

    solve(t, u) gives the state at load t from a state u nearby, or raises NotConverged; an increment that fails is
    halved, one that succeeds is followed by a larger one. Raises NotConverged with the load that was reached.
    """
    t, dt = 0.0, 0.5
    while t < 1.0:
        try:
            u = solve(min(t + dt, 1.0), u)
        except NotConverged as failure:
            dt /= 2.0
            if dt < SMALLEST:
                reached = f"{who}: {100 * t:.3g} % of the load reached, then {failure}"
                raise NotConverged(reached, failure.history) from failure
        else:
            t, dt = min(t + dt, 1.0), 1.5 * dt
    return u
