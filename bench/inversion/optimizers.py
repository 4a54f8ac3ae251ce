"""Optimizers, SciPy's and optax's, each told of accepted steps; why each came to its end, in a sentence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.diagnosis import explained
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.objective import Objective
from gradient_routes.problems.problem import Array

Name = Literal["lbfgs", "gauss-newton", "levenberg-marquardt", "trust", "descent", "adam"]
DIVERGED = 1e3  # times J at the start
FALLEN = 1e6  # times that, below zero
MEMORY = 20  # pairs of steps and changes of the gradient that L-BFGS keeps
OUT_OF_ITERATIONS = 1  # L-BFGS-B's status; any other end is a line search that came back without a step


@dataclass(frozen=True)
class Limits:
    """iterations at most; tolerance on |dJ/dx|, relative to the start; rate of steps that are not searched for."""

    iterations: int = 200
    tolerance: float = 1e-8
    rate: float = 0.1


class Ended(StopIteration):
    """A reason to stop that an optimizer does not know of."""


def accept(objective: Objective, history: History, limits: Limits, x: Array) -> None:
    """A step is taken: on record, and looked at. Raises Ended."""
    found = objective.at(x)
    history.take(found)
    objective.accept(x)
    if found.J < -FALLEN * objective.J_0:
        raise Ended(f"J falls without bound: J = {found.J:.3g} after {objective.J_0:.3g} - it is no sum of squares")
    if found.J > DIVERGED * objective.J_0:
        raise Ended(f"diverging: J = {found.J:.3g} is {found.J / objective.J_0:.3g} times that of the start")
    if norm2(found.by_x) <= limits.tolerance * objective.slope_0:
        raise Ended(f"converged: |dJ/dp| is {limits.tolerance:g} of that at the start")


def lbfgs(objective: Objective, history: History, limits: Limits) -> str:
    """Limited-memory BFGS, a strong-Wolfe line search (Moré & Thuente 1994): SciPy's L-BFGS-B, without bounds."""
    from scipy.optimize import minimize

    watch = Watching(lambda x: accept(objective, history, limits, x))
    most = {"maxiter": limits.iterations, "maxfun": 20 * limits.iterations}
    options: Any = {**most, "maxcor": MEMORY, "ftol": 0.0, "gtol": 0.0}  # when to stop is ours to say
    result: Any = minimize(objective, start_of(objective), jac=True, method="L-BFGS-B", callback=watch, options=options)
    return watch.end or (spent(limits) if result.status == OUT_OF_ITERATIONS else explained(objective))


def descent(objective: Objective, history: History, limits: Limits) -> str:
    """Steepest descent with a strong-Wolfe line search, SciPy's: to watch, not to use."""
    from scipy.optimize import line_search

    def value(x: Array) -> float:
        return objective(x)[0]

    def slope(x: Array) -> Array:
        return objective(x)[1]

    x, before = start_of(objective), None
    for _ in range(limits.iterations):
        J, g = objective(x)
        step, *_ = line_search(value, slope, x, -g, gfk=g, old_fval=J, old_old_fval=before, maxiter=20)
        if step is None:
            return explained(objective)
        x, before = x - step * g, J
        try:
            accept(objective, history, limits, x)
        except Ended as end:
            return str(end)
    return spent(limits)


def adam(
    objective: Objective,
    history: History,
    limits: Limits,
    batch: Callable[[Array], Array] | None = None,
    every: int = 1,
) -> str:
    """Adam (Kingma & Ba 2015), optax's: no line search, so that gradients of parts of J will do.

    `batch`: dJ/dx of a random part of the load cases, the whole being looked at `every` so many steps; None: the whole.
    """
    import optax

    rule = optax.adam(limits.rate)
    x = start_of(objective)
    state: Any = rule.init(x)
    for k in range(1, limits.iterations + 1):
        try:
            g = objective(x)[1] if batch is None else batch(x) / objective.J_0
            step, state = rule.update(g, state, x)
            x = np.asarray(x + step, dtype=np.float64)
            if k % every and k < limits.iterations:
                continue
            found = objective.at(x)
            if found.outside is not None:
                raise Ended(f"stopped outside: {found.outside} - take a smaller --rate")
            accept(objective, history, limits, x)
        except Ended as end:
            return str(end)
    return spent(limits)


def start_of(objective: Objective) -> Array:
    assert objective.accepted is not None
    return objective.accepted.x.copy()


class Watching:
    """SciPy's callback, which it tells by the name of its argument; `end` is why it stopped the optimizer."""

    def __init__(self, take: Callable[[Array], None]) -> None:
        self.take, self.end = take, ""

    def __call__(self, intermediate_result: Any) -> None:
        try:
            self.take(np.asarray(intermediate_result.x))
        except Ended as end:
            self.end = str(end)
            raise


def spent(limits: Limits) -> str:
    return f"not converged after {limits.iterations} iterations - give more --iterations"


def optimizer(name: Name) -> Callable[..., str]:
    """(objective, history, limits) -> why it ended."""
    from gradient_routes.bench.inversion import least_squares

    return {
        "lbfgs": lbfgs,
        "descent": descent,
        "adam": adam,
        "gauss-newton": least_squares.gauss_newton,
        "levenberg-marquardt": least_squares.levenberg_marquardt,
        "trust": least_squares.trust,
    }[name]
