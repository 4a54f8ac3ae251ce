"""Sparse matrices and their factorizations: A @ solve(b) == b, A.T @ solve_transposed(b) == b, or refused."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from commands import ROOT
from conftest import relative_error
from scipy.sparse import csr_array

from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError, NotConverged, SingularMatrix
from gradient_routes.problems.fem.assembly_jax import assembly
from gradient_routes.problems.fem.boundary_conditions import rigid_body_modes
from gradient_routes.problems.fem.elements import Geometry
from gradient_routes.problems.fem.mesh import box_mesh
from gradient_routes.problems.matrices.sparse import (
    BlockDiagonal,
    GeneralPattern,
    GeneralSparse,
    SymmetricPattern,
    SymmetricSparse,
)
from gradient_routes.problems.mechanics.energies import neo_hookean
from gradient_routes.problems.mechanics.materials import lame
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.solvers.factorization import Factorizer
from gradient_routes.routes.tally import Work

RNG = np.random.default_rng(0)
N, N_E, M = 60, 90, 5
UNKNOWNS = np.array([RNG.choice(N, M, replace=False) for _ in range(N_E)])
UNKNOWNS[::7, 0] = -1
BLOCK = Block(n=4, parametrization="raw")
START = BLOCK.parameters.start


def entries(dtype: type, seed: int = 1) -> np.ndarray:
    """Element matrices (n_e, m, m) that sum up to a matrix far from symmetric: |A - A^T| is as large as |A|."""
    rng = np.random.default_rng(seed)
    A_e = np.tril(rng.standard_normal((N_E, M, M))) + 2.0 * np.eye(M)
    return A_e * (1.0 + 0.5j * rng.standard_normal(A_e.shape)) if dtype is complex else A_e


def dense(A_e: np.ndarray) -> np.ndarray:
    A = np.zeros((N, N), A_e.dtype)
    for unknowns, K in zip(UNKNOWNS, A_e, strict=True):
        free = unknowns >= 0
        A[np.ix_(unknowns[free], unknowns[free])] += K[np.ix_(free, free)]
    return A


PATTERN = GeneralPattern.of_elements(UNKNOWNS, N)
DTYPES = [float, complex]


@pytest.mark.parametrize("dtype", DTYPES)
def test_general_matrices_are_assembled_and_multiply(dtype: type) -> None:
    A, D, v = PATTERN.assemble(entries(dtype)), dense(entries(dtype)), RNG.standard_normal(N)
    np.testing.assert_allclose(A.full().toarray(), D, rtol=1e-14)
    np.testing.assert_allclose(A @ v, D @ v, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(A.T @ v, D.T @ v, rtol=1e-13, atol=1e-13)
    assert A.norm == pytest.approx(np.abs(D).sum(axis=1).max(), rel=1e-14)
    assert all((np.diff(A.rows[[i]].indices) > 0).all() for i in range(N))


@pytest.mark.parametrize("dtype", DTYPES)
def test_the_upper_triangle_stands_for_a_symmetric_matrix(dtype: type) -> None:
    A_e = entries(dtype) + entries(dtype).transpose(0, 2, 1)
    rows, columns = np.triu_indices(M)
    A, D, v = (
        SymmetricPattern.of_elements(UNKNOWNS, N).assemble(A_e[:, rows, columns]),
        dense(A_e),
        RNG.standard_normal(N),
    )
    np.testing.assert_allclose(A.full().toarray(), D, rtol=1e-14)
    np.testing.assert_allclose(A @ v, D @ v, rtol=1e-13, atol=1e-13)
    assert A.norm == pytest.approx(np.abs(D).sum(axis=1).max(), rel=1e-14)


@pytest.mark.parametrize("dtype", DTYPES)
def test_blocks_stand_on_the_diagonal(dtype: type) -> None:
    blocks = tuple(PATTERN.assemble(entries(dtype, seed)) for seed in (1, 2))
    A, v = BlockDiagonal(blocks), RNG.standard_normal(2 * N)
    D = np.kron([[1, 0], [0, 0]], dense(entries(dtype, 1))) + np.kron([[0, 0], [0, 1]], dense(entries(dtype, 2)))
    np.testing.assert_allclose(A @ v, D @ v, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(A.T @ v, D.T @ v, rtol=1e-13, atol=1e-13)
    assert A.shape == D.shape
    assert A.norm == pytest.approx(np.abs(D).sum(axis=1).max(), rel=1e-14)


@pytest.mark.parametrize("linear_solver", ["pardiso", "superlu"])
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("cases", [0, 2])
def test_factorizations_invert_general_matrices_and_their_transposes(linear_solver, dtype: type, cases: int) -> None:
    factorize, b = Factorizer(linear_solver), RNG.standard_normal(N * max(cases, 1))
    held = []
    for seed in (1, 3, 5):  # the second and third on the analysis of the first, once that is let go of
        blocks = tuple(PATTERN.assemble(entries(dtype, seed + i)) for i in range(max(cases, 1)))
        A = BlockDiagonal(blocks) if cases else blocks[0]
        factors = factorize(A, "test")
        for _ in range(2):  # neither solve disturbs the other
            np.testing.assert_allclose(A @ factors.solve(b), b, atol=1e-10)
            np.testing.assert_allclose(A.T @ factors.solve_transposed(b), b, atol=1e-10)
        assert relative_error(factors.solve_transposed(b), factors.solve(b)) > 0.1
        assert factors.norm == pytest.approx(A.norm, rel=1e-14)
        assert factors.nbytes > 0
        held = [] if held else [factors]


@pytest.mark.parametrize("linear_solver", ["superlu", "pardiso"])
def test_a_real_matrix_takes_complex_loads(linear_solver: str) -> None:
    """R_u of a problem whose p is in its load alone, at a complex p."""
    A, b = PATTERN.assemble(entries(float)), RNG.standard_normal(N) + 1j * RNG.standard_normal(N)
    factors = Factorizer(linear_solver)(A, "test")
    np.testing.assert_allclose(A @ factors.solve(b), b, rtol=1e-9)
    np.testing.assert_allclose(A.T @ factors.solve_transposed(b), b, rtol=1e-9)


def test_a_zero_diagonal_is_no_obstacle() -> None:
    pattern = GeneralPattern.of_elements(np.array([[0, 1], [2, 3]]), 4)
    A = pattern.assemble(np.tile([[0.0, 2.0], [-3.0, 0.0]], (2, 1, 1)))
    factors, b = Factorizer()(A, "test"), np.arange(4.0)
    np.testing.assert_allclose(A @ factors.solve(b), b)
    np.testing.assert_allclose(A.T @ factors.solve_transposed(b), b)


def test_pardiso_permutes_large_entries_to_the_diagonal() -> None:
    """The diagonal as it stands, of 1e-9, gives pivots that count as zero."""
    rng, n = np.random.default_rng(3), 200
    cyclic = np.roll(np.diag(rng.uniform(1.0, 2.0, n)), 1, axis=1)
    A = cyclic + 1e-9 * np.diag(rng.standard_normal(n)) + 0.1 * (rng.random((n, n)) < 0.02)
    x = rng.standard_normal(n)
    np.testing.assert_allclose(Factorizer("pardiso")(of_rows(A), "test").solve(A @ x), x, atol=1e-10)


def test_pardiso_tells_the_memory_of_its_factors() -> None:
    """Complex factors on the same analysis: n^2 numbers of 16 bytes instead of 8."""
    n = 60
    A = of_rows(n * np.eye(n) + 1.0)
    real, complex_ = (Factorizer("pardiso")(GeneralSparse(A.pattern, A.data.astype(t)), "test") for t in DTYPES)
    assert 8 * n**2 <= complex_.nbytes - real.nbytes <= 3 * 8 * n**2


@cache
def floating(n: int, dtype: type) -> SymmetricSparse:
    """The matrix of a cube without clamp: six rigid motions cost no energy."""
    geometry = box_mesh("cube", "hex8", (n, n, n), (1.0, 1.0, 1.0)).geometry
    pattern = SymmetricPattern.of_elements(*unclamped(geometry))
    row, column = np.triu_indices(24)
    u_e = np.zeros((*geometry.nodes.shape, 3), dtype)
    q = lame(1.0, 0.3)
    return pattern.assemble(assembly(neo_hookean).element_tangents(u_e, q, *geometry.metric, 24 * row + column))


def unclamped(geometry: Geometry) -> tuple[np.ndarray, int]:
    unknowns = 3 * geometry.nodes[..., None] + np.arange(3)
    return unknowns.reshape(len(unknowns), -1), 3 * len(geometry.X)


def as_general(A) -> GeneralSparse:
    return of_rows(A.full())


def of_rows(A) -> GeneralSparse:
    rows = csr_array(A)
    rows.sort_indices()
    pattern = GeneralPattern(rows.shape[0], rows.indptr, rows.indices, np.zeros(0, dtype=int))
    return GeneralSparse(pattern, rows.data)


@pytest.mark.parametrize("linear_solver", ["pardiso", "superlu"])
@pytest.mark.parametrize("kind", ["symmetric", "general"])
@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_a_body_without_clamp_is_singular(linear_solver, kind: str, dtype: type, n: int) -> None:
    K = floating(n, dtype)
    with pytest.raises(SingularMatrix, match=r"test: R_u \(\d+ unknowns\).* - check p and the supports"):
        Factorizer(linear_solver)(as_general(K) if kind == "general" else K, "test")


@pytest.mark.parametrize("kind", ["symmetric", "general"])
def test_a_matrix_that_becomes_singular_is_refused_on_the_old_analysis(kind: str) -> None:
    regular = BLOCK.tangent(np.zeros(BLOCK.n_state), START)
    A = as_general(regular) if kind == "general" else regular
    factorize = Factorizer()
    factorize(A, "test")
    rows = np.repeat(np.arange(BLOCK.n_state), np.diff(A.pattern.indptr))
    singular = type(A)(A.pattern, np.where((A.pattern.indices == 7) | (rows == 7), 0.0, A.data))
    with pytest.raises(SingularMatrix):
        factorize(singular, "test")
    b = np.ones(BLOCK.n_state)
    np.testing.assert_allclose(A @ factorize(A, "test").solve(b), b, rtol=1e-10)


def test_rigid_body_modes_are_the_near_nullspace() -> None:
    K, geometry = floating(2, float), box_mesh("cube", "hex8", (2, 2, 2), (1.0, 1.0, 1.0)).geometry
    rigid = rigid_body_modes(geometry).reshape(-1, 6)
    assert np.linalg.matrix_rank(rigid) == 6
    np.testing.assert_allclose(K.full() @ rigid, 0.0, atol=1e-14)


@pytest.mark.parametrize("near_nullspace", [True, False])
def test_multigrid_solves(near_nullspace: bool) -> None:
    K = BLOCK.tangent(np.zeros(BLOCK.n_state), START)
    if not near_nullspace:
        pattern = SymmetricPattern(K.pattern.n, K.pattern.indptr, K.pattern.indices, K.pattern.slots)
        K = type(K)(pattern, K.data)
    factors, b = Factorizer("cg-amg")(K, "test"), RNG.standard_normal(BLOCK.n_state)
    np.testing.assert_allclose(K @ factors.solve(b), b, atol=1e-11)
    assert not factors.solve(0.0 * b).any()


def test_multigrid_meets_the_reference_of_six_codes() -> None:
    from gradient_routes.problems.data.csv import read_columns

    table = read_columns(ROOT / "tests" / "data" / "block_n4.csv", ("x", "y", "z", "E", "dJ_dE"))
    gradient = adjoint.prepare(Model(BLOCK, Solver(linear_solver="cg-amg")), START)(START).gradient
    assert relative_error(gradient[np.lexsort(BLOCK.parameters.position.T)], table["dJ_dE"]) < 1e-10


@pytest.mark.parametrize("kind", ["general", "complex"])
def test_what_multigrid_cannot_solve_is_said(kind: str) -> None:
    K = BLOCK.tangent(np.zeros(BLOCK.n_state), START.astype(complex) if kind == "complex" else START)
    with pytest.raises(InputError, match=r"test: cg-amg solves real symmetric systems, R_u is .* - take pardiso"):
        Factorizer("cg-amg")(as_general(K) if kind == "general" else K, "test")


def test_multigrid_finds_indefinite_matrices_and_says_where_it_stalls(monkeypatch: pytest.MonkeyPatch) -> None:
    K, b = BLOCK.tangent(np.zeros(BLOCK.n_state), START), np.random.default_rng(3).standard_normal(BLOCK.n_state)
    for shift in (0.3, 100.0):  # some eigenvalues negative, or all
        data = K.data.copy()
        data[K.pattern.indptr[:-1]] -= shift * K.diagonal.min()
        with pytest.raises(SingularMatrix, match="test: R_u is not positive definite"):
            Factorizer("cg-amg")(type(K)(K.pattern, data), "test").solve(b)
    monkeypatch.setattr("gradient_routes.routes.solvers.multigrid.AT_MOST", 4)
    with pytest.raises(NotConverged, match=r"test: multigrid CG stalls: \d+ products, each .* - take --linear-solver"):
        Factorizer("cg-amg")(K, "test").solve(b)


@pytest.mark.parametrize("options", [["--newton", "inexact"], ["--linear-solver", "cg-amg"]])
def test_the_command_line_takes_every_solver(cli, options: list[str]) -> None:
    run = ["run", "--json", "--no-store", "--min-time", "0", "--problem", "block[n=2]"]
    names = ("adjoint", "tangent")  # and what asks for complex factors, for many of them and for those of every step
    names += () if "cg-amg" in options else ("complex-step", "fd-central", "unrolled-ad")
    routes = [word for name in names for word in ("--route", name)]
    rows = {row["route"]: row for row in cli(*run, *routes, *options).rows}
    for row in (rows[name] for name in names):
        assert row["status"] == "ok", row["reason"]
        assert Work(**row["work"]) == Work(**row["predicted_work"])
        assert relative_error(np.array(row["gradient"]), np.array(rows["adjoint"]["gradient"])) < 1e-8
