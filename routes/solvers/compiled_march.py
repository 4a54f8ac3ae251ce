"""The march of `StepMarch` compiled by Numba, an extra: the same equations, loop by loop."""

from __future__ import annotations

import numpy as np
from numba import njit

from gradient_routes.problems.problem import Array


@njit(cache=True)
def _times(M: Array, x: Array, y: Array, factor: float) -> None:
    """y + factor M x, in place; M (3, N) as BLAS stores diagonals."""
    last = len(x) - 1
    for i in range(last + 1):
        total = M[1, i] * x[i]
        if i > 0:
            total += M[2, i - 1] * x[i - 1]
        if i < last:
            total += M[0, i + 1] * x[i + 1]
        y[i] += factor * total


@njit(cache=True)
def _solve(dl: Array, by_d: Array, du: Array, du2: Array, swapped: Array, b: Array) -> None:
    """A^{-1} b in place, by the factors of gttrf; by_d: 1/d, swapped: whether rows i and i + 1 were."""
    n = len(b)
    for i in range(n - 1):
        if swapped[i]:
            b[i], b[i + 1] = b[i + 1], b[i] - dl[i] * b[i + 1]
        else:
            b[i + 1] -= dl[i] * b[i]
    b[n - 1] *= by_d[n - 1]
    b[n - 2] = (b[n - 2] - du[n - 2] * b[n - 1]) * by_d[n - 2]
    for i in range(n - 3, -1, -1):
        b[i] = (b[i] - du[i] * b[i + 1] - du2[i] * b[i + 2]) * by_d[i]


@njit(cache=True)
def _solve_transposed(dl: Array, by_d: Array, du: Array, du2: Array, swapped: Array, b: Array) -> None:
    """A^{-T} b in place."""
    n = len(b)
    b[0] *= by_d[0]
    b[1] = (b[1] - du[0] * b[0]) * by_d[1]
    for i in range(2, n):
        b[i] = (b[i] - du[i - 1] * b[i - 1] - du2[i - 2] * b[i - 2]) * by_d[i]
    for i in range(n - 2, -1, -1):
        if swapped[i]:
            b[i], b[i + 1] = b[i + 1], b[i] - dl[i] * b[i + 1]
        else:
            b[i] -= dl[i] * b[i + 1]


@njit(cache=True)
def forward(rows, K, by_u, by_v, dl, by_d, du, du2, swapped, a, c, a_0, c_0, u, v):  # type: ignore[no-untyped-def]
    """Solves in place in rows (k, 2 N), from u and v (N,) before them; a, c, a_0, c_0: of A and B."""
    N = len(u)
    for t in range(len(rows)):
        new_u, new_v = rows[t, :N], rows[t, N:]
        for i in range(N):
            new_u[i] /= a
        _times(K, new_u, new_v, -1.0)
        _times(by_u, u, new_v, -1.0)
        _times(by_v, v, new_v, -1.0)
        _solve(dl, by_d, du, du2, swapped, new_v)
        for i in range(N):
            new_u[i] -= (a_0 / a) * u[i] + (c_0 / a) * v[i] + (c / a) * new_v[i]
        u, v = new_u, new_v


@njit(cache=True)
def backward(rows, K_T, K_before_T, D_before_T, dl, by_d, du, du2, swapped, a, c, a_0, c_0, by_u, by_v):  # type: ignore[no-untyped-def]
    """Solves in place in rows (k, 2 N), from the last to the first, and in by_u, by_v (N,), which are B^T lam."""
    N = len(by_u)
    for t in range(len(rows) - 1, -1, -1):
        y, s = rows[t, :N], rows[t, N:]
        for i in range(N):
            y[i] -= by_u[i]
            s[i] -= by_v[i] + (c / a) * y[i]
        _solve_transposed(dl, by_d, du, du2, swapped, s)
        _times(K_T, s, y, -1.0)
        for i in range(N):
            y[i] /= a
            by_u[i], by_v[i] = a_0 * y[i], c_0 * y[i]
        _times(K_before_T, s, by_u, 1.0)
        _times(D_before_T, s, by_v, 1.0)


def factors(lu: tuple[Array, ...]) -> tuple[Array, ...]:
    """gttrf's dl, d, du, du2, ipiv as these loops take them."""
    dl, d, du, du2, ipiv = lu
    return dl, 1.0 / d, du, du2, ipiv[:-1] != np.arange(1, len(d))
