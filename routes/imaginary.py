"""Whether R and J carry imaginary parts through, as a problem that offers COMPLEX promises."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
from numpy.exceptions import ComplexWarning

from gradient_routes.problems.errors import LostImaginaryPart
from gradient_routes.problems.problem import Array, Offers, Problem
from gradient_routes.routes.finite_difference import CENTRAL, EPS
from gradient_routes.routes.newton import norm

RELATIVE_STEP = 1e-30  # of complex steps: its square is far below eps, itself far above the smallest float
STEPS = (0.01 * CENTRAL, CENTRAL, 100.0 * CENTRAL)  # of differences: no one step suits all
KNOWN = 1e-6  # relative: no difference is trusted further
ROUNDINGS = 4.0  # eps of the terms that a difference subtracts

Function = Callable[[Array], Array]


def refuse_losses(problem: Problem, u: Array, p: Array) -> None:
    """Raises LostImaginaryPart where `losses` finds one."""
    for name, loss in losses(problem, u, p).items():
        raise LostImaginaryPart(f"{problem.name}: complex step lost: {name} {loss} - use no abs, conj, real, float")


def losses(problem: Problem, u: Array, p: Array, seed: int = 0) -> dict[str, str]:
    """What `residual` and `objective` do to imaginary parts at (u, p), by name; empty where both carry them through.

    Law: Im f(x + i h v) / h = (f(x + k v) - f(x - k v)) / 2k for f = R, J, x = u, p and random directions v, up to the
    error of the difference. It evaluates R and J and solves nothing. Empty for a problem that does not offer COMPLEX.
    """
    if Offers.COMPLEX not in problem.offers:
        return {}
    R, J, rng = problem.residual, problem.objective, np.random.default_rng(seed)
    du = rng.standard_normal(len(u)) * (norm(u) or 1.0)
    dp = rng.choice([-1.0, 1.0], len(p)) * rng.uniform(0.5, 1.5, len(p))
    dp *= np.where(p == 0.0, problem.parameters.scale, np.abs(p))
    found = {}
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", ComplexWarning)
        load = norm(R(problem.initial(p), p))  # the terms that cancel at u
        for name, f, terms in (("residual", R, load), ("objective", J, 0.0)):
            loss = _loss("u", _of_u(f, p), u, du, terms) or _loss("p", _of_p(f, u, problem), p, dp, terms)
            if loss is not None:
                found[name] = loss
    return found


def _of_u(f: Callable[[Array, Array], Array], p: Array) -> Function:
    return lambda u: np.asarray(f(u, p.astype(u.dtype)))


def _of_p(f: Callable[[Array, Array], Array], u: Array, problem: Problem) -> Function:
    """NaN outside the domain."""
    lower, upper = problem.parameters.lower, problem.parameters.upper

    def of_p(p: Array) -> Array:
        inside = ((p.real > lower) & (p.real < upper)).all()
        return np.asarray(f(u.astype(p.dtype), p) if inside else np.nan)

    return of_p


def _loss(by: str, f: Function, x: Array, v: Array, terms: float) -> str | None:
    """What f does to the imaginary part of x, None where a complex step is as good as a difference shows."""
    try:
        step = f(x + 1j * RELATIVE_STEP * v).imag / RELATIVE_STEP
    except Exception as failure:  # the code of a user may raise anything
        return f"raises {type(failure).__name__} for complex {by}: {' '.join(str(failure).split())}"
    difference, uncertainty = min((_difference(f, x, v, h, terms) for h in STEPS), key=lambda found: found[1])
    off = norm(step - difference)
    return f"drops Im {by}, off a difference by {off / (norm(difference) or 1.0):.2g}" if off > uncertainty else None


def _difference(f: Function, x: Array, v: Array, h: float, terms: float) -> tuple[Array, float]:
    """A central difference, and how far it can be off: as far as its two one-sided ones are apart, at a kink say."""
    try:
        before, here, after = f(x - h * v), f(x), f(x + h * v)
    except Exception:  # so may it at real numbers
        return np.zeros(()), np.inf
    central, apart = (after - before) / (2.0 * h), norm(after - 2.0 * here + before) / h
    uncertainty = apart + ROUNDINGS * EPS * (norm(here) + terms) / h + KNOWN * norm(central)
    return central, uncertainty if np.isfinite(uncertainty) else np.inf
