"""User code as the subject of a check: functions, or an object that has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.bench.verification.guarded import FOREIGN, detached
from gradient_routes.bench.verification.held import without
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array, default_label
from gradient_routes.problems.text import shortened

Bounds = Any  # (lower, upper), one pair a parameter, or scipy.optimize.Bounds
DECADES = 1e3  # ratio of magnitudes that tell the scale of a parameter that starts at 0
OPTIONAL = ("scale", "bounds", "names", "tighten", "active_set", "scaled", "fresh")


def subject_of(thing: Any, name: str, start: Any = None) -> Subject:
    """A subject from an object with objective(p) and gradient(p), or value_and_gradient(p), and start (n_p,).

    Optional attributes: scale, bounds, names, tighten(factor), active_set(p), scaled(factor), fresh(p). `start`
    overrides the object's. A class, or a function that returns the object, is called first. Raises InputError.
    """
    try:
        made = _made(thing, name)
        objective, gradient = functions_of(made, name)
        given = getattr(made, "start", None) if start is None else start
        optional = {keyword: getattr(made, keyword, None) for keyword in OPTIONAL}
        if given is not None:
            return subject(objective, gradient, given, name=name, **optional)
    except InputError:
        raise
    except FOREIGN as failure:  # attributes may be properties, which run user code
        raise InputError(f"check: {name} cannot be read: {type(failure).__name__}: {failure} - correct it") from failure
    raise InputError(f"check: {name} has no start - give it one, an array (n_p,), or a point with --at")


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
    scaled: Callable[[float], Any] | None = None,
    fresh: Callable[[Array], Any] | None = None,
) -> Subject:
    """A subject from plain functions. Raises InputError.

    tighten(factor) and scaled(factor) return (objective, gradient), or an object that has them; everything else stays.
    Parameters whose bounds are equal are held: they are left out, and a note says so.
    """
    p = _vector(start, None, "start")
    n_p = len(p)
    _all(np.isfinite(p), lambda i: f"start[{i}] is not finite - start at a finite point")
    s = _natural_scale(p) if scale is None else _vector(scale, n_p, "scale")
    wrong = (s <= 0) | np.isinf(s)
    _all(~wrong, lambda i: f"scale[{i}] = {s[i]:g} - give scales > 0 and finite")
    lower, upper = _bounds(bounds, p)

    def span(i: int) -> str:
        return f"{lower[i]:g} to {upper[i]:g}"

    _all(lower <= upper, lambda i: f"bounds[{i}] = {span(i)} - give (lower, upper), lower <= upper")
    inside = (p >= lower) & (p <= upper)
    _all(inside, lambda i: f"start[{i}] = {p[i]:g} is outside its bounds {span(i)} - start inside")
    label = default_label if names is None else _labels(names, n_p)
    made = Subject(name, objective, gradient, p, s, lower, upper, label=label)

    def other(make: Callable[[float], Any], what: str) -> Callable[[float], Subject]:
        def made_by(factor: float) -> Subject:
            given = make(factor)
            J, g = given if isinstance(given, tuple) else functions_of(_made(given, what), what)
            return replace(made, objective=J, gradient=g)

        return made_by

    made_whole = replace(
        made,
        tighten=other(tighten, "tightened") if callable(tighten) else None,
        scaled=other(scaled, "scaled") if callable(scaled) else None,
        active_set=active_set if callable(active_set) else None,
        fresh=fresh if callable(fresh) else None,
    )
    held = lower == upper
    _all([not held.all()], lambda i: "every parameter is held by its bounds - free one")
    return without(made_whole, held) if held.any() else made_whole


def _all(holds: Any, otherwise: Callable[[int], str]) -> None:
    """Raises InputError for the first component that does not."""
    wrong = np.flatnonzero(~np.asarray(holds, bool))
    if wrong.size:
        raise InputError(f"check: {otherwise(int(wrong[0]))}")


def _natural_scale(p: Array) -> Array:
    """The default natural changes: |p_i|, and for zeros the median of the others where these are alike, or 1.

    NaN, to be found from J, for zeros beside others that are of different magnitudes, or far from 1.
    """
    size = np.abs(p)
    others = size[size > 0]
    if not others.size:
        return np.ones_like(p)
    alike = others.max() <= DECADES * others.min() and 1.0 / DECADES <= np.median(others) <= DECADES
    return np.where(size > 0, size, np.median(others) if alike else np.nan)


def _vector(values: Any, n_p: int | None, what: str) -> Array:
    """A float64 copy (n_p,) of what a user gave. Raises InputError."""
    if isinstance(values, Mapping):
        raise InputError(f"check: {what} is a {type(values).__name__} - give one array, and take it apart in J")
    try:
        array = np.array(detached(values))
        if np.iscomplexobj(array):
            raise InputError(f"check: {what} is complex - give real and imaginary parts as parameters of their own")
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"check: {what} is no array of real numbers ({error}) - give one of length n_p") from error
    if array.ndim == 0 and n_p is not None:
        array = np.full(n_p, float(array))
    if n_p is not None and array.shape in ((n_p, 1), (1, n_p)):
        array = array.reshape(n_p)
    if array.ndim != 1 or array.size == 0 or (n_p is not None and array.size != n_p):
        wanted = "a vector (n_p,): ravel it, and reshape p in J" if n_p is None else f"{n_p} of them"
        raise InputError(f"check: {what} has the shape {array.shape} - give {wanted}")
    _all(~np.isnan(array), lambda i: f"{what}[{i}] is NaN - give numbers")
    return array


def _labels(names: Any, n_p: int) -> Callable[[int], str]:
    try:
        given = [shortened(str(name)) for name in names]
    except TypeError:
        raise InputError(f"check: names={names!r} - give one name for each parameter") from None
    if isinstance(names, str) or len(given) != n_p:
        raise InputError(f"check: {len(given)} names for {n_p} parameters - give one each")
    return lambda i: given[i]


def _bounds(bounds: Bounds | None, p: Array) -> tuple[Array, Array]:
    """lower and upper (n_p,) from a pair of numbers or arrays, from SciPy's list of pairs, or from its Bounds.

    None is no bound. Two pairs of two numbers can be both: the reading that p is inside of counts, where it is one.
    """
    n_p = len(p)
    if bounds is None:
        return _ends([None, None], n_p)
    if hasattr(bounds, "lb") and hasattr(bounds, "ub"):
        return _ends([bounds.lb, bounds.ub], n_p)
    try:
        pair: list[Any] = list(bounds)
    except TypeError:
        pair = []
    readings = [pair] if len(pair) == 2 else []
    if len(pair) == n_p and all(np.size(b) == 2 and not isinstance(b, np.ndarray) for b in pair):
        readings.append([[b[k] for b in pair] for k in (0, 1)])
    if not readings:
        raise InputError(f"check: bounds={bounds!r} - give (lower, upper), numbers or arrays, or one pair a parameter")
    found = [_ends(reading, n_p) for reading in readings]
    holding = [(lower, upper) for lower, upper in found if ((lower <= p) & (p <= upper)).all()] or found[-1:]
    if not np.array_equal(holding[0], holding[-1]):
        raise InputError(
            f"check: bounds={bounds!r} can be read as (lower, upper) or as a pair for each parameter"
            " - give scipy.optimize.Bounds(lower, upper)"
        )
    return holding[0]


def _ends(pair: Sequence[Any], n_p: int) -> tuple[Array, Array]:
    ends = [_without_none(end, limit) for end, limit in zip(pair, (-np.inf, np.inf), strict=True)]
    lower, upper = (_vector(end, n_p, f"bounds[{k}]") for k, end in enumerate(ends))
    return lower, upper


def _without_none(end: Any, limit: float) -> Any:
    if end is None:
        return limit
    return [limit if e is None else e for e in end] if isinstance(end, list | tuple) else end


def _made(thing: Any, name: str) -> Any:
    """The object itself, or what the class or function given returns."""
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
        raise InputError(f"check: {name} cannot be built: {type(error).__name__}: {error} - correct it") from error
