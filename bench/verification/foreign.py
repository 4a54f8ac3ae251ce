"""Other people's code as the subject of a check: functions, or an object that has them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.bench.verification.guarded import FOREIGN
from gradient_routes.bench.verification.subject import Subject, natural_scale, vector
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, default_label

Bounds = tuple[Any, Any]


def subject_of(thing: Any, name: str, start: Any = None) -> Subject:
    """A subject out of an object with objective(p) and gradient(p), or value_and_gradient(p), and start (n_p,).

    Optional: scale, bounds (lower, upper), names, tighten(factor), active_set(p). `start` overrides the object's.
    A class, or a function that makes the object, is called first. Raises InputError for what is missing.
    """
    try:
        return _subject_of(_made(thing, name), name, start)
    except InputError:
        raise
    except FOREIGN as failure:  # attributes may be properties, somebody else's code
        raise InputError(
            f"check: {name} cannot be looked at: {type(failure).__name__}: {failure} - mend it"
        ) from failure


def _subject_of(thing: Any, name: str, start: Any) -> Subject:
    objective, gradient = functions_of(thing, name)
    given = getattr(thing, "start", None) if start is None else start
    if given is None:
        raise InputError(f"check: {name} has no start - give it one, an array (n_p,), or a point with --at FILE.csv")
    return subject(
        objective,
        gradient,
        given,
        name=name,
        scale=getattr(thing, "scale", None),
        bounds=getattr(thing, "bounds", None),
        names=getattr(thing, "names", None),
        tighten=getattr(thing, "tighten", None),
        active_set=getattr(thing, "active_set", None),
    )


def functions_of(thing: Any, name: str) -> tuple[Callable[[Array], Any], Callable[[Array], Any]]:
    """objective and gradient of an object. Raises InputError."""
    both = getattr(thing, "value_and_gradient", None)
    objective, gradient = getattr(thing, "objective", None), getattr(thing, "gradient", None)
    if callable(both):
        objective = objective if callable(objective) else (lambda p: both(p)[0])
        gradient = gradient if callable(gradient) else (lambda p: both(p)[1])
    if not callable(objective) or not callable(gradient):
        known = ", ".join(n for n in dir(thing) if not n.startswith("_")) or "nothing"
        raise InputError(
            f"check: {name} has no objective(p) and gradient(p), nor value_and_gradient(p); it has {known}"
            " - give it one or the other"
        )
    return objective, gradient


def subject(
    objective: Callable[[Array], Any],
    gradient: Callable[[Array], Any],
    start: Any,
    *,
    name: str = "the gradient",
    scale: Any = None,
    bounds: Bounds | None = None,
    names: Sequence[str] | None = None,
    tighten: Callable[[float], Any] | None = None,
    active_set: Callable[[Array], Any] | None = None,
) -> Subject:
    """A subject out of plain functions. Raises InputError.

    tighten(factor) gives (objective, gradient), or an object that has them: the rest stays as it is.
    """
    p = vector(start, None, "start")
    if not np.isfinite(p).all():
        raise InputError(f"check: start[{int(np.flatnonzero(~np.isfinite(p))[0])}] is not finite - start somewhere")
    n_p = len(p)
    s = natural_scale(p) if scale is None else vector(scale, n_p, "scale")
    if not ((s > 0) & np.isfinite(s)).all():
        i = int(np.flatnonzero(~((s > 0) & np.isfinite(s)))[0])
        raise InputError(f"check: scale[{i}] = {s[i]:g} - give scales > 0 and finite")
    lower, upper = _bounds(bounds, n_p)
    crossed = np.flatnonzero(~(lower < upper))
    if crossed.size:
        i = int(crossed[0])
        raise InputError(f"check: bounds[{i}] = {lower[i]:g} to {upper[i]:g} - give (lower, upper), lower < upper")
    outside = np.flatnonzero((p < lower) | (p > upper))
    if outside.size:
        i = int(outside[0])
        raise InputError(
            f"check: start[{i}] = {p[i]:g} is outside its bounds {lower[i]:g} to {upper[i]:g} - start inside"
        )
    label = default_label if names is None else _labels(names, n_p)
    made = Subject(name, objective, gradient, p, s, lower, upper, label=label)

    def tightened(factor: float) -> Subject:
        assert tighten is not None
        other = tighten(factor)
        J, g = other if isinstance(other, tuple) else functions_of(_made(other, "tightened"), "tightened")
        return replace(made, objective=J, gradient=g)

    return replace(
        made,
        tighten=tightened if callable(tighten) else None,
        active_set=active_set if callable(active_set) else None,
    )


def _labels(names: Any, n_p: int) -> Callable[[int], str]:
    try:
        given = [str(name) for name in names]
    except TypeError:
        raise InputError(f"check: names={names!r} - give one name a parameter") from None
    if isinstance(names, str) or len(given) != n_p:
        raise InputError(f"check: {len(given)} names for {n_p} parameters - give one each")
    return lambda i: given[i]


def _bounds(bounds: Bounds | None, n_p: int) -> tuple[Array, Array]:
    if bounds is None:
        return np.full(n_p, -np.inf), np.full(n_p, np.inf)
    try:
        pair = list(bounds)
    except TypeError:
        pair = []
    if len(pair) == n_p != 2 and all(np.size(b) == 2 for b in pair):  # SciPy's list of pairs, None for no bound
        pair = [[b[k] for b in pair] for k in (0, 1)]
    if len(pair) != 2:
        raise InputError(f"check: bounds={bounds!r} - give (lower, upper), numbers or arrays, or one pair a parameter")
    ends = [_without_none(end, limit) for end, limit in zip(pair, (-np.inf, np.inf), strict=True)]
    lower, upper = (vector(end, n_p, f"bounds[{k}]") for k, end in enumerate(ends))
    return lower, upper


def _without_none(end: Any, limit: float) -> Any:
    if end is None:
        return limit
    return [limit if e is None else e for e in end] if isinstance(end, list | tuple) else end


def _made(thing: Any, name: str) -> Any:
    """The object itself, or what the class or function given makes."""
    ready = callable(getattr(thing, "gradient", None)) or callable(getattr(thing, "value_and_gradient", None))
    if not isinstance(thing, type) and (ready or not callable(thing)):
        return thing
    try:
        return thing()
    except TypeError as error:
        raise InputError(
            f"check: {name} is a function or class that wants arguments ({error}) - name an object with objective(p),"
            " gradient(p) and start, or give --objective and --gradient"
        ) from error
    except FOREIGN as error:
        raise InputError(f"check: {name} cannot be made: {type(error).__name__}: {error} - mend it") from error
