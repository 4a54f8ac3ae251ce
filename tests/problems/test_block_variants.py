"""All routes on all that a block can be: unknowns, laws, loads, elements, hand-derived derivatives, data."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import relative_error
from meshio import Mesh
from skfem.io.meshio import from_meshio, to_meshio

from benchmarks.sensitivity_picture import slice_of
from gradient_routes.problems.block import Block
from gradient_routes.problems.data.probes import read_probes
from gradient_routes.problems.errors import DomainError, InputError
from gradient_routes.problems.fem.assembly_jax import gradient
from gradient_routes.problems.fem.elements import Element, Geometry
from gradient_routes.problems.fem.locating import locate
from gradient_routes.problems.fem.mesh import box_mesh
from gradient_routes.problems.fem.mesh_files import read_mesh
from gradient_routes.problems.jax64 import jax
from gradient_routes.problems.mechanics.materials import LAWS
from gradient_routes.problems.problem import Array
from gradient_routes.routes.adjoint import adjoint
from gradient_routes.routes.complex_step import complex_step
from gradient_routes.routes.finite_difference import fd_central, fd_one_sided
from gradient_routes.routes.implicit_ad import implicit_ad
from gradient_routes.routes.model import Model
from gradient_routes.routes.newton import Solver
from gradient_routes.routes.synthetic_data import with_synthetic_data
from gradient_routes.routes.tangent import tangent
from gradient_routes.routes.unrolled_ad import unrolled_ad

SMALL: dict[str, Any] = {"nx": 1, "ny": 2, "nz": 2}
# every unknown, law, load, element and kind of data, and each pair that meets in a formula; where it is not about the
# law, linear elasticity, which is traced in a fraction of the time
VARIANTS: dict[str, dict[str, Any]] = {
    "layers": {"unknown": "layers", "layers": 2, "law": "linear"},
    "constants": {"unknown": "constants"},
    "twin traction": {"unknown": "traction", "data": "twin", "size": "2", "law": "linear"},
    "tet10 shape": {"unknown": "shape", "element": "tet10", "ny": 1, "nz": 1, "surface": "right", "law": "linear"},
    "load": {"unknown": "load", "law": "linear"},
    "yeoh": {"law": "yeoh"},
    "ogden": {"law": "ogden", "unknown": "constants"},
    "hand": {"derivatives": "hand", "parametrization": "raw"},
    "hand constants": {"derivatives": "hand", "law": "mooney-rivlin", "unknown": "constants", "load": "follower"},
    "hand layers": {"derivatives": "hand", "unknown": "layers", "layers": 2, "cases": 2, "data": "twin"},
    "follower shape": {"load": "follower", "unknown": "shape", "law": "linear", "element": "tet4"},
    "grip": {"load": "displacement", "cases": 2, "law": "linear"},
    "grip load": {"load": "displacement", "unknown": "load", "law": "linear"},
    "markers": {
        "law": "linear",
        "markers": 6,
        "components": "in-plane",
        "face": "right",
        "data": "twin",
        "noise": 1e-3,
        "size": "1,2,1",
    },
}
LONG = ("yeoh", "ogden")  # compile longest: routes do not know the law, test_materials does
UNROLLED = ("layers", "constants", "twin traction", "follower shape", "load")  # every unknown: third derivatives
TIGHT = Solver(rtol=1e-14)


@pytest.mark.parametrize("name", VARIANTS)
def test_every_route_gives_the_gradient_of_every_kind_of_block(name: str) -> None:
    """Against the complex step, which knows neither R_p nor a transpose; itself held to finite differences."""
    problem = with_synthetic_data(Block(**SMALL | VARIANTS[name]))
    p = near_start(problem)
    exact = complex_step.prepare(Model(problem, TIGHT), p)(p).gradient
    J = Model(problem, TIGHT).solve(p).J
    tolerances = {
        tangent: 1e-11,  # the complex step's own 1e-12, see test_block, and what conditioning adds
        adjoint: 1e-11,
        implicit_ad: 1e-11,
        unrolled_ad: 1e-8,  # an iterate's derivative converges more slowly than the iterate
        fd_central: 1e-7,  # eps^(2/3) and eps^(1/2), times ratios of derivatives
        fd_one_sided: 1e-5,
    }
    options = {adjoint: {"factors": "fresh"} if name in LONG else {}}
    options |= {route: {"start": "chord"} for route in (fd_central, fd_one_sided)}
    for route, tolerance in tolerances.items():
        if (route is unrolled_ad and name not in UNROLLED) or (route is not adjoint and name in LONG):
            continue
        if route.objection(problem) is None:
            result = route.prepare(Model(problem, TIGHT), p, **options.get(route, {}))(p)
            assert relative_error(result.gradient, exact) < tolerance, route.name
            assert result.J is None or result.J == pytest.approx(J, rel=1e-9, abs=1e-15), route.name
        else:
            pytest.fail(f"{route.name} does not run: {route.objection(problem)}")


def near_start(problem: Block) -> Array:
    """Off the start, by a hundredth of what p_i naturally changes by."""
    parameters = problem.parameters
    return parameters.start + 0.01 * parameters.scale * np.random.default_rng(0).uniform(-1, 1, len(parameters))


def test_the_picture_shows_the_inclusion_and_a_gradient_that_points_at_it() -> None:
    slice_ = slice_of(5)
    inside = slice_.truth > 1.0
    assert 0 < inside.sum() < inside.size
    assert (slice_.sensitivity < 0).all()  # stiffer, it says
    assert slice_.sensitivity[inside].mean() < 1.1 * slice_.sensitivity[~inside].mean()
    np.testing.assert_allclose(slice_.sensitivity, slice_.sensitivity[:, ::-1], rtol=1e-9)  # as the body


@pytest.mark.parametrize("element", ["hex8", "tet4", "tet10"])
def test_mesh_files_give_the_body_they_hold(element: str, tmp_path: Path) -> None:
    """Written from a box, read back: the same gradient, with the faces the file names."""
    path, box = str(tmp_path / "box.vtu"), Block(**SMALL, element=element, derivatives="hand")
    named = box.mesh.skfem_mesh.with_boundaries({"grip": box.mesh.skfem_mesh.facets_satisfying(lambda x: x[2] == 0.0)})
    to_meshio(named).write(path)
    read = Block(mesh=path, clamped="grip", loaded="z=1", derivatives="hand")
    assert (read.n_state, len(read.parameters)) == (box.n_state, len(box.parameters))
    p = box.parameters.start
    one, other = (adjoint.prepare(Model(block), p)(p) for block in (box, read))
    assert relative_error(other.gradient, one.gradient) < 1e-11
    fields = read.fields(p, other.u, other.lam, other.gradient)
    back = Mesh(fields.points, [(fields.cell_type, fields.cells)])
    assert from_meshio(back).p.shape == read.mesh.skfem_mesh.p.shape


def test_faces_of_a_quadratic_mesh_are_named_by_quadratic_triangles(tmp_path: Path) -> None:
    box, path = box_mesh("box", "tet10", (1, 1, 1), (1.0, 1.0, 1.0)), tmp_path / "box.msh"
    top = box.boundary("top")
    X, on_top = box.geometry.X, [[a for a in cell if box.geometry.X[a, 2] == 1.0] for cell in top.nodes]
    name, cells = box.geometry.for_meshio()
    faces = np.array([sorted(nodes, key=lambda a: (X[a] % 1.0 != 0.0).any()) for nodes in on_top])  # corners first
    tags = [np.full(len(cells), 1), np.full(len(faces), 2)]
    named = {"body": np.array([1, 3]), "lid": np.array([2, 2])}  # tag and dimension
    gmsh = Mesh(X, [(name, cells), ("triangle6", faces)], field_data=named)
    gmsh.cell_data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    gmsh.write(path, file_format="gmsh22", binary=False)
    np.testing.assert_array_equal(read_mesh("block", path).boundary("lid").node_set, top.node_set)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_congruent_cells_share_their_gradients_at_any_scale(size: float) -> None:
    """Edges of size / 7 differ by rounding; one of them by a millionth makes cells of their own."""
    geometry = box_mesh("box", "hex8", (7, 1, 1), (size, size, size)).geometry
    assert len(np.unique(np.diff(np.unique(geometry.X[:, 0])))) > 1
    assert geometry.metric[0].shape == (1, 8, 8, 3)
    X = np.where(geometry.X == size, (1.0 + 1e-6) * size, geometry.X)
    assert replace(geometry, X=X).metric[0].shape == (7, 8, 8, 3)


def test_neighbours_of_a_cell_share_a_facet() -> None:
    block = Block(**SMALL, size="1,2,2", alpha=1.0)  # cubes
    centres = block.mesh.geometry.centres
    near = [(i, j) for i in range(4) for j in range(4) if i < j and np.linalg.norm(centres[i] - centres[j]) < 1.1]
    assert sorted(tuple(sorted(pair)) for pair in block.regularization.pairs.tolist()) == near


def test_a_patch_of_any_element_is_stretched_evenly() -> None:
    """nu = 0 and one E: F = diag(1, 1, s) with E/2 (s - 1/s) = t wherever, on every mesh."""
    s = 0.3 + np.sqrt(0.3**2 + 1.0)
    for element, derivatives in (("hex8", "ad"), ("tet4", "hand"), ("tet10", "hand")):
        block = Block(**SMALL, element=element, derivatives=derivatives, nu=0.0, traction=0.3, size="1,2,3")
        u = Model(block).solve(np.zeros(len(block.parameters))).u
        X = block.mesh.geometry.X
        U = block.solid.bc.displacements(u, 0.0, 0, np.arange(len(X)), np)
        np.testing.assert_allclose(U, X * [0.0, 0.0, s - 1.0], atol=1e-11)


def test_a_follower_pressure_has_a_tangent_that_is_not_symmetric() -> None:
    block = Block(**SMALL, load="follower", law="linear")
    u = 0.05 * np.random.default_rng(0).standard_normal(block.n_state)
    K = block.tangent(u, block.parameters.start).full()
    assert abs(K - K.T).max() > 1e-3 * abs(K).max()


@pytest.mark.parametrize(("nz", "n_p"), [(1, 1), (2, 2), (3, 3), (4, 4), (5, 4), (9, 4)])
def test_layers_default_to_four_or_what_the_mesh_has(nz: int, n_p: int) -> None:
    block = Block(n=1, nz=nz, unknown="layers")
    p = block.parameters.start
    assert len(p) == n_p
    finer, q = block.refined(p)
    assert len(finer.parameters) == len(q) == n_p
    assert set(block.solid.design.parameter_of_cell) == set(range(n_p))
    with pytest.raises(InputError, match=r"lies in layer \d - choose fewer"):
        Block(n=1, nz=nz, unknown="layers", layers=nz + 1 if nz < 4 else 2 * nz)


FORCES = {"traction": np.diag([1.0, 0.25, 0.25])[:, [1, 2, 0]], "follower": np.outer([1.0, 1 / 2, 1 / 3], [0, 0, 1])}


@pytest.mark.parametrize("load", FORCES)
@pytest.mark.parametrize("derivatives", ["ad", "hand"])
def test_load_cases_have_the_resultant_forces_of_the_documentation(load: str, derivatives: str) -> None:
    """At u = 0, R = -f_ext: the forces on a face of 1 x 2 m^2 sum to traction x area x the factor of the case."""
    block = Block(**SMALL, size="1,2,1", load=load, cases=3, traction=0.3, derivatives=derivatives)
    R = block.residual(np.zeros(block.n_state), block.parameters.start).reshape(3, -1, 3)
    np.testing.assert_allclose(-R.sum(axis=1), 0.3 * 2.0 * FORCES[load], rtol=1e-13, atol=1e-15)


@pytest.mark.parametrize("load", ["traction", "displacement", "follower"])
def test_single_load_cases_add_up_to_all_of_them(load: str) -> None:
    block = Block(**SMALL, load=load, cases=3, derivatives="hand")
    p = near_start(block)
    state, n = Model(block).solve(p), block.n_state // 3
    for case, single in enumerate(block.load_cases()):
        np.testing.assert_allclose(Model(single).solve(p).u, state.u[case * n : (case + 1) * n], atol=1e-12)
    assert sum(Model(single).value(p) for single in block.load_cases()) == pytest.approx(state.J, rel=1e-10)


def test_a_plane_holds_the_facets_within_a_millionth_of_the_diameter() -> None:
    """Facets whose farthest node is at 0.9e-6 and at 1.1e-6 of the diameter from the plane."""
    mesh = box_mesh("box", "hex8", (1, 1, 1), (3.0, 4.0, 12.0))  # its diagonal is 13 m
    at = [12.0 + sign * factor * 13e-6 for factor in (0.9, 1.1) for sign in (-1, 1)]
    for z in at[:2]:
        assert mesh.boundary(f"z={z!r}").cells.tolist() == [0]
    for z in at[2:]:
        with pytest.raises(InputError, match="no facet of the surface lies on z="):
            mesh.boundary(f"z={z!r}")
    with pytest.raises(InputError, match="no facet"):  # the side faces touch the plane with one edge only
        mesh.boundary("z=6")


@pytest.mark.parametrize("where", ["top", "right", "z=1"])
def test_markers_read_what_the_shape_functions_say(where: str) -> None:
    """A displacement that is affine in X is read exactly at every marker; in-plane leaves the normal out."""
    for element in ("hex8", "tet4", "tet10"):
        block = Block(**SMALL, element=element, markers=7, face=where, components="in-plane", seed=3)
        H = np.array([[0.1, 0.2, 0.3], [0.0, -0.1, 0.4], [0.2, 0.1, 0.5]])
        U, probes = block.mesh.geometry.X @ H.T, block.data.probes[0]
        np.testing.assert_allclose(probes.read(U[probes.nodes]), probes.x @ H.T, atol=1e-14)
        normal = 0 if where == "right" else 2
        np.testing.assert_allclose(probes.x[:, normal], 1.0, atol=1e-14)
        assert probes.measured.sum(axis=0).tolist() == [0 if i == normal else 7 for i in range(3)]


def test_measured_points_need_not_be_nodes_nor_whole(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    path.write_text("x,y,z,ux,uy,uz\n0.3,0.4,1,0.01,,0.2\n1,1,1,,,0.1\n")
    block = Block(**SMALL, data=str(path))
    probes = block.data.probes[0]
    assert probes.measured.tolist() == [[True, False, True], [False, False, True]]
    U = block.mesh.geometry.X @ np.diag([0.1, 0.2, 0.3])
    np.testing.assert_allclose(probes.read(U[probes.nodes]), [[0.03, 0.08, 0.3], [0.1, 0.2, 0.3]], atol=1e-14)


def test_synthetic_data_are_what_the_truth_would_show() -> None:
    """At the truth the misfit is the noise; another seed draws other noise; before they are made J says what to do."""
    options = SMALL | {"data": "twin", "markers": 20, "noise": 1e-3, "derivatives": "hand"}
    with pytest.raises(InputError, match="with_synthetic_data"):
        Model(Block(**options)).solve(Block(**options).parameters.start)
    one, other = (with_synthetic_data(Block(**options, seed=seed)) for seed in (0, 1))
    J = Model(one).value(one.truth())
    assert J == pytest.approx(0.5 * 60 * 1e-6, rel=0.5)  # chi squared of 60 numbers: rel. 0.18 a standard deviation
    assert J != Model(other).value(other.truth())
    exact = with_synthetic_data(Block(**options | {"noise": 0.0}))
    assert Model(exact).value(exact.truth()) < 1e-24


BAD: list[tuple[dict[str, Any], str]] = [
    ({"nx": 0}, "nx=0"),
    ({"size": "1,2"}, "size=1,2"),
    ({"size": "0"}, "size=0"),
    ({"size": "a"}, "size=a"),
    ({"clamped": "none"}, "free to move"),
    ({"clamped": "nowhere"}, "no boundary 'nowhere'"),
    ({"loaded": "z=7"}, "no facet"),
    ({"mesh": "nowhere.msh", "nx": None, "ny": None, "nz": None}, "no such file"),
    ({"mesh": "nowhere.msh"}, "nx does not go with mesh"),
    ({"sensors": "left", "markers": 3}, "sensors does not go with markers"),
    ({"components": "in-plane"}, "components needs markers"),
    ({"load": "displacement", "traction": 9.0}, "traction does not go with load=displacement"),
    ({"loaded": "bottom"}, "all its nodes are clamped"),
    ({"sensors": "bottom"}, "held at zero and tells nothing"),
    ({"markers": 3, "face": "bottom"}, "held at zero and tells nothing"),
    ({"nx": 10**9}, "at most"),
    ({"law": "mooney-rivlin", "nu": 0.1}, "c = "),
    ({"derivatives": "hand", "law": "ogden"}, "not ogden"),
    ({"derivatives": "hand", "unknown": "shape"}, "not by shape"),
    ({"unknown": "traction", "load": "follower"}, "one case of load=traction"),
    ({"unknown": "shape", "surface": "top"}, "choose a free surface"),
    ({"unknown": "layers", "layers": 9}, "choose fewer"),
    ({"unknown": "load", "parametrization": "raw"}, "parametrization needs unknown=modulus, layers or regions"),
    ({"cases": 4}, "cases=4"),
    ({"markers": -1}, "markers=-1"),
    ({"noise": 0.1}, "data=twin"),
    ({"data": "nowhere.csv"}, "No such file"),
]


@pytest.mark.parametrize(("options", "says"), BAD, ids=[says for _, says in BAD])
def test_bad_options_of_any_block_are_one_line(options: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError) as caught:
        Block(**SMALL | options)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert " - " in str(caught.value), "an error says what to do"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("x,y,z,ux,uy,uz\n500,500,1000,0,0,1\n", "row 1 at (500, 500, 1000) lies outside"),
        ("x,y,z,u\n0,0,1,0\n", "no column ux, uy, uz"),
        ("x,y,z,ux,uy,uz\n0,0,1,,,\n", "measures nothing"),
        ("x,y,z,ux,uy,uz\n0,,1,0,0,0\n", "column y: '' is not a number"),
        ("x,y,z,ux,uy,uz\n0,0,1,0,0,nan\n", "nan is not finite"),
    ],
)
def test_bad_data_files_say_where(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        Block(**SMALL, data=str(path))
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_points_outside_a_mesh_are_refused_with_the_box_of_the_mesh(tmp_path: Path) -> None:
    """A point may be outside by a thousandth of the diameter, 13 m, and no more."""
    mesh = box_mesh("block", "hex8", (1, 1, 1), (3.0, 4.0, 12.0))
    moved = replace(mesh, geometry=replace(mesh.geometry, X=mesh.geometry.X + np.array([10.0, 20.0, 30.0])))
    path = tmp_path / "d.csv"
    path.write_text("x,y,z,ux,uy,uz\n11,22,42.012,0,0,1\n")
    points = read_probes(moved, str(path)).probes[0]
    np.testing.assert_allclose(points.read(moved.geometry.X[points.nodes]), [[11.0, 22.0, 42.012]], rtol=1e-12)
    path.write_text("x,y,z,ux,uy,uz\n11,22,42.012,0,0,1\n11,22,42.014,0,0,1\n")
    says = "data row 2 at (11, 22, 42.014) lies outside block, whose box of 3, 4, 12 m begins at (10, 20, 30) (1 of 2"
    with pytest.raises(InputError, match=re.escape(says)):
        read_probes(moved, str(path))


def test_data_a_thousand_times_off_are_warned_of(tmp_path: Path) -> None:
    path = tmp_path / "d.csv"
    path.write_text("x,y,z,ux,uy,uz\n0.5,0.5,1,0,0,200\n")
    assert "units right?" in Block(**SMALL, data=str(path)).notes[0]
    assert "zero load" in Block(**SMALL, traction=0.0).notes[0]


@pytest.mark.parametrize(
    ("kind", "cells", "moved", "says"),
    [
        ("triangle", [[0, 1, 2]], None, "is of dimension 2 \\(triangle\\), not 3"),
        ("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]], None, ""),
        ("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]], [0.1, 0.1, 0.1], "folded over a neighbour"),
        ("tetra", [[0, 1, 2, 3], [1, 2, 3, 4]], [1 / 3, 1 / 3, 1 / 3], "flat, inside out"),
        ("tetra", [[0, 1, 2, 3], [4, 4, 4, 4]], None, "1 of 2 cells are flat, .*, first cell 2"),
    ],
)
def test_invalid_meshes_are_refused(kind: str, cells: list, moved: list | None, says: str, tmp_path: Path) -> None:
    X = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
    X[4] = X[4] if moved is None else moved
    path = tmp_path / "mesh.vtu"
    Mesh(X, [(kind, np.array(cells))]).write(path)
    if says:
        with pytest.raises(InputError, match=says):
            read_mesh("block", path)
    else:
        assert read_mesh("block", path).geometry.metric[1].sum() == pytest.approx(0.5)


def test_elements_inside_out_bear_nothing_in_real_and_complex_arithmetic() -> None:
    """Else Newton's method, or the complex step alone, would converge to states that no body can take."""
    H = np.diag([0.0, 0.0, -1.5])
    for law in LAWS.values():
        if law.name != "linear":
            q = law.of_modulus(1.0, 0.3)
            P = jax.jit(gradient(law.W, 0))
            for dtype in (float, complex):
                assert not np.isfinite(P(H.astype(dtype), q)).all(), law.name
            if law.numpy is not None:
                assert not np.isfinite(law.numpy.P(H[None] + 0j, tuple(np.ones((len(q), 1))))).all()


