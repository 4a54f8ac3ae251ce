"""How wrong a gradient is, and against what."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gradient_routes.bench.cases import registry
from gradient_routes.bench.execution.slopes import complex_slopes
from gradient_routes.problems.errors import LostImaginaryPart, RoutesError
from gradient_routes.problems.problem import Array, Offers, Operator, Reference
from gradient_routes.problems.subspace import Subspace, directions
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Route

JUDGES = ("complex-step", "tangent")  # where a problem knows no closed form; never the judged route itself
WHOLE = 200  # parameters; beyond, these judge in random directions: the whole costs too much to be run unasked
DIRECTIONS, SEED = 3, 20260  # no direction a user's --seed would name
SAME = 1e-6  # of J: no tolerance of a forward solve, another state
CANCELLED = 1e3  # eps, what condition numbers make of rounding in the terms of a gradient
RTOL = 1e-13  # forward solves of judges in directions
POLISH = 1  # Newton steps of judges beyond the judged: one at 1e-12 would leave 1e-12 of the gradient, as they do


@dataclass(frozen=True)
class Judge:
    """Judges g (n_p,) by a reference, or V^T g where directions V (n_p, m) are given.

    instead  why complex steps did not judge that would have, where R or J loses imaginary parts
    """

    reference: Reference
    V: Operator | None = None
    instead: str | None = None

    @property
    def whole(self) -> Reference | None:
        """A reference for every component, where it is one."""
        return self.reference if self.V is None else None

    def error(self, g: Array) -> tuple[float, str]:
        """See `error`, and the name of the reference."""
        return error(g if self.V is None else self.V.T @ g, self.reference)


class Judges:
    """References for one problem at one p, each computed once, when first asked for.

    `unaffordable` says of a route why its bill for so many parameters is not paid, or None. `found` is what was found
    before, in another process say; what is found here is added to it.
    """

    def __init__(
        self, model: Model, p: Array, unaffordable: Callable[[Route, int], str | None], found: KnownJudges | None = None
    ) -> None:
        self.model, self.p, self.unaffordable = model, p, unaffordable
        self.found: KnownJudges = {} if found is None else found

    def judge(self, route: Route) -> Judge | str:
        """The problem's own reference, or another exact route's gradient, in full where n_p is small and it can be
        paid for, else in random directions. A sentence where nobody judges.
        """
        reasons: dict[str, str] = {}
        for name, whole in self._candidates():
            if name == route.name:
                continue
            if (name, whole) not in self.found:
                self.found[name, whole] = self._ask(name, whole)
            found = self.found[name, whole]
            if isinstance(found, Judge):
                return replace(found, instead=next((r for r in reasons.values() if isinstance(r, Lost)), None))
            reasons[name] = found
        return ", ".join(filter(None, reasons.values())).replace("; ", ", ")

    def _candidates(self) -> Iterator[tuple[str, bool]]:
        yield OWN, True
        yield from ((name, True) for name in JUDGES if len(self.p) <= WHOLE)
        yield from ((name, False) for name in JUDGES)

    def _ask(self, name: str, whole: bool) -> Judge | str:
        try:
            if name == OWN:
                return self._own()
            return self._by_route(registry.find("route", name).load(), whole)
        except LostImaginaryPart as failure:
            return Lost(failure)
        except RoutesError as failure:  # a judge that fails is no reason to fail the judged
            return f"{name}: {failure}" if name not in str(failure) else str(failure)
        except Exception as failure:  # nor is one that trips over the code of a plug-in
            return f"{name}: {type(failure).__name__}: {failure}"

    def _own(self) -> Judge | str:
        reference = self.model.problem.reference(self.p)
        return "" if reference is None else self._sound(reference, self.p.shape)

    def _by_route(self, route: Route, whole: bool) -> Judge | str:
        problem, n = self.model.problem, len(self.p) if whole else DIRECTIONS
        reason = route.objection(problem) or self.unaffordable(route, n)
        if reason is not None:
            return reason if route.name in reason else f"{route.name}: {reason}"
        if whole:
            J, gradient, *_ = route.prepare(self._polished, self.p)(self.p)
            if self._another_state(J):
                return f"{route.name}: has found another state, J = {J:.6g} and not {self._J:.6g}"
            sizes = problem.parameters.natural(self.p)
            return self._sound(Reference(route.name, gradient, self._size(gradient, 1.0 / sizes)), self.p.shape)
        few = directions(problem, self.p, DIRECTIONS, SEED)
        slopes = self._slopes(route, few)
        name = f"{route.name} in {DIRECTIONS} random directions"
        return self._sound(Reference(name, slopes, self._size(slopes, np.ones(DIRECTIONS))), (DIRECTIONS,), few.V)

    def _size(self, gradient: Array, natural: Array) -> float:
        """Of the terms: the gradient's, or where that is next to nothing what J changes by where p naturally does."""
        return max(norm2(gradient), self.terms * norm2(natural))

    @cached_property
    def terms(self) -> float:
        """What J is made of: near its minimum far less of that is left than at the state solves start from."""
        problem = self.model.problem
        before = problem.objective(problem.initial(self.p), self.p) if Offers.SOLVE in problem.offers else 0.0
        return max(abs(self._J), abs(float(before)))

    @cached_property
    def _polished(self) -> Model:
        return Model(self.model.problem, replace(self.model.solver, polish=POLISH))

    @cached_property
    def _J(self) -> float:
        return Model(self.model.problem, self._polished.solver).value(self.p)  # whose factors are released

    def _another_state(self, J: float | None) -> bool:
        """Whether a judge's J is not the J of real solves: where R(u, p) = 0 has several solutions it may be."""
        return J is not None and abs(J - self._J) > SAME * self.terms

    def _slopes(self, route: Route, few: Subspace) -> Array:
        solver = replace(self.model.solver, rtol=min(RTOL, self.model.solver.rtol), polish=POLISH)
        if route.name == "complex-step":
            return complex_slopes(Model(self.model.problem, solver), self.p, np.asarray(few.V))
        c = few.parameters.start
        return route.prepare(Model(few, solver), c)(c).gradient

    @staticmethod
    def _sound(reference: Reference, shape: tuple[int, ...], V: Operator | None = None) -> Judge | str:
        """A reference that is no finite vector of this shape judges nobody."""
        if reference.gradient.shape != shape:
            return f"{reference.name}: gives an array of shape {reference.gradient.shape}, not {shape}"
        if not np.isfinite(reference.gradient).all():
            return f"{reference.name}: is not finite"
        return Judge(reference, V)


class Lost(str):
    """Why complex steps do not judge: R or J loses imaginary parts."""


OWN = "its own reference"
KnownJudges = dict[tuple[str, bool], Judge | str]  # by the name of the judge, and whether it judges the whole


def error(gradient: Array, reference: Reference) -> tuple[float, str]:
    """|g - g_ref| / |g_ref| and the name of the reference.

    Where g_ref is zero up to the rounding of the terms that make it, the error is relative to those terms, and
    the name says so.
    """
    difference, scale = norm2(gradient - reference.gradient), norm2(reference.gradient)
    rounding = CANCELLED * np.finfo(np.float64).eps * np.sqrt(len(gradient)) * reference.size
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
