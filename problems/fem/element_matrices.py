"""Element matrices from moduli at the quadrature points."""

from __future__ import annotations

import numpy as np

from gradient_routes.problems.problem import Array

CELLS_PER_CHUNK = 128  # their arrays stay in cache


def element_matrices(A_dx: Array, dN: Array, selected: Array) -> Array:
    """Entries `selected` (k,), counted row by row, of the matrices sum over points of dN_a,J A_iJkL dN_b,L dx.

    (n_e, k). A_dx (n_e, n_q, m, d, d, m) has the index order J i k L: two matrix products suffice, without transposes.
    """
    n_e, d, (_, n_q, n_a, m) = len(A_dx), A_dx.shape[3], dN.shape
    a, i, b, k = positions(selected, n_a, d)
    at = ((a * d + i) * d + k) * n_a + b
    entries = np.empty((n_e, len(selected)), np.result_type(A_dx, dN))
    for first in range(0, n_e, CELLS_PER_CHUNK):
        chunk = slice(first, first + CELLS_PER_CHUNK)
        G = np.ascontiguousarray((dN[chunk] if len(dN) > 1 else dN).transpose(0, 1, 3, 2))  # (chunk, n_q, m, n_a)
        AG = A_dx[chunk].reshape(-1, n_q, m * d * d, m) @ G  # (chunk, n_q, J i k, b)
        K = G.reshape(-1, m * n_q, n_a).transpose(0, 2, 1) @ AG.reshape(-1, m * n_q, d * d * n_a)  # (chunk, a, i k b)
        np.take(K.reshape(-1, d * d * n_a * n_a), at, axis=1, out=entries[chunk])
    return entries


def positions(selected: Array, n_a: int, d: int) -> tuple[Array, Array, Array, Array]:
    """a, i, b, k of the entries (ai)(bk) of element matrices, counted row by row."""
    row, column = np.divmod(selected, d * n_a)
    return row // d, row % d, column // d, column % d
