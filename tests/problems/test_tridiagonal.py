"""Tridiagonal matrices K = B^T D B: accurate sums, exact zeros, factorizations."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from gradient_routes.problems.errors import SingularMatrix
from gradient_routes.problems.matrices.tridiagonal import (
    BLOCKED_FROM,
    BorderedTridiagonal,
    ElementForces,
    Tridiagonal,
    cumulative_sum,
    difference,
    divergence,
)
from gradient_routes.routes.solvers.factorization import Factorizer

factorize = Factorizer()

LENGTHS = [1, 2, 3, 17, BLOCKED_FROM - 1, BLOCKED_FROM, BLOCKED_FROM + 1, 64**2 + 64, 10_007]


def dense_B(n: int) -> np.ndarray:
    return np.eye(n) - np.eye(n, k=-1)


@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("seed", range(3))
def test_partial_sums_equal_rational_ones(n: int, seed: int) -> None:
    x = np.random.default_rng(seed).uniform(0.5, 1.0, n)
    sums = cumulative_sum(x)
    for k in {0, n // 2, n - 1}:
        exact = float(sum(Fraction(v) for v in x[: k + 1]))
        # a sum passes at most 2 sqrt(n) + 1 additions, each wrong by eps / 2
        assert abs(sums[k] - exact) <= (np.sqrt(n) + 1) * np.finfo(float).eps * exact


def test_a_million_equal_numbers_sum_without_drift() -> None:
    n = 10**6
    assert abs(cumulative_sum(np.full(n, 1e-6))[-1] - 1.0) < 1e-13  # one after the other: 8e-12


@pytest.mark.parametrize("n", LENGTHS)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("imaginary", [False, True])
def test_zeros_behind_the_last_entry_stay_exact(n: int, seed: int, imaginary: bool) -> None:
    """A load that ends at node m moves what lies behind rigidly: no strain there, in any rounding."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, n + 1))
    b = np.zeros(n, complex if imaginary else float)
    b[:m] = rng.standard_normal(m) * (1j if imaginary else 1.0)
    u = factorize(Tridiagonal(rng.uniform(0.1, 10.0, n)), "test").solve(b)
    assert not difference(u)[m:].any()


@pytest.mark.parametrize("n", [1, 2, 7])
def test_operators_equal_their_dense_matrices(n: int) -> None:
    rng = np.random.default_rng(n)
    D, s, v = rng.uniform(1, 2, (3, n))
    B = dense_B(n)
    K = B.T @ np.diag(D) @ B
    np.testing.assert_allclose(difference(v), B @ v, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(divergence(v), B.T @ v, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(Tridiagonal(D) @ v, K @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(Tridiagonal(D).T @ v, K.T @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(ElementForces(s) @ v, B.T @ np.diag(s) @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(ElementForces(s).T @ v, np.diag(s) @ B @ v, rtol=1e-14, atol=1e-14)
    assert np.abs(K).sum(axis=1).max() <= Tridiagonal(D).norm <= 4 * np.abs(K).sum(axis=1).max()
    e, w = np.eye(n)[-1], rng.uniform(1, 2, n + 1)
    stopped, c = K + 3.0 * np.outer(e, e), 0.5
    np.testing.assert_allclose(Tridiagonal(D, 3.0) @ v, stopped @ v, rtol=1e-14, atol=1e-14)
    active = np.block([[K + c * np.outer(e, e), e[:, None]], [e[None], np.zeros((1, 1))]])
    inactive = np.block([[K, np.zeros((n, 1))], [np.zeros((1, n)), np.full((1, 1), -1 / c)]])
    matrices = (
        (stopped, Tridiagonal(D, 3.0)),
        (active, BorderedTridiagonal(D, c, True)),
        (inactive, BorderedTridiagonal(D, c, False)),
    )
    for dense, A in matrices:
        np.testing.assert_allclose(A @ w[: len(dense)], dense @ w[: len(dense)], rtol=1e-14, atol=1e-14)
        assert np.abs(dense).sum(axis=1).max() <= A.norm <= 4 * np.abs(dense).sum(axis=1).max()
    forces = np.vstack([B.T @ np.diag(s), np.zeros(n)])
    np.testing.assert_allclose(ElementForces(s, 1) @ v, forces @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(ElementForces(s, 1).T @ w, forces.T @ w, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("k", [1e-8, 1.0, 1e8, 1e16])
@pytest.mark.parametrize("n", [1, 2, 9, BLOCKED_FROM + 1])
@pytest.mark.parametrize("imaginary", [False, True])
def test_stopped_chains_are_inverted_however_stiff_the_stop(n: int, k: float, imaginary: bool) -> None:
    """Every force of A x = b is found to rounding of the largest, and that of the stop is one of them."""
    rng = np.random.default_rng(0)
    D, b = rng.uniform(1, 2, n), rng.standard_normal(n + 1)
    D, b = (D + 0.1j * rng.standard_normal(n), b + 1j * rng.standard_normal(n + 1)) if imaginary else (D, b)
    for A in (Tridiagonal(D, k), BorderedTridiagonal(D, k, True), BorderedTridiagonal(D, k, False)):
        f = b[: n + (not isinstance(A, Tridiagonal))]
        x = factorize(A, "test").solve(f)
        rounding = 1e-15 * max(np.abs(x).max() * 4 * np.sqrt(n), 1.0)
        if isinstance(A, BorderedTridiagonal) and A.active:
            rounding *= 1 + k  # a prescribed u_N loads its spring c with c u_N, and so lam
        assert np.abs(A @ x - f).max() < 10 * rounding


@pytest.mark.parametrize("kind", ["chain", "stopped", "active", "inactive", "dense", "sparse"])
def test_factorizations_invert_the_matrix_and_its_transpose(kind: str) -> None:
    from scipy.sparse import csr_array

    rng = np.random.default_rng(0)
    n = 9
    b, D = rng.standard_normal(n), rng.uniform(1, 2, n)
    A = rng.standard_normal((n, n)) + 4 * np.eye(n)  # not symmetric: a wrong transpose shows
    A = {
        "chain": Tridiagonal(D),
        "stopped": Tridiagonal(D, 3.0),
        "active": BorderedTridiagonal(D[1:], 3.0, True),
        "inactive": BorderedTridiagonal(D[1:], 3.0, False),
        "dense": A,
        "sparse": csr_array(A),
    }[kind]
    factors = factorize(A, "test")
    np.testing.assert_allclose(A @ factors.solve(b), b, rtol=1e-12, atol=1e-13)  # cond(A) eps, with room
    np.testing.assert_allclose(A.T @ factors.solve_transposed(b), b, rtol=1e-12, atol=1e-13)


def test_singular_matrices_are_refused_with_a_sentence() -> None:
    from scipy.sparse import csr_array

    with pytest.raises(SingularMatrix, match="element 2"):
        factorize(Tridiagonal(np.array([1.0, 0.0])), "test")
    for A in (np.zeros((2, 2)), csr_array((2, 2)), csr_array(np.diag([1.0, 0.0]))):
        with pytest.raises(SingularMatrix, match="check p and the supports"):
            factorize(A, "test")