def test_a_shape_that_folds_a_cell_is_refused() -> None:
    block = Block(**SMALL, unknown="shape")
    p = block.parameters.start.copy()
    p[::3] -= 3.0  # x of the nodes on the right face: far behind the left one
    with pytest.raises(DomainError, match="inside out, first cell"):
        Model(block).solve(p)


def test_points_in_distorted_and_in_flat_cells_are_found() -> None:
    """x = sum_a N_a(xi) X_a in the cell that is named, whatever its neighbours' maps do out there."""
    rng = np.random.default_rng(0)
    for element, size in (("hex8", (1.0, 1.0, 1.0)), ("tet4", (1.0, 1.0, 20.0)), ("tet10", (20.0, 1.0, 0.05))):
        body = box_mesh("box", element, (3, 3, 3), size)
        geometry = body.geometry
        if element == "hex8":
            inside = ((geometry.X > 0.0) & (geometry.X < 1.0)).all(axis=1)
            X = geometry.X + 0.06 * inside[:, None] * rng.uniform(-1, 1, geometry.X.shape)
            geometry = Geometry(geometry.element, geometry.nodes, X)
        x = rng.uniform(0.0, size, (100, 3))
        found = locate(geometry, x)
        N, _ = geometry.element.shape_functions(found.xi.T)
        np.testing.assert_allclose(np.einsum("ma,mai->mi", N, geometry.X[geometry.nodes[found.cells]]), x, atol=1e-8)
        assert found.distance.max() == 0.0


