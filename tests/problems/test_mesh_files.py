"""Meshes of files: their groups in MSH 2.2 and 4.1, and what is refused rather than computed with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from gradient_routes.problems.block import Block
from gradient_routes.problems.errors import InputError
from gradient_routes.problems.fem.mesh import Mesh, box_mesh
from gradient_routes.problems.fem.mesh_files import read_mesh
from gradient_routes.problems.fem.plane_meshes import rectangle_mesh
from gradient_routes.problems.plate import Plate
from gradient_routes.problems.problem import Array
from gradient_routes.routes.model import Model

GMSH = {"line": 1, "triangle": 2, "quad": 3, "hexahedron": 5, "line3": 8, "triangle6": 9, "tetra10": 11, "quad8": 16}
GROUPS = ("body", "foot", "lid", "painted")
Entity = tuple[int, str, Array, tuple[int, ...]]  # dimension, kind, nodes of the cells, groups


def body(element: Any) -> tuple[Mesh, list[Entity]]:
    """A square or a cube, and its entities: of the groups lid and painted, the top is in both."""
    solid = element in ("hex8", "tet10")
    mesh = (
        box_mesh("block", element, (2, 2, 2), (1, 1, 1)) if solid else rectangle_mesh("plate", element, (2, 2), (1, 1))
    )
    name, cells = mesh.geometry.for_meshio()
    facet = {"hex8": "quad", "tet10": "triangle6", "tri3": "line", "tri6": "line3", "quad8": "line3"}[element]
    sides = {"bottom": (1,), "top": (2, 3), "right": (3,)}
    dim = mesh.geometry.dim
    entities = [(dim - 1, facet, in_order(mesh, side), groups) for side, groups in sides.items()]
    return mesh, [*entities, (dim, name, cells, (0,))]


def in_order(mesh: Mesh, side: str) -> Array:
    """Nodes of the facets of a side as files have them: corners around, then the middles of edges."""
    facets, X = mesh.boundary(side), mesh.geometry.X
    rows = []
    for nodes, N in zip(facets.nodes, facets.N, strict=True):
        on = nodes[(np.abs(N) > 1e-9).any(axis=0)]
        corner = np.isin(on, mesh.skfem_mesh.t)
        corners, middles = on[corner], on[~corner]
        if len(corners) == 4:  # a square, around
            corners = corners[np.lexsort(X[corners].T)][[0, 1, 3, 2]]
        edges = zip(corners, np.roll(corners, -1), strict=True) if middles.size else ()
        nearest = [middles[np.abs(X[middles] - X[[a, b]].mean(axis=0)).sum(axis=1).argmin()] for a, b in edges]
        rows.append([*corners, *nearest[: len(middles)]])
    return np.array(rows)


def msh(path: Path, version: str, X: Array, entities: list[Entity]) -> str:
    """Write it as Gmsh does: MSH 2.2 repeats a cell for each of its groups, 4.1 lists the groups of each entity."""
    X = np.pad(X, ((0, 0), (0, 3 - X.shape[1])))
    dims = {tag: dim for dim, *_, groups in entities for tag in groups}
    out = [f"$MeshFormat\n{version} 0 8\n$EndMeshFormat", f"$PhysicalNames\n{len(dims)}"]
    out += [f'{dim} {tag + 1} "{GROUPS[tag]}"' for tag, dim in dims.items()] + ["$EndPhysicalNames"]
    points = [f"{x:.16g} {y:.16g} {z:.16g}" for x, y, z in X]
    if version == "2.2":
        out += [f"$Nodes\n{len(X)}", *(f"{i + 1} {point}" for i, point in enumerate(points)), "$EndNodes"]
        lines = [
            f"{GMSH[kind]} 2 {tag + 1} {number + 1} {' '.join(map(str, nodes))}"
            for number, (_, kind, cells, groups) in enumerate(entities)
            for tag in groups
            for nodes in gmsh_order(kind, cells) + 1
        ]
        out += [f"$Elements\n{len(lines)}", *(f"{i + 1} {line}" for i, line in enumerate(lines)), "$EndElements"]
    else:
        count = [sum(dim == entity[0] for entity in entities) for dim in range(4)]
        out += ["$Entities", " ".join(map(str, count))]
        for dim in range(4):
            out += [
                f"{number + 1} 0 0 0 1 1 1 {len(groups)} {' '.join(str(tag + 1) for tag in groups)} 0"
                for number, (of, _, _, groups) in enumerate(entities)
                if of == dim
            ]
        top = max(dim for dim, *_ in entities)
        out += [f"$EndEntities\n$Nodes\n1 {len(X)} 1 {len(X)}\n{top} {len(entities)} 0 {len(X)}"]
        out += [*(str(i + 1) for i in range(len(X))), *points, "$EndNodes"]
        total = sum(len(cells) for _, _, cells, _ in entities)
        out += [f"$Elements\n{len(entities)} {total} 1 {total}"]
        start = 1
        for number, (dim, kind, cells, _) in enumerate(entities):
            out += [f"{dim} {number + 1} {GMSH[kind]} {len(cells)}"]
            out += [f"{start + i} {' '.join(map(str, row))}" for i, row in enumerate(gmsh_order(kind, cells) + 1)]
            start += len(cells)
        out += ["$EndElements"]
    path.write_text("\n".join(out) + "\n")
    return str(path)


def gmsh_order(kind: str, cells: Array) -> Array:
    return cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]] if kind == "tetra10" else cells


@pytest.mark.parametrize("element", ["hex8", "tet10", "tri3", "tri6", "quad8"])
def test_groups_of_msh_22_and_41_are_the_same(element: Any, tmp_path: Path) -> None:
    """A face in two groups, which MSH 2.2 repeats, belongs to both; of second order, too."""
    mesh, entities = body(element)
    problem: Any = Block if mesh.geometry.dim == 3 else Plate
    J = []
    for version in ("2.2", "4.1"):
        path = msh(tmp_path / f"{version}.msh", version, mesh.geometry.X, entities)
        found = read_mesh("body", path, dim=mesh.geometry.dim)
        assert set(found.boundaries) == {"foot", "lid", "painted"}
        for group, sides in {"foot": ["bottom"], "lid": ["top"], "painted": ["top", "right"]}.items():
            expected = np.unique(np.concatenate([mesh.boundary(side).node_set for side in sides]))
            np.testing.assert_array_equal(found.boundary(group).node_set, expected)
        assert found.regions["body"].tolist() == [*range(len(mesh.geometry.nodes))]
        solid = problem(mesh=path, clamped="foot", loaded="painted", derivatives="hand", unknown="constants")
        J.append(Model(solid).value(solid.parameters.start))
    assert J[0] == J[1]


def test_cells_that_are_there_twice_are_refused(tmp_path: Path) -> None:
    """But once for each of two groups MSH 2.2 repeats them."""
    mesh, entities = body("tri3")
    dim, kind, cells, _ = entities[-1]
    entities[-1] = (dim, kind, np.concatenate([cells, cells[:3]]), (0,))
    with pytest.raises(InputError, match=r"has 3 cells twice, of the same nodes - "):
        read_mesh("plate", msh(tmp_path / "twice.msh", "2.2", mesh.geometry.X, entities), dim=2)


def test_a_face_of_which_a_part_is_no_side_of_a_cell_is_refused(tmp_path: Path) -> None:
    mesh, entities = body("tri3")
    dim, kind, lines, groups = entities[0]
    entities[0] = (dim, kind, np.concatenate([lines, [[0, 8]]]), groups)  # a diagonal of the square
    with pytest.raises(InputError, match="1 of 3 facets of foot are sides of no cell"):
        read_mesh("plate", msh(tmp_path / "diagonal.msh", "4.1", mesh.geometry.X, entities), dim=2)


def two_bodies(element: Any, folder: Path, along: int, shift: float, merged: bool) -> str:
    """A file of two squares or cubes of two cells along each edge, `along` in the second; it begins at x = shift."""
    solid = element in ("hex8", "tet4")
    points, cells, count = [], [], 0
    for x, n in ((0.0, 2), (shift, along)):
        if solid:
            geometry = box_mesh("block", element, (1, n, n), (1, 1, 1)).geometry
        else:
            geometry = rectangle_mesh("plate", element, (1, n), (1, 1)).geometry
        name, nodes = geometry.for_meshio()
        points.append(np.pad(geometry.X, ((0, 0), (0, 3 - geometry.dim))) + np.array([x, 0, 0]))
        cells.append(nodes + count)
        count += len(geometry.X)
    X, t = np.concatenate(points), np.concatenate(cells)
    if merged:
        X, number = np.unique(np.round(X, 9), axis=0, return_inverse=True)
        t = number.ravel()[t]
    path = folder / "two.vtu"
    meshio.Mesh(X, [(name, t)]).write(path)
    return str(path)


SEAM = "nodes of cells that touch are not joined, pairs at one place: "
HANGING = "nodes that lie in or on cells without being joined to them: "


@pytest.mark.parametrize(
    ("element", "along", "shift", "merged", "says"),
    [
        ("quad4", 2, 1.0, True, ""),
        ("quad4", 2, 1.0, False, SEAM + r"3, 4 and 7 at \(1, 0\), 5 and 8 at"),
        ("quad4", 2, 1.001, False, ""),  # a gap
        ("quad4", 4, 1.0, True, HANGING + r"2, 5 at \(1, 0.25\) in cell 1, 7 at \(1, 0.75\) in cell 2 - refine"),
        ("tri6", 4, 1.0, True, HANGING + "4"),
        ("tri3", 3, 1.0, False, SEAM + "2"),
        ("hex8", 2, 1.0, True, ""),
        ("hex8", 2, 1.0, False, SEAM + "9"),
        ("hex8", 4, 1.0, True, HANGING + "16"),
        ("tet4", 4, 1.0, True, HANGING + "16"),
        ("hex8", 2, 0.9, False, HANGING),  # one in the other
    ],
)
def test_unmerged_seams_and_hanging_nodes_are_refused(
    element: Any, along: int, shift: float, merged: bool, says: str, tmp_path: Path
) -> None:
    path, dim = two_bodies(element, tmp_path, along, shift, merged), 3 if element in ("hex8", "tet4") else 2
    if says:
        with pytest.raises(InputError, match=says):
            read_mesh("body", path, dim=dim)
    else:
        read_mesh("body", path, dim=dim)


def test_faces_are_told_and_those_inside_carry_no_load(tmp_path: Path) -> None:
    mesh, entities = body("quad8")
    middle = in_order(rectangle_mesh("plate", "quad8", (2, 2), (1, 1)), "bottom")
    at = {tuple(x): i for i, x in enumerate(mesh.geometry.X)}
    raised = np.vectorize(lambda i: at[mesh.geometry.X[i][0], 0.5])(middle)
    entities[0] = (1, "line3", raised, (1,))  # across the body
    path = msh(tmp_path / "inside.msh", "4.1", mesh.geometry.X, entities)
    held = Plate(mesh=path, clamped="foot", loaded="painted", thickness=0.1, derivatives="hand")
    assert held.read_as == (
        "held: foot, 0.1 m^2",
        "load: 0.2 Pa on painted, 0.2 m^2, in all (0, 0.04) N",
    )
    with pytest.raises(InputError, match="2 of 2 facets of foot lie inside the body"):
        Plate(mesh=path, clamped="lid", loaded="foot")
    with pytest.raises(InputError, match=r"is of dimension 2 \(line3, quad8\), not 3"):
        Block(mesh=path)
