"""Strains at points: exact for linear displacements, weighed by their own noise, untouched by motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gradient_routes.problems.block import Block
from gradient_routes.problems.data.probes import read_probes
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import Mesh, box_mesh
from gradient_routes.problems.fem.plane_meshes import hole_mesh
from gradient_routes.problems.plate import Plate

PLANE = "x [m],y [m],ux [um],exx [microstrain],exy [microstrain]\n0.3,0.4,10,,\n0.6,0.7,,200,100\n0.2,0.9,20,100,\n"
NOISE = {"noise": "1um", "strain_noise": "20microstrain"}


@pytest.fixture
def file(tmp_path: Path):
    def write(text: str) -> str:
        path = tmp_path / "d.csv"
        path.write_text(text)
        return str(path)

    return write


@pytest.mark.parametrize(
    ("mesh", "axes"),
    [
        (hole_mesh("plate", "quad8", (4, 4), 4, (1.0, 1.0), 0.2, False), "xy"),
        (box_mesh("block", "hex8", (2, 1, 1), (1.0, 2.0, 0.5)), "xyz"),
        (box_mesh("block", "tet10", (1, 1, 1), (1.0, 1.0, 1.0)), "xyz"),
    ],
)
def test_strains_of_linear_displacements_are_exact(mesh: Mesh, axes: str, file) -> None:
    """u = G x has the strains (G + G^T)/2 at every point, in curved cells, too."""
    d = len(axes)
    e_names = ["exx", "eyy", "exy"] if d == 2 else ["exx", "eyy", "ezz", "exy", "eyz", "exz"]
    points = ["0.1,0.15", "0.8,0.4", "0.75,0.9"] if d == 2 else ["0.1,0.2,0.3", "0.6,0.9,0.25"]
    rows = "".join(f"{x}{',0' * len(e_names)}\n" for x in points)
    gauges = read_probes(mesh, file(",".join([*axes, *e_names]) + "\n" + rows)).strains
    assert gauges is not None
    G = np.random.default_rng(0).standard_normal((d, d))
    found = gauges.read((mesh.geometry.X @ G.T)[gauges.nodes])
    exact = [0.5 * (G + G.T)[axes.index(e[1]), axes.index(e[2])] for e in e_names]
    np.testing.assert_allclose(found, np.tile(exact, (len(points), 1)), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("motion", ["none", "rigid"])
def test_J_is_weighed_by_both_noises_and_its_gradient_exact(motion: str, file) -> None:
    """J = sigma^2/2 sum of (r/sigma_i)^2, its gradient by complex steps; the observation says the same of it."""
    data = PLANE.replace("20,100,", "20,100,\n0.7,0.2,30,,\n0.5,0.5,-5,,")
    plate = Plate(n=2, unknown="constants", data=file(data), motion=motion, **NOISE)
    g, p = np.random.default_rng(1), plate.parameters.start
    u = 1e-3 * g.standard_normal(plate.n_state)
    seen = plate.observation(u, p)
    r = (seen.predicted - seen.data) / seen.sigma
    assert plate.objective(u, p) == pytest.approx(0.5 * (1e-6) ** 2 * (r @ r), rel=1e-12)
    v = g.standard_normal(plate.n_state)
    slope = plate.objective(u + 1e-30j * v, p.astype(complex)).imag / 1e-30
    lin = plate.linearize(u, p)
    assert lin.J_u @ v == pytest.approx(slope, rel=1e-12)
    np.testing.assert_allclose(seen.S_u.T @ (seen.predicted - seen.data), lin.J_u, rtol=1e-11, atol=1e-20)
    assert seen.quantity.tolist()[-3:] == ["exx", "exy", "exx"]
    assert seen.label(len(r) - 3) == "exx at (0.6, 0.7)"
    assert "exy: half the change of the right angle, gamma/2" in plate.read_as
    measured = (seen.whole or seen).data / seen.relative
    np.testing.assert_allclose(measured[-3:], [2e-4, 1e-4, 1e-4], rtol=1e-12)
    np.testing.assert_allclose(seen.relative[-3:], 1e-6 / 20e-6, rtol=1e-12)


def test_a_rigid_motion_of_the_data_changes_no_strain(file) -> None:
    plate = Plate(n=2, unknown="constants", data=file(PLANE + "0.7,0.2,30,,\n0.5,0.5,-5,,\n"), motion="rigid", **NOISE)
    seen = plate.observation(np.zeros(plate.n_state), plate.parameters.start)
    assert seen.modes[-3:].tolist() == np.zeros_like(seen.modes[-3:]).tolist()


def test_strains_alone_have_their_own_noise(file) -> None:
    path = file("x,y,z,ezz,exz\n0.5,0.5,0.5,1e-3,\n0.2,0.3,0.4,2e-3,1e-4\n")
    block = Block(n=1, unknown="layers", layers=1, data=path, strain_noise=1e-5)
    seen = block.observation(np.zeros(block.n_state), block.parameters.start)
    assert (seen.sigma, seen.data.tolist()) == (1e-5, [1e-3, 2e-3, 1e-4])
    assert not block.data.reads_nothing()


@pytest.mark.parametrize(
    ("text", "options", "says"),
    [
        (PLANE.replace("exy", "ezz"), NOISE, "column ezz: a plane body has the strains exx, eyy, exy - remove"),
        (PLANE, {"noise": "1um"}, "displacements and strains in one J are weighed by their noise - state both"),
        (PLANE, {"strain_noise": 1e-5}, "state both, as in noise=0.4um,strain_noise=20microstrain"),
        (PLANE, NOISE | {"strain_noise": 0.0}, "strain_noise=0.0 - give a standard deviation > 0"),
        (PLANE, NOISE | {"strain_noise": "1um"}, "'um' is a unit of length, not of ratio"),
        (PLANE, NOISE | {"unknown": "shape", "n": 2}, "not with unknown=shape"),
        (PLANE.replace("[microstrain]", "[mrad]"), NOISE, "unit 'mrad' is not known"),
        ("x,y,exx\n0.5,0.5,1e-3\n", {"noise": "1um"}, "noise=1e-06 is of displacements, and strains alone"),
        ("x,y,exx\n0.5,0.5,1e-3\n", {"motion": "rigid"}, "motion=rigid is of displacements, and none were measured"),
        ("x,y,ux\n0.5,0.5,1e-3\n", NOISE, "strain_noise=2e-05, but no strain was measured"),
        ("x,y,exx\n0.5,0.5,\n", {}, "measures nothing"),
    ],
)
def test_what_is_refused(text: str, options: dict, says: str, file) -> None:
    with pytest.raises(InputError) as refused:
        Plate(**{"n": 1, "data": file(text)} | options)
    assert says in str(refused.value)