def test_points_in_the_bulge_of_a_curved_side_are_found() -> None:
    """An edge through y = 0, -0.2, -0.16 reaches -0.2133, outside the box of its nodes; another cell is nearer."""
    element = Element("tet10")
    curved = element.basis.doflocs.copy()
    curved[np.flatnonzero((curved == [1.0, 0.0, 0.0]).all(axis=1)), 1] = -0.16
    curved[np.flatnonzero((curved == [0.5, 0.0, 0.0]).all(axis=1)), 1] = -0.2
    xi = np.array([2 / 3, 1e-3, 1e-3])
    x = element.shape_functions(xi)[0] @ curved
    assert x[1] < curved[:, 1].min() - 0.01
    X = np.concatenate([curved, x - [0.0, 0.1, 0.0] + 0.02 * element.basis.doflocs])
    found = locate(Geometry(element, np.arange(20).reshape(2, 10), X), x[None])
    assert found.cells.tolist() == [0]
    np.testing.assert_allclose(found.xi, [xi], atol=1e-9)
    assert found.distance[0] == 0.0


def test_meshes_in_two_parts_and_of_two_kinds_are_refused(tmp_path: Path) -> None:
    box = box_mesh("box", "hex8", (1, 1, 1), (1.0, 1.0, 1.0))
    name, cells = box.geometry.for_meshio()
    X = np.concatenate([box.geometry.X, box.geometry.X + np.array([0, 0, 2])])
    two = tmp_path / "two.vtu"
    Mesh(X, [(name, np.concatenate([cells, cells + 8]))]).write(two)
    with pytest.raises(InputError, match="part 2 of 2"):
        Block(mesh=str(two))
    mixed = tmp_path / "mixed.vtu"
    Mesh(X, [(name, cells), ("wedge", np.arange(8, 14)[None])]).write(mixed)
    with pytest.raises(InputError, match="hexahedron, wedge"):
        Block(mesh=str(mixed))
    beyond = tmp_path / "beyond.vtu"
    Mesh(X, [(name, cells + 12)]).write(beyond)
    with pytest.raises(InputError, match="points beyond its 16"):
        Block(mesh=str(beyond))


def test_the_origin_of_a_mesh_does_not_loosen_the_solve(tmp_path: Path) -> None:
    here, there = (str(tmp_path / f"{name}.vtu") for name in ("here", "there"))
    box = box_mesh("box", "hex8", (2, 2, 2), (1.0, 1.0, 1.0))
    name, cells = box.geometry.for_meshio()
    for path, shift in ((here, 0.0), (there, 1e4)):
        Mesh(box.geometry.X + shift, [(name, cells)]).write(path)
    blocks = (Block(mesh=path, derivatives="hand") for path in (here, there))
    one, other = (Model(block).solve(block.parameters.start) for block in blocks)
    assert other.residual < 1e-12
    assert relative_error(other.u, one.u) < 1e-10  # eps times the shift in positions


def test_a_zero_gradient_at_the_truth_gets_no_warning(cli) -> None:
    command = (
        "run --json --no-store --no-timing --problem block[n=2,data=twin,derivatives=hand] --at true --route adjoint"
    )
    (row,) = cli(*command.split()).rows
    assert row["gradient_error"] < 1e-9
    assert "zero: relative to its terms" in row["reference"]
    assert row["note"] is None
