"""The march that Numba compiles against the one of BLAS and LAPACK, which it has to equal to rounding."""

from __future__ import annotations

import numpy as np
import pytest

from gradient_routes.problems.vibrating_bar import VibratingBar
from gradient_routes.routes.model import Model
from gradient_routes.routes.solvers import step_march

pytest.importorskip("numba", reason="numba is not installed: pip install -e '.[numba]'")


@pytest.mark.parametrize(("scheme", "dt"), [("newmark", 0.05), ("central-difference", 0.05), ("backward-euler", 5.0)])
def test_loops_give_what_lapack_gives(scheme: str, dt: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the factors of a long step swap rows, as D - c/a K is not dominated by its diagonal."""
    bar = VibratingBar(n=6, steps=9, dt=dt, pulse=10.0, scheme=scheme, damping="skew", c_g=40.0)
    p, b = bar.parameters.start + 0.2 * np.sin(np.arange(6.0)), np.random.default_rng(0).standard_normal(bar.n_state)
    found = []
    for worth in (np.inf, 0.0):
        monkeypatch.setattr(step_march, "WORTH", worth)
        factors = Model(bar).factorize(bar.tangent(bar.initial(p), p))
        assert (factors._steps._compiled is not None) == (worth == 0.0)
        found.append((factors.solve(b), factors.solve_transposed(b)))
    for loops, lapack in zip(*found, strict=True):
        np.testing.assert_allclose(loops, lapack, rtol=0.0, atol=1e-12 * np.abs(lapack).max())


def test_swapped_rows_are_swapped_back() -> None:
    """A matrix without a diagonal, whose factors swap every pair of rows."""
    from scipy.linalg import get_lapack_funcs

    from gradient_routes.routes.solvers import compiled_march

    lower, main, upper = np.array([2.0, 3.0, 5.0]), np.full(4, 0.1), np.array([1.0, 4.0, 2.0])
    A = np.diag(main) + np.diag(lower, -1) + np.diag(upper, 1)
    (factor,) = get_lapack_funcs(("gttrf",), (main,))
    *lu, info = factor(lower, main, upper)
    assert info == 0
    given = compiled_march.factors(tuple(lu))
    assert given[4].any()
    for solve, M in ((compiled_march._solve, A), (compiled_march._solve_transposed, A.T)):
        x = np.array([1.0, -2.0, 3.0, 0.5])
        b = M @ x
        solve(*given, b)
        np.testing.assert_allclose(b, x, rtol=1e-13)
