"""Predicted and measured data, and candidates for further sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gradient_routes.problems.data.motion import Motion
from gradient_routes.problems.problem import Array


@dataclass(frozen=True)
class Observation:
    """The data term of J: 1/2 |predicted - data|^2, with the weights of the sum in both.

    predicted (m,)     S u, or S(u, p) if p moves the sensors
    data (m,)          the measurements
    S_u (m, n_u)       derivative of predicted with respect to u, sparse
    S_p (m, n_p)       with respect to p at fixed u, None if zero
    sigma              standard deviation of the noise on data, 0 if unknown
    label              (k) -> name of datum k
    weight             factor contained in predicted, data, S_u and sigma
    relative           weights of the data, relative to their mean accuracy, contained in them as well
    whole              all of this before `modes` (m, k) were eliminated, where there are any
    position (m, d)    of each datum [m], or what else tells which are neighbours, or None
    quantity (m,)      what each of them is, in a word: only data of one quantity are neighbours; None: all are of one
    """

    predicted: Array
    data: Array
    S_u: Any
    S_p: Any = None
    sigma: float = 0.0
    label: Callable[[int], str] = str
    weight: float = 1.0
    relative: Array | float = 1.0
    whole: Observation | None = None
    modes: Array | None = None
    position: Array | None = None
    quantity: Array | None = None

    def weighted(self, w: Array) -> Observation:
        """With factors w (m,), by which J weights the data; those of equal accuracy have one sigma then."""
        from scipy import sparse

        rows = sparse.diags_array(w).tocsr()
        return replace(
            self,
            predicted=w * self.predicted,
            data=w * self.data,
            S_u=rows @ self.S_u,
            S_p=None if self.S_p is None else rows @ self.S_p,
            relative=w * self.relative,
        )

    def without(self, motions: Sequence[Motion]) -> Observation:
        """With the motion of each load case eliminated; S_u is a LinearOperator then. Data after them do not move."""
        from scipy.linalg import block_diag
        from scipy.sparse.linalg import LinearOperator

        S, ends = self.S_u.tocsr(), np.cumsum([len(motion.Q) for motion in motions])
        still = S[ends[-1] :]
        rows = [slice(end - len(motion.Q), end) for end, motion in zip(ends, motions, strict=True)]
        parts = [motion.sampled(S[of]) for motion, of in zip(motions, rows, strict=True)]

        def stacked(v: Array) -> Array:
            return np.concatenate([*(part @ v for part in parts), still @ v])

        def spread(w: Array) -> Array:
            return np.asarray(
                sum(part.T @ w[of] for part, of in zip(parts, rows, strict=True)) + still.T @ w[ends[-1] :]
            )

        def projected(v: Array) -> Array:
            moving = [motion.projected(v[of]) for motion, of in zip(motions, rows, strict=True)]
            return np.concatenate([*moving, v[ends[-1] :]])

        S_p = self.S_p
        if S_p is not None and abs(S_p[: ends[-1]]).sum() > 0.0:
            S_p = np.stack([projected(column) for column in (S_p @ np.eye(S_p.shape[1])).T], axis=1)
        modes = block_diag(*(motion.Q for motion in motions))

        return replace(
            self,
            predicted=projected(self.predicted),
            data=projected(self.data),
            S_u=LinearOperator(S.shape, matvec=stacked, rmatvec=spread, matmat=stacked, rmatmat=spread, dtype=float),
            S_p=S_p,
            whole=self,
            modes=np.pad(modes, ((0, still.shape[0]), (0, 0))),
        )


@dataclass(frozen=True)
class Candidates:
    """Possible sensors; each reads one component of u.

    at (k,)           indices into u
    label             (j) -> name of candidate j
    position (k, d)   of the reading [m], d <= 3, or None
    """

    at: Array
    label: Callable[[int], str]
    position: Array | None = None


def selection(at: Array, n: int, weight: float = 1.0) -> Any:
    """The sparse matrix (m, n) that picks the components `at` (m,), times a weight."""
    from scipy import sparse

    return sparse.csr_array((np.full(len(at), weight), (np.arange(len(at)), at)), shape=(len(at), n))
