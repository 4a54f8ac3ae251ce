"""K = B^T D B: the sums are accurate, the zeros exact, the factorization inverts."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.chain import BLOCKED_FROM, Chain, ElementForces, cumulative_sum, difference, divergence
from problems.errors import SingularMatrix
from routes.factorization import Factorizer

factorize = Factorizer()

lengths = st.sampled_from([1, 2, 3, 17, BLOCKED_FROM - 1, BLOCKED_FROM, BLOCKED_FROM + 1, 64**2 + 64, 10_007])
seeds = st.integers(0, 2**32 - 1)


def dense_B(n: int) -> np.ndarray:
    return np.eye(n) - np.eye(n, k=-1)


@settings(deadline=None)
@given(lengths, seeds)
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


@settings(deadline=None)
@given(lengths, seeds, st.booleans())
def test_zeros_behind_the_last_entry_stay_exact(n: int, seed: int, imaginary: bool) -> None:
    """A load that ends at node m moves what lies behind rigidly: no strain there, in any rounding."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, n + 1))
    b = np.zeros(n, complex if imaginary else float)
    b[:m] = rng.standard_normal(m) * (1j if imaginary else 1.0)
    u = factorize(Chain(rng.uniform(0.1, 10.0, n)), "test").solve(b)
    assert not difference(u)[m:].any()


@pytest.mark.parametrize("n", [1, 2, 7])
def test_operators_equal_their_dense_matrices(n: int) -> None:
    rng = np.random.default_rng(n)
    D, s, v = rng.uniform(1, 2, (3, n))
    B = dense_B(n)
    K = B.T @ np.diag(D) @ B
    np.testing.assert_allclose(difference(v), B @ v, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(divergence(v), B.T @ v, rtol=1e-15, atol=1e-15)
    np.testing.assert_allclose(Chain(D) @ v, K @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(Chain(D).T @ v, K.T @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(ElementForces(s) @ v, B.T @ np.diag(s) @ v, rtol=1e-14, atol=1e-14)
    np.testing.assert_allclose(ElementForces(s).T @ v, np.diag(s) @ B @ v, rtol=1e-14, atol=1e-14)
    assert np.abs(K).sum(axis=1).max() <= Chain(D).norm <= 4 * np.abs(K).sum(axis=1).max()


@pytest.mark.parametrize("kind", ["chain", "dense", "sparse"])
def test_factorizations_invert_the_matrix_and_its_transpose(kind: str) -> None:
    from scipy.sparse import csr_array

    rng = np.random.default_rng(0)
    n = 9
    b = rng.standard_normal(n)
    A = rng.standard_normal((n, n)) + 4 * np.eye(n)  # not symmetric: a wrong transpose shows
    A = {"chain": Chain(rng.uniform(1, 2, n)), "dense": A, "sparse": csr_array(A)}[kind]
    factors = factorize(A, "test")
    np.testing.assert_allclose(A @ factors.solve(b), b, rtol=1e-12, atol=1e-13)  # cond(A) eps, with room
    np.testing.assert_allclose(A.T @ factors.solve_transposed(b), b, rtol=1e-12, atol=1e-13)


def test_singular_matrices_are_refused_with_a_sentence() -> None:
    from scipy.sparse import csr_array

    with pytest.raises(SingularMatrix, match="element 2"):
        factorize(Chain(np.array([1.0, 0.0])), "test")
    for A in (np.zeros((2, 2)), csr_array((2, 2)), csr_array(np.diag([1.0, 0.0]))):
        with pytest.raises(SingularMatrix, match="check p and the supports"):
            factorize(A, "test")
