"""A gradient as its author returns it: its shape, its numbers and its precision looked at before it is believed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gradient_routes.bench.verification.guarded import DOUBLE, FOREIGN, SINGLE, plain
from gradient_routes.bench.verification.subject import Subject
from gradient_routes.problems.errors import RoutesError
from gradient_routes.problems.problem import Array

MANY = 3  # components that are no round numbers


@dataclass(frozen=True)
class Asked:
    """gradient (n_p,) float64; eps of the numbers it came in; remarks on what was odd about it."""

    gradient: Array
    eps: float
    remarks: tuple[str, ...]


class Unusable(RoutesError):
    """What came back is no gradient; `wrong` where that is the gradient's own fault, not a failure to compute it."""

    def __init__(self, message: str, wrong: bool) -> None:
        super().__init__(message)
        self.wrong = wrong


def ask(subject: Subject) -> Asked:
    """dJ/dp at subject.p, once. Raises Unusable."""
    given, n_p = subject.p.copy(), len(subject.p)
    try:
        with np.errstate(all="ignore"):
            raw = np.asarray(plain(subject.gradient(given)))
    except FOREIGN as failure:
        said = " ".join(str(failure).split())
        raise Unusable(f"the gradient raises {type(failure).__name__}: {said}", wrong=False) from failure
    remarks: tuple[str, ...] = (
        () if np.array_equal(given, subject.p) else ("the gradient changes p in place: it was given a copy",)
    )
    if np.iscomplexobj(raw) or raw.dtype.kind not in "fiu":
        raise Unusable(f"the gradient is of {raw.dtype}, not of real numbers", wrong=True)
    if raw.size != n_p or (raw.ndim > 1 and raw.shape != (n_p, 1) and raw.shape != (1, n_p)):
        raise Unusable(f"the gradient has the shape {raw.shape} for {n_p} parameters", wrong=True)
    if raw.ndim != 1:
        remarks += (f"the gradient has the shape {raw.shape}: read as ({n_p},)",)
    gradient = raw.reshape(n_p).astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(gradient))
    if bad.size:
        first = f"{subject.label(int(bad[0]))}: {gradient[bad[0]]}"
        raise Unusable(f"{bad.size} of {n_p} components of the gradient are not finite, first {first}", wrong=True)
    return Asked(gradient, precision(raw, gradient), remarks + _single(raw, gradient))


def precision(raw: Any, gradient: Array) -> float:
    """float32's epsilon where the gradient came in it, or where its numbers are as long as float32's and no longer.

    Round numbers, 0.5 or 3, fit into float16, too: they tell nothing.
    """
    if raw.dtype.kind == "f" and raw.dtype.itemsize < 8:
        return max(SINGLE, float(np.finfo(raw.dtype).eps))
    with np.errstate(over="ignore"):
        fits = (gradient.astype(np.float32) == gradient).all()
        long = np.count_nonzero(gradient.astype(np.float16) != gradient)
    return SINGLE if fits and long >= MANY else DOUBLE


def _single(raw: Any, gradient: Array) -> tuple[str, ...]:
    eps = precision(raw, gradient)
    if eps == DOUBLE:
        return ()
    what = f"is {raw.dtype}" if raw.dtype.itemsize < 8 else "holds float32 numbers"
    return (f"the gradient {what}: judged with eps = {eps:.2g}",)
