"""Many steps of M u'' + C u' + K u = f by one matrix, with as few calls as can be: BLAS gbmv and LAPACK gttrs."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np

from gradient_routes.problems.matrices.step_matrix import Banded, StepMatrix
from gradient_routes.problems.problem import Array

WORTH = 1e6  # nodes times steps from which a march is worth the seconds of the first compilation


@cache
def compiled() -> Any:
    """The module of loops that Numba compiles, or None where it is not installed."""
    if find_spec("numba") is None:
        return None
    from gradient_routes.routes.solvers import compiled_march

    return compiled_march


class StepMarch:
    """A z_t + B z_{t-1} = b_t of z = (u, v), and its transpose, with u eliminated before the march.

    With A = [[a, c], [K, D]], B = [[a', c'], [K', D']] and S = D - c/a K, of known (u, v) before a step

        S v_t = b_2 - K b_1/a - (K' - a'/a K) u - (D' - c'/a K) v,     a u_t = b_1 - a' u - c' v - c v_t

    and for the transpose, of (y, s), r = b_t - mu, mu = B^T (y, s) of the step after it,

        S^T s_t = r_2 - c/a r_1,     a y_t = r_1 - K^T s_t
    """

    def __init__(self, A: StepMatrix, B: StepMatrix, lu: Any, steps: int) -> None:
        from scipy.linalg import get_blas_funcs, get_lapack_funcs

        self.A, self.B, self.lu = A, B, lu
        gttrs: Any = get_lapack_funcs(("gttrs",), lu[:4])
        gbmv: Any = get_blas_funcs(("gbmv",), lu[:4])
        self._gttrs, self._gbmv = gttrs[0], gbmv[0]
        self.by_u = stored(B.K.plus(-B.a / A.a, A.K))
        self.by_v = stored(B.D.plus(-B.b / A.a, A.K))
        self._real = not any(np.iscomplexobj(part) for part in (self.by_u, self.by_v, *lu))
        self._compiled = compiled() if self._real and steps * A.K.main.size >= WORTH else None
        self._factors = () if self._compiled is None else self._compiled.factors(lu)
        self._weights = tuple(float(np.real(x)) for x in (A.a, A.b, B.a, B.b))
        self.K, self.K_T = stored(A.K), stored(A.K.T)
        self.K_before_T, self.D_before_T = stored(B.K.T), stored(B.D.T)

    def _add(self, factor: float, y: Array, M: Array, x: Array) -> Array:
        """y + factor M x, in place of y."""
        N = len(x)
        return np.asarray(self._gbmv(N, N, 1, 1, factor, M, x, beta=1.0, y=y, overwrite_y=True))

    def takes(self, *vectors: Array) -> bool:
        """Whether these can be marched with: real factors drop imaginary parts."""
        return not (self._real and any(map(np.iscomplexobj, vectors)))

    def forward(self, b: Array, z: Array) -> Array:
        """z_t (k, 2 N), from z (2 N,) before them."""
        A, B, N = self.A, self.B, b.shape[1] // 2
        dtype = np.result_type(self.by_u, b, z)
        if self._compiled is not None and dtype == np.float64:
            rows = b.astype(dtype)
            given = self.K, self.by_u, self.by_v, *self._factors, *self._weights
            self._compiled.forward(rows, *given, z[:N].astype(dtype), z[N:].astype(dtype))
            return rows
        rows = np.empty(b.shape, dtype)
        u, v, of_u = z[:N], z[N:], b[:, :N] / A.a
        of_v = np.ascontiguousarray(b[:, N:] - A.K.rows(of_u), dtype=dtype)
        for t in range(len(b)):
            r = self._add(-1.0, self._add(-1.0, of_v[t], self.by_u, u), self.by_v, v)
            new, _ = self._gttrs(*self.lu, r, overwrite_b=True)
            moved = of_u[t] - (B.a / A.a) * u
            moved -= (B.b / A.a) * v
            moved -= (A.b / A.a) * new
            rows[t, :N], rows[t, N:] = u, v = moved, new
        return rows

    def backward(self, b: Array, mu: Array) -> tuple[Array, Array]:
        """lam_t (k, 2 N), mu (2 N,) being B^T lam of the step after them, and B^T lam of the first."""
        A, B, N = self.A, self.B, b.shape[1] // 2
        rows = np.array(b, dtype=np.result_type(self.by_u, b, mu))
        by_u, by_v = mu[:N].astype(rows.dtype), mu[N:].astype(rows.dtype)
        if self._compiled is not None and rows.dtype == np.float64:
            given = self.K_T, self.K_before_T, self.D_before_T, *self._factors, *self._weights
            self._compiled.backward(rows, *given, by_u, by_v)
            return rows, np.concatenate([by_u, by_v])
        for t in range(len(b))[::-1]:
            r, q = rows[t, :N], rows[t, N:]
            r -= by_u
            q -= by_v
            q -= (A.b / A.a) * r
            s, _ = self._gttrs(*self.lu, q, trans="T", overwrite_b=True)
            y = self._add(-1.0, r, self.K_T, s)
            y /= A.a
            by_u, by_v = self._add(1.0, B.a * y, self.K_before_T, s), self._add(1.0, B.b * y, self.D_before_T, s)
            rows[t, :N], rows[t, N:] = y, s
        return rows, np.concatenate([by_u, by_v])


def stored(M: Banded) -> Array:
    """(3, N): M's diagonals as BLAS takes them."""
    band = np.zeros((3, len(M.main)), np.result_type(M.main, M.lower), order="F")
    band[0, 1:], band[1], band[2, :-1] = M.upper, M.main, M.lower
    return band
