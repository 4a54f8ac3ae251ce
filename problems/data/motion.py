"""Rigid motion of what measured: a camera or a grip that moves adds B m to all displacements, whatever the body does.

    min over m of 1/2 |S u + B m - d|^2 = 1/2 |P (S u - d)|^2,    P = I - Q Q^T,    Q an orthonormal basis of range(B)

Variable projection (Golub & Pereyra 1973): m is linear, so it is eliminated exactly, and derivatives of the right side
are those of J.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

MotionName = Literal["none", "rigid", "translation"]
RANK = 1e-10  # of the largest singular value of B: modes below it are not seen
RIGID = 1e-9  # of |d|: what is left of data that are all motion
AXES = "xyz"


@dataclass(frozen=True, eq=False)
class Motion:
    """Modes B (m, k) at what is measured, weighted as J weights it; their names; Q (m, rank)."""

    B: Array
    names: tuple[str, ...]
    Q: Array

    @classmethod
    def of(cls, kind: MotionName, x: Array, measured: Array, weights: Array | None, turns: bool) -> Motion | None:
        """Of points x (m, d); measured, weights (m, d) as of Probes; turns: of a body of revolution, which moves along
        its axis alone. Rotations, small ones, are about the points' centre.
        """
        if kind == "none":
            return None
        names, modes = _modes(x, turns) if kind == "rigid" or turns else _translations(x)
        B = np.stack([(mode if weights is None else weights * mode)[measured] for mode in modes], axis=1)
        U, s, _ = np.linalg.svd(B / (np.linalg.norm(B, axis=0) + np.finfo(float).tiny), full_matrices=False)
        return cls(B, tuple(names), U[:, s > RANK * s.max()])

    def padded(self, count: int) -> Motion:
        """With `count` more data, which it does not move."""
        rows = ((0, count), (0, 0))
        return Motion(np.pad(self.B, rows), self.names, np.pad(self.Q, rows))

    def check(self, d: Array, who: str) -> None:
        """Raises InputError for data (cases, m) that are all motion."""
        left = np.linalg.norm(self.projected(d))
        if self.Q.shape[0] <= self.Q.shape[1] or left <= RIGID * np.linalg.norm(d):
            raise InputError(f"{who}: motion= leaves nothing of the data: all of them move as one - leave it out")

    def projected(self, r: Any) -> Any:
        """P r, of r (..., m)."""
        return r - (r @ self.Q) @ self.Q.T

    def of_residual(self, r: Array) -> dict[str, float]:
        """m (k,) [m, rad] at which |r + B m| is least, by name; nan for what these data do not tell apart."""
        m, *_ = np.linalg.lstsq(self.B, -r, rcond=RANK)
        size = np.linalg.norm(self.B, axis=0)
        scaled = self.B / np.where(size > 0.0, size, 1.0)
        _, s, Vt = np.linalg.svd(scaled, full_matrices=True)
        blind = np.abs(Vt[np.count_nonzero(s > RANK * s.max()) :]).max(axis=0, initial=0.0) > np.sqrt(RANK)
        return dict(zip(self.names, np.where(blind, np.nan, m).tolist(), strict=True))

    def sampled(self, S_u: Any) -> Any:
        """P S_u of one load case, as a LinearOperator: P is dense."""
        from scipy.sparse.linalg import LinearOperator, aslinearoperator

        def P(v: Array) -> Array:
            return np.asarray(v - self.Q @ (self.Q.T @ v))

        m = len(self.Q)
        return LinearOperator((m, m), matvec=P, rmatvec=P, matmat=P, rmatmat=P, dtype=float) @ aslinearoperator(S_u)


def _translations(x: Array) -> tuple[Sequence[str], list[Array]]:
    axes = range(x.shape[1])
    return [f"u{AXES[i]} [m]" for i in axes], [np.broadcast_to(np.eye(len(axes))[i], x.shape) for i in axes]


def _modes(x: Array, turns: bool) -> tuple[Sequence[str], list[Array]]:
    """All modes (m, d): translations, and e x (x - centre)."""
    names, modes = _translations(x)
    if turns:
        return names[1:], modes[1:]
    from_centre = x - x.mean(axis=0)
    planes = [(0, 1)] if x.shape[1] == 2 else [(1, 2), (2, 0), (0, 1)]
    rotations = []
    for i, j in planes:
        mode = np.zeros_like(x)
        mode[:, i], mode[:, j] = -from_centre[:, j], from_centre[:, i]
        rotations.append(mode)
    return [*names, *(f"rotation in {AXES[i]}{AXES[j]} [rad]" for i, j in planes)], [*modes, *rotations]
