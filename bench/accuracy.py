"""How wrong a gradient is, and against what."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bench import registry
from problems.errors import RoutesError
from problems.problem import Array, Reference
from routes.model import Model
from routes.route import Route

JUDGES = ("complex-step", "tangent")  # where a problem knows no closed form; never the judged route itself
MANY = 200  # parameters; beyond, these cost too much to be run unasked


class Judges:
    """References for one problem at one p, each computed once, when first asked for.

    `unaffordable` says of a route why its bill is not paid, or None.
    """

    def __init__(self, model: Model, p: Array, unaffordable: Callable[[Route], str | None]) -> None:
        self.model, self.p, self.unaffordable = model, p, unaffordable
        self._own: Reference | None = None
        self._asked = False
        self._gradients: dict[str, Reference | None] = {}

    def judge(self, route: Route) -> Reference | None:
        """The problem's own reference, or another exact route's gradient where n_p is small, or None."""
        if not self._asked:
            self._own, self._asked = self._sound(self.model.problem.reference(self.p)), True
        if self._own is not None or len(self.p) > MANY:
            return self._own
        for name in JUDGES:
            if name != route.name:
                if name not in self._gradients:
                    self._gradients[name] = self._gradient(registry.find("route", name).load())
                if self._gradients[name] is not None:
                    return self._gradients[name]
        return None

    def _gradient(self, route: Route) -> Reference | None:
        if route.objection(self.model.problem) is not None or self.unaffordable(route) is not None:
            return None
        try:
            gradient = route.prepare(self.model, self.p)(self.p).gradient
        except RoutesError:  # a judge that fails is no reason to fail the judged
            return None
        return self._sound(Reference(route.name, gradient, norm2(gradient)))

    def _sound(self, reference: Reference | None) -> Reference | None:
        """A reference that is no finite vector (n_p,) judges nobody."""
        if reference is None or reference.gradient.shape != self.p.shape or not np.isfinite(reference.gradient).all():
            return None
        return reference


def error(gradient: Array, reference: Reference) -> tuple[float, str]:
    """|g - g_ref| / |g_ref| and the name of the reference.

    Where g_ref is zero up to the rounding of the terms that make it, the error is relative to those terms, and
    the name says so.
    """
    difference, scale = norm2(gradient - reference.gradient), norm2(reference.gradient)
    rounding = 8.0 * np.finfo(np.float64).eps * np.sqrt(len(gradient)) * reference.size
    if scale > rounding:
        return difference / scale, reference.name
    relative = difference / reference.size if reference.size else (0.0 if difference == 0.0 else np.inf)
    return relative, f"{reference.name} (zero: relative to its terms)"


def norm2(v: Array) -> float:
    """|v|_2, also of components whose squares leave float64's range."""
    largest = float(np.abs(v).max(initial=0.0))
    if largest == 0.0 or not np.isfinite(largest):
        return largest
    return largest * float(np.linalg.norm(v / largest))
