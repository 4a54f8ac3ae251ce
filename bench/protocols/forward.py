"""Another's forward model, F(p) and w -> (dF/dp)^T w, as the subject of a check."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from gradient_routes.bench.protocols.http import NoValue
from gradient_routes.bench.verification import foreign
from gradient_routes.bench.verification.finding import Finding
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

LEAST = 1e-6  # of the largest output: a smaller one, which may be rounding, counts less
ALIKE = 1e-6  # relative: what solvers leave in products with dF/dp and its transpose


class Forward(Protocol):
    """F(p) (m,), (dF/dp)^T w (n_p,) and, where it `pushes`, (dF/dp) v (m,), which raise NoValue where there is none.

    who    in errors and verdicts
    start  (n_p,), None where it has none; names of the components, None where they are numbered
    """

    who: str

    @property
    def n_p(self) -> int: ...
    @property
    def start(self) -> Array | None: ...
    @property
    def names(self) -> Sequence[str] | None: ...
    @property
    def pushes(self) -> bool: ...
    def value(self, p: Array) -> Array: ...
    def pullback(self, p: Array, w: Array) -> Array: ...
    def pushforward(self, p: Array, v: Array) -> Array: ...


def subject(F: Forward, at: Array | None, data: Array | None, seed: int) -> Subject:
    """J(p) = 1/2 |F(p) - d|^2 where data d (m,) are given, F(p) where that is one number, else w . F(p).

    w_k is random, of the size of 1 / F_k at the start: outputs count alike, but for those that may be rounding. Raises
    InputError.
    """
    p = F.start if at is None else at
    if p is None:
        raise InputError(f"{F.who}: has no start - give the point, {F.n_p} values, with --at FILE.csv")
    if len(p) != F.n_p:
        raise InputError(f"{F.who}: p has {len(p)} values, n_p = {F.n_p} - give {F.n_p}")
    size = _size(F, p)
    m = 1 if size is None else len(size)
    if data is not None and size is not None and len(data) != m:
        raise InputError(f"{F.who}: {len(data)} data, F(p) has m = {m} - give {m}")
    weights = np.ones(m)
    if size is not None and m > 1:
        least = LEAST * size.max() or 1.0
        weights = np.random.default_rng(seed).standard_normal(m) / np.maximum(size, least)

    def by_F(q: Array) -> Array:
        """dJ/dF, (m,)."""
        return weights if data is None else F.value(q) - data

    def functions(factor: float) -> tuple[Callable[[Array], Any], Callable[[Array], Array]]:
        """factor J and its gradient."""

        def J(q: Array) -> Any:
            if data is None:
                return factor * (weights @ F.value(q))
            r = F.value(q) - data
            return factor * 0.5 * (r @ r)

        return J, lambda q: F.pullback(q, factor * by_F(q))

    made = foreign.subject(*functions(1.0), p, name=F.who, names=F.names, scaled=functions)
    return replace(made, explain=lambda g: [_transposes(F, made, g, by_F, seed)] if F.pushes else [])


def _size(F: Forward, p: Array) -> Array | None:
    """|F_k(p)|, (m,); None where there is no F(p), which the check then says."""
    try:
        return np.abs(F.value(p))
    except NoValue:
        return None


def _transposes(F: Forward, of: Subject, g: Array, by_F: Callable[[Array], Array], seed: int) -> Finding:
    """w . (dF/dp v) against (dF/dp)^T w . v, w = dJ/dF and a random v of natural changes."""
    name, v = "w . (dF/dp v) = (dF/dp)^T w . v", of.natural * np.random.default_rng(seed).standard_normal(len(of.p))
    try:
        w, F_p_v = by_F(of.p), F.pushforward(of.p, v)
    except NoValue as failure:
        return Finding(name, float("nan"), ALIKE, str(failure))
    size = np.abs(w) @ np.abs(F_p_v) + np.abs(g) @ np.abs(v)
    off = float(abs(w @ F_p_v - g @ v) / (size or 1.0))
    return Finding(name, off, ALIKE, "" if off <= ALIKE else "one of the two is not the transpose of the other")
