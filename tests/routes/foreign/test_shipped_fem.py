"""Finite element frameworks number nodes and cells anew: their gradients on a mesh in disorder, in ours."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from conftest import relative_error, somewhere

from gradient_routes.problems.block import Block
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.foreign.foreign import of_manifest
from gradient_routes.routes.foreign.manifest import manifest, shipped
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver

NAMES = ("dolfinx", "jax-fem", "feax", "dolfinx-adjoint")
TIGHT = Solver(rtol=1e-13, adjoint_rtol=1e-13)


def disordered(path: Path) -> Block:
    """A box of unequal cells in random order, its nodes too; sensors on another face than the loads."""
    rng = np.random.default_rng(0)
    box = Block(nx=2, ny=1, nz=2).mesh.geometry
    cell_type, cells = box.for_meshio()
    points = box.X + 0.02 * np.sin(7.0 * box.X[:, [1, 2, 0]]) * (box.X * (1.0 - box.X) > 0.0)
    place = rng.permutation(len(points))
    moved = np.empty_like(points)
    moved[place] = points
    meshio.write_points_cells(path, moved, [(cell_type, place[rng.permutation(cells)])])
    return Block(mesh=str(path), sensors="right")


@pytest.mark.parametrize("name", NAMES)
def test_the_gradient_is_ours_on_a_mesh_in_disorder(name: str, tmp_path: Path) -> None:
    found = manifest(shipped()[name])
    if not found.ready:
        pytest.skip(f"{name} has no environment here: routes environments create {name}")
    problem = disordered(tmp_path / "box.vtu")
    p = somewhere(problem)
    J, expected, *_ = adjoint.prepare(Model(problem, TIGHT), p)(p)
    options = {option: "2" if option == "ranks" else choices[-1] for option, choices in found.options.items()}
    result = of_manifest(found).prepare(Model(problem, TIGHT), p, **options)(p)
    assert result.J == pytest.approx(J, rel=1e-12)
    assert relative_error(result.gradient, expected) <= 1e-12
