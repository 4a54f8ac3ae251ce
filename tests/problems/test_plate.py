"""The plate against closed forms, the block and the complex step: its kinds of state, elements, loads and unknowns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from conftest import relative_error
from scipy.optimize import brentq
from test_materials import STRESS

from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.assembly_jax import _second_derivative
from gradient_routes.problems.fem.plane_meshes import hole_mesh, rectangle_mesh
from gradient_routes.problems.jax64 import jax
from gradient_routes.problems.mechanics.materials import lame
from gradient_routes.problems.mechanics.plane_laws import plane_law
from gradient_routes.problems.mechanics.solid import Solid
from gradient_routes.problems.plate import DIRECTIONS, Plate
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent

KINDS = ("plane-stress", "plane-strain", "axisymmetric")
ELEMENTS = ("quad4", "quad8", "tri3", "tri6")
HAND: dict[str, Any] = {"n": 2, "derivatives": "hand"}
TIGHT = Solver(rtol=1e-14)
# every kind, element, unknown and load; without JAX, or linear, which compiles fast
VARIANTS: dict[str, dict[str, Any]] = {
    "stress": HAND | {"parametrization": "raw", "data": "twin", "noise": 1e-3, "markers": 5, "components": "in-plane"},
    "stress constants": HAND | {"law": "mooney-rivlin", "unknown": "constants", "element": "quad8"},
    "stress thickness": HAND | {"unknown": "thickness", "parametrization": "raw", "thickness": 0.01},
    "strain grip": HAND | {"kind": "plane-strain", "load": "displacement", "cases": 2, "alpha": 0.1, "element": "tri3"},
    "ring layers": HAND | {"kind": "axisymmetric", "unknown": "layers", "layers": 2, "radius": 0.5, "element": "tri6"},
    "cylinder follower": HAND | {"kind": "axisymmetric", "load": "follower", "loaded": "right"},
    "cylinder shape": {"n": 2, "law": "linear", "kind": "axisymmetric", "unknown": "shape"},
    "quarter traction": {
        "n": 2,
        "law": "linear",
        "body": "quarter",
        "unknown": "traction",
        "clamped": "none",
        "fixed": "x@left,y@bottom",
    },
}


def displacements(plate: Solid, p: Array) -> Array:
    """u of every node, (n_nodes, d)."""
    u = Model(plate, TIGHT).solve(p).u
    nodes = np.arange(len(plate.mesh.geometry.X))
    return np.asarray(plate.solid.displacements(u, plate.solid.setup(p), 0, nodes))


def complex_gradient(plate: Plate, p: Array) -> Array:
    return complex_step.prepare(Model(plate, TIGHT), p)(p).gradient


@pytest.mark.parametrize("name", VARIANTS)
def test_every_exact_route_gives_the_gradient_of_every_kind_of_plate(name: str) -> None:
    plate = with_synthetic_data(Plate(**VARIANTS[name]))
    scale, n_p = plate.parameters.scale, len(plate.parameters)
    p = plate.parameters.start + 0.01 * scale * np.random.default_rng(0).uniform(-1.0, 1.0, n_p)
    exact = complex_gradient(plate, p)
    for route in (tangent, adjoint):
        assert relative_error(route.prepare(Model(plate, TIGHT), p)(p).gradient, exact) < 1e-12, route.name


def test_derivatives_by_jax_in_plane_stress_meet_complex_steps_by_hand() -> None:
    """Through the root of P_33, twice differentiated, and three times: what unrolled-ad asks for, which asks most."""
    law, step = plane_law("neo-hookean", "plane-stress"), 1e-30
    q = law.of_modulus(1.0, 0.3)
    H, D = 0.2 * np.random.default_rng(0).standard_normal((2, 2, 2))
    moduli = _second_derivative(law.W)

    def along(t: Any) -> Any:
        return moduli(H + t * D, tuple((1.0 + t) * c for c in q))

    A, dA = jax.jit(lambda t: jax.jvp(along, (t,), (1.0,)))(0.0)
    by_hand = law.numpy.A(H + 1j * step * D, tuple((1.0 + 1j * step) * c for c in q))
    np.testing.assert_allclose(A, by_hand.real, atol=1e-12)
    np.testing.assert_allclose(dA, by_hand.imag / step, atol=1e-12 * np.abs(dA).max())


def stretches(kind: str, traction: float) -> tuple[float, float]:
    """Across and along a neo-Hookean specimen of E = 1, nu = 0.3 that is free across: by bisection."""
    mu, lam = lame(1.0, 0.3)

    def across(s: float) -> float:
        def stress(t: float) -> float:
            J = s * t * (1.0 if kind == "plane-strain" else t)
            return mu * (t - 1.0 / t) + lam * np.log(J) / t

        return float(brentq(stress, 0.1, 10.0, xtol=1e-15))

    def along(s: float) -> float:
        t = across(s)
        if kind == "plane-strain":
            return mu * (s - 1.0 / s) + lam * np.log(s * t) / s - traction
        return STRESS["neo-hookean"](s, t, mu, lam) - traction

    s = float(brentq(along, 0.5, 3.0, xtol=1e-15))
    return across(s), s


@pytest.mark.parametrize("element", ELEMENTS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_patch_of_distorted_cells_stretches_as_the_closed_form(kind: str, element: Any, tmp_path: Path) -> None:
    """A homogeneous finite strain is found exactly, on a mesh read from a file."""
    geometry = rectangle_mesh("plate", "quad4" if "quad" in element else "tri3", (2, 2), (1.0, 2.0)).geometry
    X = geometry.X + np.where((geometry.X == [0.5, 1.0]).all(axis=1)[:, None], [0.07, -0.11], 0.0)
    path = (
        quadratic_file(tmp_path, replace(geometry, X=X)) if element[-1] in "68" else linear_file(tmp_path, geometry, X)
    )
    plate = Plate(
        mesh=path, kind=kind, clamped="none", fixed="x@left,y@bottom", traction=0.3, derivatives="hand", thickness=1.0
    )
    assert plate.mesh.geometry.element.name == element
    stretch = np.array(stretches(kind, 0.3))
    U = displacements(plate, np.zeros(len(plate.parameters)))
    np.testing.assert_allclose(U, plate.mesh.geometry.X * (stretch - 1.0), atol=1e-13)


def linear_file(folder: Path, geometry: Any, X: Array) -> str:
    name, cells = geometry.for_meshio()
    meshio.Mesh(np.pad(X, ((0, 0), (0, 1))), [(name, cells)]).write(folder / "patch.vtu")
    return str(folder / "patch.vtu")


def quadratic_file(folder: Path, geometry: Any) -> str:
    """With a node of its own in the middle of each side of each cell, joined by position."""
    name, cells = geometry.for_meshio()
    corners = geometry.X[cells]
    middles = (corners + np.roll(corners, -1, axis=1)) / 2.0
    points, number = np.unique(np.round(middles.reshape(-1, 2), 12), axis=0, return_inverse=True)
    nodes = np.concatenate([cells, len(geometry.X) + number.reshape(cells.shape)], axis=1)
    kind = {"quad": "quad8", "triangle": "triangle6"}[name]
    meshio.Mesh(np.pad(np.concatenate([geometry.X, points]), ((0, 0), (0, 1))), [(kind, nodes)]).write(folder / "q.vtu")
    return str(folder / "q.vtu")


def test_plane_strain_is_a_block_between_two_smooth_walls() -> None:
    """The section y = 0.5 of the block has the moduli of the plate: the same state to rounding."""
    plate = Plate(**HAND, nx=3, kind="plane-strain", thickness=0.7)
    block = Block(**HAND, nx=3, ny=1, size="1,0.7,1", fixed="y@front,y@back")
    p, cells = block.parameters.start, np.lexsort(block.parameters.position.T)
    of_plate = np.lexsort(plate.parameters.position.T)
    np.testing.assert_allclose(p[cells], plate.parameters.start[of_plate], atol=1e-15)
    X, U = block.mesh.geometry.X, displacements(block, p)
    front = X[:, 1] == 0.0
    order = [np.lexsort(x.T) for x in (X[front][:, [0, 2]], plate.mesh.geometry.X)]
    V = displacements(plate, plate.parameters.start)
    np.testing.assert_allclose(U[front][order[0]][:, [0, 2]], V[order[1]], atol=1e-13)


def test_plane_stress_is_the_limit_of_thin_blocks() -> None:
    """Of a layer of hexahedra, whose u_y is continuous where the F_33 of a plate jumps: they differ by O(h)."""
    differences = []
    for n in (4, 8):
        plate = Plate(n=n, clamped="none", fixed="x@bottom,y@bottom", derivatives="hand")
        block = Block(n=n, ny=1, size="1,1e-3,1", fixed="y@front,x@bottom,z@bottom", clamped="none", derivatives="hand")
        U, V = displacements(plate, plate.parameters.start), displacements(block, block.parameters.start)
        top = plate.mesh.geometry.X[:, 1] == 1.0, block.mesh.geometry.X[:, 2] == 1.0
        differences.append(abs(V[top[1], 2].mean() / U[top[0], 1].mean() - 1.0))
    assert differences[0] < 5e-3
    assert differences[1] < 0.6 * differences[0]


def kirsch(x: Array, a: float, E: float, nu: float) -> Array:
    """Displacements (m, 2) of an infinite plate with a hole of radius a under 1 Pa in x (Kirsch 1898), plane stress."""
    r, theta = np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0])
    G, k = E / (2.0 * (1.0 + nu)), (3.0 - nu) / (1.0 + nu)
    c1, c3, s1, s3 = np.cos(theta), np.cos(3.0 * theta), np.sin(theta), np.sin(3.0 * theta)
    ux = r / a * (k + 1.0) * c1 + 2.0 * a / r * ((1.0 + k) * c1 + c3) - 2.0 * (a / r) ** 3 * c3
    uy = r / a * (k - 3.0) * s1 + 2.0 * a / r * ((1.0 - k) * s1 + s3) - 2.0 * (a / r) ** 3 * s3
    return a / (8.0 * G) * np.stack([ux, uy], axis=1)


def kirsch_traction(x: Array, normal: Array, a: float) -> Array:
    r, theta = np.hypot(*x.T), np.arctan2(x[:, 1], x[:, 0])
    q, c2, c4, s2, s4 = (a / r) ** 2, *(f(m * theta) for f in (np.cos, np.sin) for m in (2, 4))
    xx = 1.0 - q * (1.5 * c2 + c4) + 1.5 * q**2 * c4
    yy = -q * (0.5 * c2 - c4) - 1.5 * q**2 * c4
    xy = -q * (0.5 * s2 + s4) + 1.5 * q**2 * s4
    return np.stack([xx * normal[:, 0] + xy * normal[:, 1], xy * normal[:, 0] + yy * normal[:, 1]], axis=1)


@pytest.mark.parametrize(("element", "stress"), [("quad8", 0.01), ("tri6", 0.03)])
def test_a_hole_raises_the_stress_threefold_as_kirsch_has_it(element: Any, stress: float) -> None:
    """Under Kirsch's tractions, constant on each side of a cell: displacements converge with the square of h."""
    a, errors = 0.25, []
    given = Plate(law="linear")._options
    supports = {"clamped": "none", "fixed": "x@left,y@bottom", "loaded": "outer", "unknown": "traction"}
    for n in (4, 8):
        mesh = hole_mesh("plate", element, (n, n), n, (1.0, 1.0), a, quarter=True)
        outer = mesh.skfem_mesh.facets_satisfying(lambda x: np.maximum(*x) > 1.0 - 1e-9, boundaries_only=True)
        mesh = replace(mesh, skfem_mesh=mesh.skfem_mesh.with_boundaries({"outer": outer}))
        plate = Uniform(given | supports, mesh, plane_law("linear", "plane-stress"), DIRECTIONS["traction"][:1])
        facets, X = plate.solid.loaded, mesh.geometry.X
        normal = facets.normals(X[facets.nodes], np).sum(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        U = displacements(plate, kirsch_traction(facets.centres, normal, a).ravel())
        exact = kirsch(X, a, 1.0, 0.3)
        errors.append(np.abs(U - exact).max() / np.abs(exact).max())
    assert errors[1] < 5e-3
    assert errors[1] < errors[0] / 3.3
    at = np.flatnonzero(np.hypot(*(X - [0.0, a]).T) < 1e-9)[0]  # the top of the hole: sigma = E eps_xx
    cells, corners = np.nonzero(mesh.geometry.nodes == at)
    xi = mesh.geometry.element.basis.doflocs[corners[0]]
    dN = mesh.geometry.element.shape_functions(xi)[1]
    nodes = mesh.geometry.nodes[cells[0]]
    H = U[nodes].T @ dN @ np.linalg.inv(X[nodes].T @ dN)
    assert H[0, 0] == pytest.approx(3.0, rel=stress)


class Uniform(Solid):
    """A plate on any mesh, of E = 1 everywhere."""

    name = "plate"

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        q = self.solid.law.of_modulus(1.0, 0.3)
        self.solid = replace(self.solid, base=replace(self.solid.base, q=q))
        self.data = replace(self.data, solid=self.solid)


def test_a_thick_cylinder_under_pressure_is_lames() -> None:
    """Inner radius 1, outer 2, held along its axis; u_r converges with the third power of h and better."""
    E, nu, a, b = 1.0, 0.3, 1.0, 2.0
    errors = []
    for n in (2, 4):
        options = {"radius": a, "size": "1,0.5", "clamped": "none", "fixed": "y@bottom,y@top", "loaded": "left"}
        tube = Plate(kind="axisymmetric", law="linear", n=n, ny=1, element="quad8", unknown="traction", **options)
        q = tube.solid.law.of_modulus(E, nu)
        tube.solid = replace(tube.solid, base=replace(tube.solid.base, q=q))
        tube.data = replace(tube.data, solid=tube.solid)
        U, r = displacements(tube, np.array([1.0, 0.0])), tube.mesh.geometry.X[:, 0]
        exact = (1.0 + nu) / E * a**2 / (b**2 - a**2) * ((1.0 - 2.0 * nu) * r + b**2 / r)
        errors.append(np.abs(U - np.stack([exact, 0.0 * r], axis=1)).max() / exact.max())
    assert errors[1] < 1e-3
    assert errors[1] < errors[0] / 7.0


def test_thickness_carries_the_load_as_the_modulus_does() -> None:
    """u depends on E t, at a given force; the loads are those of the nominal thickness, whatever p is."""
    by_t, by_E = (Plate(**HAND, unknown=unknown, thickness=t) for unknown, t in (("thickness", 0.1), ("modulus", 1.0)))
    E = np.exp(by_E.parameters.start)
    np.testing.assert_allclose(np.exp(by_t.parameters.start), 0.1 * E, rtol=1e-14)
    t = np.linspace(0.05, 0.2, len(E))
    np.testing.assert_allclose(displacements(by_t, np.log(t)), displacements(by_E, np.log(E * t / 0.1)), atol=1e-14)


def test_the_stress_of_plane_stress_is_the_derivative_of_its_energy_at_any_strain() -> None:
    """By complex steps; up to stretches where Newton's method starts far off, and of 1e-20, as linear elasticity."""
    law, step = plane_law("mooney-rivlin", "plane-stress"), 1e-30
    q, (mu, lam) = law.of_modulus(1.0, 0.3), lame(1.0, 0.3)
    random = np.random.default_rng(1).standard_normal((4, 2, 2))
    for H in [*0.2 * random, np.diag([1.0, 1.0]), np.diag([3.0, -0.5]), np.diag([-0.6, -0.3]), np.diag([9.0, 4.0])]:
        steps = 1j * step * np.eye(4).reshape(4, 2, 2)
        by_W = np.array([law.numpy.W(H + D, q).imag / step for D in steps]).reshape(2, 2)
        P = law.numpy.P(H, q)
        np.testing.assert_allclose(P, by_W, atol=1e-12 * np.abs(P).max())
        by_P = np.stack([law.numpy.P(H + D, q).imag / step for D in steps], axis=-1).reshape(2, 2, 2, 2)
        np.testing.assert_allclose(law.numpy.A(H, q), by_P, atol=1e-12 * np.abs(by_P).max())
    eps = (random + random.transpose(0, 2, 1)) / 2.0
    trace = np.trace(eps, axis1=1, axis2=2)[:, None, None]
    linear = 2.0 * mu * (eps + lam / (lam + 2.0 * mu) * trace * np.eye(2))
    np.testing.assert_allclose(law.numpy.P(1e-20 * random, q) / 1e-20, linear, atol=1e-14)


def test_meshes_with_a_hole_have_its_area_and_its_edge() -> None:
    for body, size, area in (("hole", "2,3", 6.0 - 0.16 * np.pi), ("quarter", "1,1.5", 1.5 - 0.01 * np.pi)):
        for element in ELEMENTS:
            plate = Plate(
                **HAND, nx=8, ny=8, body=body, size=size, radius=0.4 if body == "hole" else 0.2, element=element
            )
            geometry, hole = plate.mesh.geometry, plate.mesh.boundary("hole")
            exact = 1e-4 if element[-1] in "68" else 1e-2
            assert geometry.metric[1].sum() == pytest.approx(area, rel=exact)
            centre = np.array([1.0, 1.5]) if body == "hole" else np.zeros(2)
            radius = np.linalg.norm(geometry.X[hole.node_set] - centre, axis=1)
            np.testing.assert_allclose(radius, 0.4 if body == "hole" else 0.2, rtol=1e-14)


def test_a_finer_plate_inherits_p() -> None:
    for options in ({"body": "hole"}, {"kind": "axisymmetric", "radius": 1.0}, {"unknown": "thickness"}):
        plate = Plate(**HAND | options)
        finer, q = plate.refined(plate.parameters.start)
        assert len(finer.parameters) == len(q) == 4 * len(plate.parameters)
        assert finer.mesh.bounding_box.tolist() == plate.mesh.bounding_box.tolist()


def test_fields_are_in_space_and_data_in_the_plane(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    path.write_text("x,y,ux,uy\n0.3,0.4,0.01,\n1,1,,0.1\n")
    plate = Plate(**HAND, data=str(path), unknown="thickness", thickness=0.5)
    assert plate.data.probes[0].measured.tolist() == [[True, False], [False, True]]
    p = plate.parameters.start
    result = adjoint.prepare(Model(plate), p)(p)
    fields = plate.fields(p, result.u, result.lam, result.gradient)
    assert fields.points.shape == fields.point_data["u"].shape == (9, 3)
    np.testing.assert_allclose(fields.cell_data["dJ_dt"] * fields.cell_data["t"], result.gradient, rtol=1e-14)
    assert set(plate.view(p, result.u, None).columns) == {"x", "y"}


def test_regions_of_a_mesh_file_have_a_modulus_each(tmp_path: Path) -> None:
    """The same gradient as that by cells, summed over each region; cells of no region are refused."""
    path = tmp_path / "two.msh"
    geometry = rectangle_mesh("plate", "quad4", (2, 2), (1.0, 1.0)).geometry
    kind, cells = geometry.for_meshio()
    tags = [np.array([1, 2, 1, 2])]
    two = {"soft": np.array([1, 2]), "stiff": np.array([2, 2])}  # tag and dimension
    file = meshio.Mesh(np.pad(geometry.X, ((0, 0), (0, 1))), [(kind, cells)], field_data=two)
    file.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    file.write(path, file_format="gmsh22", binary=False)
    options = {"mesh": str(path), "derivatives": "hand"}
    by_region, by_cell = Plate(**options, unknown="regions", alpha=0.1), Plate(**options)
    assert [by_region.parameters.label(i) for i in (0, 1)] == ["log E_soft", "log E_stiff"]
    p = by_region.parameters.start
    each = adjoint.prepare(Model(by_cell), p[[0, 1, 0, 1]])(p[[0, 1, 0, 1]]).gradient
    found = adjoint.prepare(Model(by_region), p)(p).gradient  # at its start Phi has no gradient
    np.testing.assert_allclose(found, [each[0] + each[2], each[1] + each[3]], rtol=1e-11)
    with pytest.raises(
        InputError, match=r"4 of 4 cells are in no region .* \(none\), first cell 1 - give each cell one"
    ):
        Plate(**HAND, unknown="regions")


BAD: list[tuple[dict[str, Any], str]] = [
    ({"thickness": 0.0}, "thickness=0"),
    ({"thickness": float("nan")}, "thickness=nan"),
    ({"kind": "axisymmetric", "thickness": 0.1}, "has no thickness"),
    ({"kind": "axisymmetric", "unknown": "thickness"}, "has no thickness"),
    ({"body": "hole", "radius": 0.5}, "radius=0.5 - a hole in this plate has a radius > 0 and < 0.5 m"),
    ({"body": "quarter", "radius": 2.0}, "< 1 m"),
    ({"body": "hole", "radius": 0.0}, "radius=0 "),
    ({"body": "hole", "ny": 3}, "ny=3 - around a hole"),
    ({"body": "hole", "n": 2, "element": "tri6", "radius": 0.49}, "take more cells or a smaller hole"),
    ({"kind": "axisymmetric", "loaded": "left"}, "loaded=left lies on the axis"),
    ({"kind": "axisymmetric", "markers": 3, "face": "left"}, "face=left lies on the axis"),
    ({"radius": 0.1}, "radius needs body=hole"),
    ({"kind": "axisymmetric", "radius": -1.0}, "radius=-1"),
    ({"size": "1,2,3"}, "give one length or two"),
    ({"cases": 3}, "there are 1 to 2: along y, x"),
    ({"clamped": "front"}, "no boundary 'front'"),
    ({"clamped": "z=0"}, "no boundary 'z=0'"),
    ({"clamped": "none"}, "free to move"),
    ({"clamped": "none", "fixed": "x@left"}, "free to move"),
    ({"load": "displacement", "fixed": "y@top"}, "the grip moves nothing"),
    ({"fixed": "z@left"}, "'z@left' is not a component x, y at a face"),
    ({"fixed": "left"}, "write x@left,y@bottom"),
    ({"derivatives": "hand", "law": "linear"}, "not linear"),
    ({"law": "mooney-rivlin", "nu": 0.1}, "c = "),
    ({"mesh": "nowhere.msh", "radius": 0.1}, "radius does not go with mesh"),
]


@pytest.mark.parametrize(("options", "says"), BAD, ids=[says for _, says in BAD])
def test_bad_options_of_a_plate_are_one_line(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError) as caught:
        Plate(**options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"


@pytest.mark.parametrize(
    ("kind", "points", "cells", "says"),
    [
        ("hexahedron", np.array(list(np.ndindex(2, 2, 2))), [[0, 4, 6, 2, 1, 5, 7, 3]], "is of dimension 3"),
        ("quad", [[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 1]], [[0, 1, 2, 3]], "is not plane: z from 0 to 1"),
        ("quad", [[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2, 3]], "x goes from -1 m"),
        ("quad", [[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]], [[0, 1, 2, 3]], "1 of 1 cells are flat"),
        ("line", [[0, 0, 0], [1, 0, 0]], [[0, 1]], "is of dimension 1"),
    ],
)
def test_meshes_that_are_no_plates_are_refused(kind: str, points: Any, cells: Any, says: str, tmp_path: Path) -> None:
    path = tmp_path / "mesh.vtu"
    meshio.Mesh(np.array(points, dtype=float), [(kind, np.array(cells))]).write(path)
    with pytest.raises(InputError, match=says):
        Plate(mesh=str(path), kind="axisymmetric")


def test_automatic_differentiation_takes_the_law_arap_in_a_plane() -> None:
    """Its rotation has derivatives of its own, which JAX differentiates compiled."""
    plate = Plate(n=1, law="arap", kind="plane-strain", derivatives="hand")
    model, p = Model(plate), plate.parameters.start
    by_hand = adjoint.prepare(model, p)(p).gradient
    assert relative_error(implicit_ad.prepare(model, p)(p).gradient, by_hand) < 1e-12
