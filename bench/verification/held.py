"""A subject in its free parameters, where bounds hold others at one value."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gradient_routes.bench.verification.guarded import detached
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.problem import Array


def without(subject: Subject, held: Array) -> Subject:
    """The subject in the components that are not held (n_p,), the others at their values."""
    free, at = np.flatnonzero(~held), subject.p

    def whole(q: Array) -> Array:
        p = at.copy()
        p[free] = q
        return p

    def of_whole(f: Callable[[Array], Any] | None) -> Any:
        return None if f is None else lambda q: f(whole(q))

    def gradient(g: Callable[[Array], Any]) -> Callable[[Array], Any]:
        def of_free(q: Array) -> Any:
            given = np.asarray(detached(g(whole(q))))
            return given.reshape(-1)[free] if given.size == len(at) else given

        return of_free

    def version(make: Callable[[float], Subject] | None) -> Callable[[float], Subject] | None:
        return None if make is None else lambda factor: without(make(factor), held)

    names = ", ".join(subject.label(int(i)) for i in np.flatnonzero(held))
    return replace(
        subject,
        objective=of_whole(subject.objective),
        gradient=gradient(subject.gradient),
        p=at[free],
        scale=subject.scale[free],
        lower=subject.lower[free],
        upper=subject.upper[free],
        label=lambda i: subject.label(int(free[i])),
        tighten=version(subject.tighten),
        scaled=version(subject.scaled),
        active_set=of_whole(subject.active_set),
        fresh=of_whole(subject.fresh),
        places=free,
        notes=(*subject.notes, f"held by equal bounds, left out: {names}"),
    )
