"""The block at loads that go to zero: its gradient goes to that of linear elasticity, digit for digit."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from conftest import relative_error
from skfem import Basis, BilinearForm, ElementHex1, ElementVector, FacetBasis, Functional, LinearForm, condense, solve
from skfem.helpers import ddot, sym_grad, trace

from gradient_routes.problems.block import Block
from gradient_routes.problems.mechanics.materials import lame
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.route import Route

LAWS = ("neo-hookean", "mooney-rivlin", "yeoh", "linear")
VARIANTS = [
    *({"law": law} for law in LAWS),
    *({"law": law, "derivatives": "hand"} for law in LAWS[:2]),
    {"load": "follower"},
]
TINY = 1e-20  # every load compiles a block of its own; test_materials has the stresses of those between


def gradient(t: float, route: Route = adjoint, **options) -> np.ndarray:
    """dJ/dp over the traction t."""
    block = Block(n=2, traction=t, **options)
    p = block.parameters.start
    result = route.prepare(Model(block), p)(p)
    assert result.residual <= 1e-12
    return result.gradient / t


@cache
def limit() -> np.ndarray:
    """dJ/dp over the load for load -> 0, by scikit-fem: R_u lam = S^T d, dJ/dlog E_e the energy of u and lam in e."""
    block = Block(n=2)
    E = np.exp(block.parameters.start)
    basis = Basis(block.mesh.skfem_mesh, ElementVector(ElementHex1()))
    mu, lam = (c[:, None] for c in lame(E, 0.3))

    def density(u, v, mu, lam):
        return 2.0 * mu * ddot(sym_grad(u), sym_grad(v)) + lam * trace(sym_grad(u)) * trace(sym_grad(v))

    X = basis.mesh.p
    top = FacetBasis(basis.mesh, basis.elem, facets=basis.mesh.facets_satisfying(lambda x: x[2] == 1.0))
    K = BilinearForm(lambda u, v, w: density(u, v, w.mu, w.lam)).assemble(basis, mu=mu, lam=lam)
    f = LinearForm(lambda v, w: v[2]).assemble(top)
    S_T_d = np.zeros(len(f))
    S_T_d[basis.nodal_dofs[2, X[2] == 1.0]] = 0.2
    clamped = basis.nodal_dofs[:, X[2] == 0.0].ravel()
    u, v = (basis.interpolate(solve(*condense(K, b, D=clamped))) for b in (f, S_T_d))
    return Functional(lambda w: density(w.state, w.adjoint, w.mu, w.lam)).elemental(
        basis, state=u, adjoint=v, mu=mu, lam=lam
    )


@pytest.mark.parametrize("options", VARIANTS, ids=lambda options: "-".join(options.values()))
def test_the_gradient_over_the_load_goes_to_that_of_linear_elasticity(options: dict[str, str]) -> None:
    """Off by O(load), to 1e-12 where that is nothing."""
    nonlinear = relative_error(gradient(1e-2, **options), limit()) / 1e-2
    assert nonlinear < 5.0
    assert relative_error(gradient(TINY, **options), limit()) <= 1e-12


def test_the_gradient_by_jax_keeps_its_digits_at_tiny_loads() -> None:
    assert relative_error(gradient(1e-16, implicit_ad), limit()) < 1e-10


def test_a_grip_that_hardly_moves_gives_the_gradient_of_linear_elasticity() -> None:
    def by(law: str, moved: float) -> np.ndarray:
        block = Block(n=2, load="displacement", displacement=moved, law=law)
        p = block.parameters.start
        return adjoint.prepare(Model(block), p)(p).gradient / moved

    exact = by("linear", 1e-3)  # quadratic in the displacement beside the target: next to nothing
    moved = 1e-16
    assert relative_error(by("neo-hookean", moved), by("linear", moved)) < 1e-10
    assert relative_error(by("linear", moved), exact) < 1e-2
