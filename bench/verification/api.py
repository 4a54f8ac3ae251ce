"""`check` and `assert_gradient`: the command `routes check` as functions, for scripts and anyone's tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from gradient_routes.bench.verification import foreign
from gradient_routes.bench.verification.check import check as check_subject
from gradient_routes.bench.verification.foreign import Bounds
from gradient_routes.bench.verification.plan import Plan
from gradient_routes.bench.verification.result import Check
from gradient_routes.problems.errors import InputError


def check(
    objective: Any,
    gradient: Callable[..., Any] | None = None,
    start: Any = None,
    *,
    scale: Any = None,
    bounds: Bounds | None = None,
    names: Sequence[str] | None = None,
    tighten: Callable[[float], Any] | None = None,
    active_set: Callable[..., Any] | None = None,
    scaled: Callable[[float], Any] | None = None,
    fresh: Callable[..., Any] | None = None,
    budget: float = 240,
    seed: int = 0,
    accept: float = 0.0,
    name: str | None = None,
) -> Check:
    """Is this gradient right? The verdict with the numbers it rests on. `routes check`.

    objective  J(p) -> a number, p (n_p,) float64; or one object with objective(p) and gradient(p), or
               value_and_gradient(p), and start, and whatever of the keywords below it offers as attributes
    gradient   dJ/dp(p) -> (n_p,)
    start      p (n_p,) to check at
    scale      natural changes (n_p,), > 0 [|p_i|, for zeros the median of the others, or what J responds to]
    bounds     (lower, upper), numbers or arrays (n_p,), a list of n_p pairs, or scipy.optimize.Bounds: no point
               outside is asked for; a parameter with equal bounds is held
    names      of the parameters, n_p of them
    tighten    tighten(factor) -> (objective, gradient), or such an object, the solver's tolerance times factor < 1
    active_set active_set(p) -> a hashable, which smooth branch of J holds
    scaled     scaled(factor) -> (objective, gradient), or such an object, of J times factor
    fresh      fresh(p) -> J(p) computed anew, where objective and gradient come out of one recording
    budget     objective calls at most
    seed       of the random directions
    accept     relative error of the gradient that is good enough [1e-7]
    name       of the code, in the verdict

    Returns a Check: `verdict` ("agrees", "wrong-gradient", "solver-limited", "non-smooth", "noise-limited" ...),
    `says` why, with numbers, `todo`, the next thing to do, `culprit`, `calls`.

    >>> import numpy as np
    >>> def J(p):
    ...     return float(np.sum(np.sin(p)))
    >>> check(J, np.cos, start=[0.1, 0.2, 0.3]).verdict
    'agrees'
    >>> found = check(J, lambda p: np.cos(p) * [1.0, 1.0, 1.1], start=[0.1, 0.2, 0.3])
    >>> print(found.verdict, "-", found.culprit)
    wrong-gradient - component p_3, off by the factor 1.1

    Raises InputError for what cannot be asked; what the code itself does wrong is part of the verdict.
    """
    plan = Plan(budget=budget, seed=seed)
    if gradient is None:
        given = {"scale": scale, "bounds": bounds, "names": names, "tighten": tighten, "active_set": active_set}
        given |= {"scaled": scaled, "fresh": fresh}
        own = [key for key, value in given.items() if value is not None]
        if own:
            raise InputError(f"check: an object brings its own {own[0]} - make it an attribute")
        return check_subject(foreign.subject_of(objective, name or type(objective).__name__, start), plan, accept)
    if start is None:
        raise InputError("check: no start - give the point p to check at")
    subject = foreign.subject(
        objective,
        gradient,
        start,
        name=name or str(getattr(gradient, "__name__", "the gradient")),
        scale=scale,
        bounds=bounds,
        names=names,
        tighten=tighten,
        active_set=active_set,
        scaled=scaled,
        fresh=fresh,
    )
    return check_subject(subject, plan, accept)


def assert_gradient(
    objective: Any, gradient: Callable[..., Any] | None = None, start: Any = None, **keywords: Any
) -> None:
    """Raise AssertionError unless `check` of the same arguments, keywords included, says that the gradient agrees.

    For tests:

    >>> import numpy as np
    >>> def test_my_gradient():
    ...     assert_gradient(lambda p: float(p @ p), lambda p: 2.0 * p, start=np.ones(3), budget=100)
    >>> test_my_gradient()

    Raises InputError for what cannot be asked.
    """
    __tracebackhide__ = True  # pytest then shows the caller's line
    found = check(objective, gradient, start, **keywords)
    if found.verdict != "agrees":
        raise AssertionError(str(found))
