"""Optimizers of SciPy and optax, each recording its accepted steps; they return why they stopped, in a sentence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.bench.execution.references import norm2
from gradient_routes.bench.inversion.diagnosis import explained
from gradient_routes.bench.inversion.history import History
from gradient_routes.bench.inversion.objective import Evaluation, Objective, noise_level
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, Problem

Name = Literal["lbfgs", "gauss-newton", "levenberg-marquardt", "trust", "descent", "adam", "linear"]
DIVERGED = 1e3  # J, in J_0, above which a run diverges
UNBOUNDED = 1e6  # -J, in J_0, above which J has no lower bound
MEMORY = 20  # pairs of steps and gradient changes that L-BFGS keeps
FAR_BELOW = 0.5  # of the noise: a step has fitted most of it
AT_NOISE = "stopped at the noise"
SPENT = 1  # status of SciPy's minimizers: the iterations are used up; any other end is a failed line search


@dataclass(frozen=True)
class Limits:
    """iterations at most; tolerance on |dJ/dx| relative to the start or to 1/2 |d|^2; rate of the steps of adam.

    at_noise  whether to end at the first step that meets the data to their noise
    """

    iterations: int = 200
    tolerance: float = 1e-9
    rate: float = 0.1
    at_noise: bool = False


class Stopped(Exception):
    """A reason to stop that the optimizer itself does not know."""


def accept(objective: Objective, history: History, limits: Limits, x: Array) -> None:
    """Record a step. Raises Stopped where it is the last one."""
    found = objective.at(x)
    history.take(found)
    objective.accept(x)
    if found.J < -UNBOUNDED * objective.J_0:
        raise Stopped(f"J falls without bound: J = {found.J:.3g} after {objective.J_0:.3g} - it is no sum of squares")
    if found.J > DIVERGED * objective.J_0:
        raise Stopped(f"diverging: J = {found.J:.3g} is {found.J / objective.J_0:.3g} times that of the start")
    if limits.at_noise and history.met:
        raise Stopped(stopped_at_noise(history))
    if flat(objective, found, limits):
        raise Stopped(converged(objective, limits))
    if history.error_bar.hides(found):
        raise Stopped(history.error_bar.says)


def flat(objective: Objective, found: Evaluation, limits: Limits) -> bool:
    return norm2(found.by_x) <= limits.tolerance * objective.slope_scale


def converged(objective: Objective, limits: Limits) -> str:
    return f"converged: |dJ/dp| is {limits.tolerance:g} of {objective.slope_scale_is}"


def check_noise(problem: Problem, limits: Limits) -> None:
    """Raises InputError where the inversion should stop at a noise that is not known."""
    if limits.at_noise and not noise_level(problem, problem.parameters.start):
        raise InputError(f"{problem.name}: --stop-at-noise, but the noise of its data is not known - give noise=")


def stopped_at_noise(history: History) -> str:
    met = history.iterates[-1].discrepancy or 0.0
    said = f"{AT_NOISE}: the data are met to {met:.3g} of it (discrepancy principle)"
    return (
        said if met > FAR_BELOW else f"{said}; the last step was long - take --optimizer lbfgs, or weigh Phi by alpha="
    )


def minimized(objective: Objective, history: History, limits: Limits, options: Any, **method: Any) -> str:
    """By scipy.optimize.minimize."""
    from scipy.optimize import minimize

    def callback(intermediate_result: Any) -> None:
        x = np.asarray(intermediate_result.x)
        if not ("hessp" in method and np.array_equal(x, objective.accepted.x)):  # a step that a trust region rejects
            accept(objective, history, limits, x)

    more: Any = {"options": {"maxiter": limits.iterations, "gtol": 0.0, **options}, **method}
    result: Any = minimize(objective, objective.accepted.x.copy(), jac=True, callback=callback, **more)
    return spent(limits) if result.status == SPENT else explained(objective)


def lbfgs(objective: Objective, history: History, limits: Limits) -> str:
    """Limited-memory BFGS with a strong-Wolfe line search (Moré & Thuente 1994): SciPy's L-BFGS-B, without bounds."""
    options = {"maxfun": 20 * limits.iterations, "maxcor": MEMORY, "ftol": 0.0}
    return minimized(objective, history, limits, options, method="L-BFGS-B")


def descent(objective: Objective, history: History, limits: Limits) -> str:
    """Steepest descent with SciPy's strong-Wolfe line search, for comparison."""
    from scipy.optimize import line_search

    x, before = objective.accepted.x.copy(), None
    for _ in range(limits.iterations):
        J, g = objective(x)
        value, slope = (lambda x: objective(x)[0]), (lambda x: objective(x)[1])
        step, *_ = line_search(value, slope, x, -g, gfk=g, old_fval=J, old_old_fval=before, maxiter=20)
        if step is None:
            return explained(objective)
        x, before = x - step * g, J
        accept(objective, history, limits, x)
    return spent(limits)


def adam(
    objective: Objective,
    history: History,
    limits: Limits,
    batch: Callable[[Array], Array] | None = None,
    every: int = 1,
) -> str:
    """Adam (Kingma & Ba 2015), optax's: without a line search, so that gradients of parts of J suffice.

    batch  dJ/dx of a random part of the load cases; the whole J is evaluated after `every` steps
    """
    import optax

    rule = optax.adam(limits.rate)
    x = objective.accepted.x.copy()
    state: Any = rule.init(x)
    for k in range(1, limits.iterations + 1):
        g = objective(x)[1] if batch is None else batch(x) / objective.J_0
        step, state = rule.update(g, state, x)
        x = np.asarray(x + step, dtype=np.float64)
        if k % every == 0 or k == limits.iterations:
            defined(objective.at(x))
            accept(objective, history, limits, x)
    return spent(limits)


def defined(found: Evaluation) -> Evaluation:
    """Raises Stopped where J is not defined: steps without a line search cannot be shortened."""
    if found.outside is not None:
        raise Stopped(f"stopped outside: {found.outside} - use a smaller --rate")
    return found


def spent(limits: Limits) -> str:
    return f"not converged after {limits.iterations} iterations - give more --iterations"


def optimizer(name: Name) -> Callable[..., str]:
    """(objective, history, limits) -> why it stopped. May raise Stopped."""
    from gradient_routes.bench.inversion import least_squares, linear_map

    return {
        "lbfgs": lbfgs,
        "descent": descent,
        "adam": adam,
        "gauss-newton": least_squares.gauss_newton,
        "levenberg-marquardt": least_squares.levenberg_marquardt,
        "trust": least_squares.trust,
        "linear": linear_map.at_once,
    }[name]
