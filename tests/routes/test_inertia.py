"""Numbers of negative eigenvalues by factorizations, against dense eigenvalues; unstable states are said to be so."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import somewhere
from scipy.sparse import csr_array
from test_factorization import as_general

from gradient_routes.problems.block import Block
from gradient_routes.problems.matrices.sparse import BlockDiagonal, SymmetricSparse
from gradient_routes.problems.matrices.tridiagonal import BorderedTridiagonal, Tridiagonal
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.solvers.factorization import Factorizer

BLOCK = Block(n=2, parametrization="raw", derivatives="hand")
K = BLOCK.tangent(np.zeros(BLOCK.n_state), somewhere(BLOCK))  # no two eigenvalues are equal


def shifted(quantile: float) -> SymmetricSparse:
    """K - s I with s between two eigenvalues."""
    eigenvalues = np.linalg.eigvalsh(K.full().toarray())
    k = int(quantile * len(eigenvalues))
    data = K.data.copy()
    data[K.pattern.indptr[:-1]] -= 0.5 * (eigenvalues[k - 1] + eigenvalues[k]) if k else 0.0
    return SymmetricSparse(K.pattern, data)


@pytest.mark.parametrize("quantile", [0.0, 0.02, 0.1, 0.5, 0.9])
@pytest.mark.parametrize("linear_solver", ["pardiso", "superlu"])
def test_sparse_factors_count_negative_eigenvalues(linear_solver: str, quantile: float) -> None:
    A = shifted(quantile)
    expected = int((np.linalg.eigvalsh(A.full().toarray()) < 0.0).sum())
    assert Factorizer(linear_solver)(A, "test").negative_eigenvalues == expected
    both = BlockDiagonal((A, shifted(0.02)))
    assert Factorizer(linear_solver)(both, "test").negative_eigenvalues == expected + 1


@pytest.mark.parametrize(
    "A",
    [
        Tridiagonal(np.array([1.0, 2.0, 3.0])),
        Tridiagonal(np.array([1.0, 2.0, 3.0]), 5.0),
        Tridiagonal(np.array([1.0, 2.0, 3.0]), -0.5),
        Tridiagonal(np.array([1.0, 2.0, 3.0]), -0.6),
        BorderedTridiagonal(np.array([1.0, 2.0]), 1.0, True),
        BorderedTridiagonal(np.array([1.0, 2.0]), 2.0, False),
        np.diag([1.0, -2.0, -3.0]) + 0.1,
        np.array([[0.0, 1.0, 2.0], [1.0, 0.0, 3.0], [2.0, 3.0, 0.0]]),  # pivots of 2 x 2
    ],
)
def test_chains_and_dense_matrices_count_theirs(A) -> None:
    n = A.shape[0] if isinstance(A, np.ndarray) else len(A.D) + isinstance(A, BorderedTridiagonal)
    full = np.column_stack([A @ e for e in np.eye(n)])
    assert Factorizer()(A, "test").negative_eigenvalues == (np.linalg.eigvalsh(full) < 0.0).sum()


@pytest.mark.parametrize(
    ("A", "linear_solver"),
    [
        (as_general(K), "pardiso"),
        (as_general(K), "superlu"),
        (csr_array(np.eye(3)), "auto"),
        (SymmetricSparse(K.pattern, K.data + 0j), "pardiso"),
        (SymmetricSparse(K.pattern, K.data + 0j), "superlu"),
        (Tridiagonal(np.ones(3) + 0j), "auto"),
        (BorderedTridiagonal(np.ones(3) + 0j, 1.0, True), "auto"),
        (np.array([[1.0, 2.0], [0.0, 1.0]]), "auto"),
        (K, "krylov"),
        (K, "cg-amg"),
        (BlockDiagonal((K, as_general(K))), "auto"),
    ],
)
def test_what_is_not_symmetric_or_not_factorized_is_not_counted(A, linear_solver: str) -> None:
    assert Factorizer(linear_solver)(A, "test").negative_eigenvalues is None


@pytest.mark.parametrize("solver", [Solver(), Solver(newton="inexact"), Solver(linear_solver="superlu")])
@pytest.mark.parametrize("traction", [-0.02, 0.02])
def test_a_column_past_its_critical_load_is_unstable(solver: Solver, traction: float) -> None:
    """Also after inexact steps, whose factors are those of an earlier, stable iterate."""
    column = Block(nx=1, ny=1, nz=8, size="0.125,0.125,1", traction=traction, derivatives="hand")
    p = column.parameters.start
    model = Model(column, solver)
    state = model.solve(p)
    expected = int((np.linalg.eigvalsh(column.tangent(state.u, p).full().toarray()) < 0.0).sum())
    assert model.negative_eigenvalues(state) == expected
    assert (expected > 0) == (traction < 0.0)


def test_an_unstable_state_is_noted_with_its_count(cli) -> None:
    options = "n=2,traction=-0.5,derivatives=hand"
    run = ("run", "--json", "--no-store", "--no-timing", "--route", "adjoint")
    (row,) = cli(*run, "--problem", f"block[{options}]").rows
    assert row["status"] == "ok", row["reason"]
    assert "negative eigenvalue" in row["note"]
    assert row["note"].endswith("at u: the state is unstable")
    (row,) = cli(*run, "--problem", f"block[{options.replace('-', '')}]").rows
    assert "unstable" not in (row["note"] or "")


@pytest.mark.parametrize("newton", ["full", "inexact"])
def test_differences_of_inexact_solves_are_noted(cli, newton: str) -> None:
    run = ("run", "--json", "--no-store", "--min-time", "0", "--problem", "block[nx=1,ny=1,nz=2]", "--newton", newton)
    rows = {row["route"]: row for row in cli(*run, "--route", "fd-one-sided", "--route", "adjoint").rows}
    says = "fd-one-sided: differences J of an inexact Newton solve (rtol 1e-12, noise of J up to about "
    assert (says in (rows["fd-one-sided"]["note"] or "")) == (newton == "inexact")
    assert "use --newton full" not in (rows["adjoint"]["note"] or "")


@pytest.mark.parametrize("rtol", [1e-2, 1e-5])
def test_the_noise_of_a_solve_is_its_distance_from_the_solution(rtol: float) -> None:
    p = BLOCK.parameters.start
    model = Model(BLOCK, Solver(rtol=rtol, newton="inexact"))
    state, exact = model.solve(p), Model(BLOCK, Solver(rtol=1e-14)).solve(p)
    assert model.noise(state) == pytest.approx(abs(state.J - exact.J), rel=0.1)
    assert model.noise(state) > 1e-14 * abs(exact.J)
