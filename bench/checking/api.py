"""`check` and `assert_gradient`: the command `routes check` as functions, for scripts and anyone's tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from bench.checking import foreign
from bench.checking.check import check as check_subject
from bench.checking.foreign import Bounds
from bench.checking.plan import Plan
from bench.checking.result import Check
from bench.checking.subject import Subject
from problems.errors import InputError


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
    budget: float = 200,
    seed: int = 0,
    accept: float = 0.0,
    name: str | None = None,
) -> Check:
    """Is this gradient right? The verdict with the numbers it rests on.

    objective  J(p) -> a number, p (n_p,) float64; or one object with objective(p) and gradient(p), or
               value_and_gradient(p), and start, and whatever of the keywords below it offers as attributes
    gradient   dJ/dp(p) -> (n_p,)
    start      p (n_p,) to check at
    scale      natural changes, > 0 [|p_i|, for zeros the median of the others or 1]
    bounds     (lower, upper), numbers or arrays: no point outside is asked for
    tighten    tighten(factor) -> (objective, gradient), or such an object, the solver's tolerance times factor < 1
    active_set active_set(p) -> a hashable, which smooth branch of J holds
    budget     objective calls at most
    accept     relative error of the gradient that is good enough [1e-7]

    Raises InputError for what cannot be asked; what the code itself does wrong is part of the verdict.
    """
    plan = Plan(budget=budget, seed=seed)
    if gradient is None:
        subject = foreign.subject_of(objective, name or type(objective).__name__, start)
        if scale is not None or bounds is not None or names is not None:
            raise InputError("check: an object has its own scale, bounds and names - set them there")
    else:
        if start is None:
            raise InputError("check: no start - give the point p to check at")
        tightened = None if tighten is None else _tightened(tighten, start, scale, bounds, names)
        subject = foreign.subject(
            objective,
            gradient,
            start,
            name=name or "the gradient",
            scale=scale,
            bounds=bounds,
            names=names,
            tighten=tightened,
            active_set=active_set,
        )
    return check_subject(subject, plan, accept)


def _tightened(
    tighten: Callable[[float], Any], start: Any, scale: Any, bounds: Bounds | None, names: Sequence[str] | None
) -> Callable[[float], Subject]:
    def again(factor: float) -> Subject:
        made = tighten(factor)
        if not isinstance(made, tuple):
            return foreign.subject_of(made, "tightened", start)
        J, g = made
        return foreign.subject(J, g, start, name="tightened", scale=scale, bounds=bounds, names=names)

    return again


def assert_gradient(objective: Any, gradient: Callable[..., Any] | None = None, start: Any = None, **more: Any) -> None:
    """Raise AssertionError unless `check` of the same arguments says that the gradient agrees.

    def test_my_gradient():
        assert_gradient(J, dJ, start=np.ones(3))
    """
    found = check(objective, gradient, start, **more)
    if found.verdict != "agrees":
        raise AssertionError(f"{found.name}: {found.verdict}: {found.says} - {found.todo}")
