"""Whether R and J carry imaginary parts through, as a problem that offers COMPLEX promises."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from dataclasses import dataclass

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


def refuse_zeros(problem: Problem, value: Callable[[Array], float], p: Array, g: Array, seed: int = 0) -> None:
    """Raises LostImaginaryPart where components of a complex step g (n_p,) are exactly 0 and J(p) = value(p) varies.

    J is solved for along one random direction through them, at most nine times; a slope that two steps agree about is
    no noise.
    """
    blind = np.flatnonzero(g == 0.0)
    if not blind.size:
        return
    scaled, v = problem.parameters.natural(p), np.zeros_like(p)
    rng = np.random.default_rng(seed)
    v[blind] = scaled[blind] * rng.choice([-1.0, 1.0], blind.size) * rng.uniform(0.5, 1.5, blind.size)
    J = _inside(lambda q: np.asarray(value(q)), problem)
    differences = [_difference(J, p, v, h, 0.0) for h in STEPS]
    slopes = [float(one.central) for one in differences if abs(one.central) > one.uncertainty]
    for one, other in itertools.pairwise(slopes):
        if abs(one - other) < 0.5 * abs(one):
            label = problem.parameters.label(int(blind[0]))
            more = f" (and {blind.size - 1} more)" if blind.size > 1 else ""
            raise LostImaginaryPart(
                f"{problem.name}: complex step lost: Im J is exactly 0 for {label}{more}, a difference is {one:.2g}"
                " - use no abs, conj, real, float"
            )


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
    return _inside(lambda p: f(u.astype(p.dtype), p), problem)


def _inside(f: Function, problem: Problem) -> Function:
    """f(p), NaN outside the domain."""
    lower, upper = problem.parameters.lower, problem.parameters.upper

    def of_p(p: Array) -> Array:
        return np.asarray(f(p) if ((p.real > lower) & (p.real < upper)).all() else np.nan)

    return of_p


def _loss(by: str, f: Function, x: Array, v: Array, terms: float) -> str | None:
    """What f does to the imaginary part of x, None where a complex step is as good as a difference shows."""
    try:
        step = f(x + 1j * RELATIVE_STEP * v).imag / RELATIVE_STEP
    except Exception as failure:  # the code of a user may raise anything
        return f"raises {type(failure).__name__} for complex {by}: {' '.join(str(failure).split())}"
    difference = min((_difference(f, x, v, h, terms) for h in STEPS), key=lambda found: found.uncertainty)
    off = norm(step - difference.central)
    if off > difference.uncertainty:
        return f"drops Im {by}, off a difference by {off / (norm(difference.central) or 1.0):.2g}"
    hidden = difference.nonzero & (step == 0.0)  # beside larger ones
    return f"drops Im {by} of {np.count_nonzero(hidden)} of its {hidden.size} components" if hidden.any() else None


@dataclass(frozen=True)
class _Difference:
    """A central difference, how far apart its two one-sided ones are, as at a kink, and its rounding."""

    central: Array
    apart: Array
    rounding: float

    @property
    def uncertainty(self) -> float:
        """How far it can be off."""
        found = norm(self.apart) + self.rounding + KNOWN * norm(self.central)
        return found if np.isfinite(found) else np.inf

    @property
    def nonzero(self) -> Array:
        """Components that are not 0 for certain."""
        return np.asarray(np.abs(self.central) > 2.0 * (self.apart + self.rounding))


def _difference(f: Function, x: Array, v: Array, h: float, terms: float) -> _Difference:
    try:
        before, here, after = f(x - h * v), f(x), f(x + h * v)
    except Exception:  # so may it at real numbers
        return _Difference(np.zeros(()), np.zeros(()), np.inf)
    apart = np.abs(after - 2.0 * here + before) / h
    return _Difference((after - before) / (2.0 * h), apart, ROUNDINGS * EPS * (norm(here) + terms) / h)
