"""Slopes of J along given directions, for judging gradients too long to be computed twice."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.errors import NotConverged
from gradient_routes.problems.problem import Array
from gradient_routes.routes.imaginary import RELATIVE_STEP, refuse_losses
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import State, norm
from gradient_routes.routes.solvers.solver import Factorization

RTOL = 1e-13  # of |Im R|, which starts as h R_p v
SOUND = 1e-6  # of the same: where rounding stops it above, the slope is not to be trusted
SOLVES = 20


def complex_slopes(model: Model, p: Array, V: Array) -> Array:
    """V^T dJ/dp (m,) for V (n_p, m): Im J(p + i h v) / h, each from the real solution, on its factors: complex ones are
    twice as large and take four times as long.

    Raises LostImaginaryPart, NotConverged, SingularMatrix.
    """
    base = model.solve(p, polish=1)
    factors = PartsApart(base.factors)
    refuse_losses(model.problem, base.u, p)
    scale = model.parameters.scale
    natural = np.where(p == 0.0, scale, np.minimum(np.abs(p), scale))[:, None]
    slopes = np.empty(V.shape[1])
    for j, h in enumerate(RELATIVE_STEP * (natural / np.maximum(np.abs(V), natural)).min(axis=0)):
        slopes[j] = _solve_imaginary(model, p + 1j * h * V[:, j], base, factors).J.imag / h
    return slopes


class PartsApart(Factorization):
    """Factors of a real matrix, for complex right-hand sides."""

    def __init__(self, factors: Factorization) -> None:
        self.name, self.norm, self._factors = factors.name, factors.norm, factors

    @property
    def nbytes(self) -> int:
        return self._factors.nbytes

    def substitute(self, b: Array, transposed: bool) -> Array:
        real, imaginary = (self._factors.substitute(part, transposed) for part in (b.real, b.imag))
        return real + 1j * imaginary


def _solve_imaginary(model: Model, q: Array, start: State, factors: Factorization) -> State:
    """The state at q, a complex step from `start`, solved until Im R is rounding: |R| itself is so from the start."""
    state, first = start, norm(model.residual(start.u.astype(q.dtype), q).imag)
    left = first
    for _ in range(SOLVES):
        state = model.solve(q, state, factors)
        before, left = left, norm(model.residual(state.u, q).imag)
        if not first or left <= RTOL * first or (left > 0.5 * before and left <= SOUND * first):
            return state
    raise NotConverged(
        f"{model.problem.name}: Im R falls to {left / first:.2g} of its start only - check R_u", state.history
    )
