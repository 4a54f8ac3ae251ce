"""Projective dynamics: its states and gradients are those of Newton's method, its constant matrix is what it says."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from conftest import relative_error

from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError, NotConverged
from gradient_routes.problems.impact_block import ImpactBlock
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.anderson import Anderson
from gradient_routes.routes.model import Model
from gradient_routes.routes.projective import Projective, projective
from gradient_routes.routes.solvers.global_step import GlobalFactors
from gradient_routes.routes.synthetic_data import with_synthetic_data


def made(**options: Any) -> ImpactBlock:
    column = {"nx": 1, "ny": 1, "nz": 2, "steps": 6, "dt": 0.1, "velocity": "0.3", "law": "arap"}
    return with_synthetic_data(ImpactBlock(**column | options))


@pytest.mark.parametrize("stop", ["softplus", "penalty"])
@pytest.mark.parametrize("inner", ["cg", "plain"])
def test_its_gradient_is_that_of_the_adjoint_at_the_declared_work(inner: str, stop: str) -> None:
    """To the tolerance of a march, 1e-12, and its cancellation in the moduli of a body that has hardly deformed."""
    block = made(stop=stop, alpha=0.1)
    model, p = Model(block), block.parameters.start + 0.1
    exact = adjoint.prepare(model, p)(p)
    before = model.tally.work
    found = projective.prepare(model, p, inner=inner)(p)
    work = model.tally.work - before
    assert relative_error(found.gradient, exact.gradient) < 1e-10
    assert relative_error(found.lam, exact.lam) < 1e-10
    assert found.J == pytest.approx(exact.J, rel=1e-11)
    assert work.factorizations == 1
    assert work.transposed_solves == work.matvecs + block.steps


def test_the_command_line_counts_its_work_as_declared(cli) -> None:
    selector = "impact-block[n=1,steps=3,dt=0.15,velocity=0.4,law=arap]"
    asked = ("--problem", selector, "--route", "projective[inner=cg|plain]", "--no-store", "--no-timing", "--json")
    rows = cli("run", *asked).rows
    assert [row["status"] for row in rows] == ["ok", "ok"]
    for row in rows:
        assert row["gradient_error"] < 1e-10
        assert row["work"] == row["predicted_work"]


def test_the_constant_matrix_holds_the_mass_the_laplacian_and_the_plane() -> None:
    """As written out: half a step squared of the Laplacian, whose rows sum to zero, and what the plane adds below."""
    block = made(stop="penalty", gap=-0.01)
    p = block.parameters.start
    step = block.global_step(p)
    A, n = step.A.full().toarray(), block.n
    assert (A - A.T == 0.0).all()
    assert A.sum() == pytest.approx(1.0, rel=1e-13)  # the mass, the Laplacian of a constant being zero
    factors = GlobalFactors(step, Model(block).factorize(step.A))
    k, r = step.stiffness(np.zeros(n)), np.cos(np.arange(n))
    assert (k > 0.0).all()
    S = np.kron(A, np.eye(3))
    S[step.at, step.at] += k
    np.testing.assert_allclose(S @ factors.solve(r, k), r, atol=1e-12)
    np.testing.assert_allclose(np.kron(A, np.eye(3)) @ factors.solve(r, 0.0 * k), r, atol=1e-12)


def test_anderson_solves_a_linear_system_in_as_many_steps_as_it_has_unknowns() -> None:
    """With all of them in memory it is GMRES (Walker & Ni 2011)."""
    rng = np.random.default_rng(0)
    A, b, v, accelerated = (
        np.eye(4) + 0.3 * rng.standard_normal((4, 4)),
        rng.standard_normal(4),
        np.zeros(4),
        Anderson(4),
    )
    for _ in range(5):
        v = accelerated(v, b - A @ v)
    np.testing.assert_allclose(A @ v, b, atol=1e-12)


def test_failures_name_the_step_and_what_to_do() -> None:
    fast = ImpactBlock(n=1, steps=2, dt=0.1, velocity="5", law="arap")
    with pytest.raises(NotConverged, match=r"impact-block, step \d: no 1e-12 of .* take smaller steps dt"):
        Projective(Model(fast), fast.parameters.start).states()
    with pytest.raises(InputError, match="tolerance=2 - choose one between 0 and 1"):
        projective.prepare(Model(made()), fast.parameters.start, tolerance=2.0)
    assert "projective needs a march with the law arap" in str(projective.objection(Block(n=1)))
    assert "projective needs a march" in str(projective.objection(made(law="neo-hookean")))
