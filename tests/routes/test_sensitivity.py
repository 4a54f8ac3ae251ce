"""du/dp and d(S u)/dp against central differences of solved states; singular values at any scale."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import relative_error, somewhere, zoo

from gradient_routes.problems.block import Block
from gradient_routes.problems.problem import Offers
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.sensitivity import sensitivities
from gradient_routes.routes.singular_values import randomized, whole
from gradient_routes.routes.tangent import tangent, with_columns

ZOO = {name: problem for name, problem in zoo().items() if "[n=" not in name and name.count(",") == 0} | {
    "block[grip]": Block(nx=1, ny=1, nz=2, unknown="load", load="displacement")
}
TIGHT = Solver(rtol=1e-14, polish=1)
H = 1e-5  # truncation h^2, rounding eps / h


@pytest.mark.parametrize("name", ZOO)
def test_sensitivities_equal_central_differences(name: str) -> None:
    problem = ZOO[name]
    p = somewhere(problem)
    model = Model(problem, TIGHT)
    at = np.unique([0, len(p) // 2, len(p) - 1])[::-1]
    found = sensitivities(model, model.solve(p), at)
    assert found.components.tolist() == at.tolist()
    assert found.du_dp.shape == (problem.n_state, len(at))
    assert (found.dSu_dp is not None) == (Offers.OBSERVATION in problem.offers)
    for j, i in enumerate(at):
        e = H * np.eye(len(p))[i]
        above, below = (model.solve(p + s * e).u for s in (1.0, -1.0))
        np.testing.assert_allclose(found.du_dp[:, j], (above - below) / (2 * H), rtol=1e-6, atol=1e-8)
        if found.dSu_dp is not None:
            seen = [problem.observation(u, p + s * e) for u, s in ((above, 1.0), (below, -1.0))]
            slope = (seen[0].predicted - seen[1].predicted) / (2 * H) / seen[0].weight
            np.testing.assert_allclose(found.dSu_dp[:, j], slope, rtol=1e-6, atol=1e-8)


def test_the_tangent_method_hands_out_its_columns() -> None:
    block = Block(n=2)
    p = somewhere(block)
    result = with_columns(Model(block, TIGHT), p, kept=[5, 0])
    np.testing.assert_array_equal(result.gradient, tangent.prepare(Model(block, TIGHT), p)(p).gradient)
    model = Model(block, TIGHT)
    every = sensitivities(model, model.solve(p))
    assert every.components.tolist() == list(range(len(p)))
    assert relative_error(result.du_dp, every.du_dp[:, [5, 0]]) < 1e-10
    assert tangent.prepare(Model(block), p)(p).du_dp is None


def sparse_spectrum(scale: float) -> np.ndarray:
    rng = np.random.default_rng(2)
    U, V = (np.linalg.qr(rng.standard_normal((n, 40)))[0] for n in (50, 60))
    return scale * (U * 0.7 ** np.arange(40)) @ V.T


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_what_is_left_out_is_bounded_at_any_scale(scale: float) -> None:
    """The bound is homogeneous in H, and no more than three times what it bounds: 12 + 10 directions leave out s_23."""
    A = sparse_spectrum(scale)
    exact, some = whole(A), randomized(A, A.shape, 12)
    left_out = some.beyond - exact.s[12]
    assert exact.s[22] <= left_out <= 3.0 * exact.s[22]
