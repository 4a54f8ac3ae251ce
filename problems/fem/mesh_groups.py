"""Groups that a mesh file names: regions of cells, and faces, which MSH 2.2 repeats once for every group."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from gradient_routes.problems.errors import InputError
from gradient_routes.problems.problem import Array

CORNERS = {"line": 2, "triangle": 3, "quad": 4}  # of facets, by the beginnings of meshio's names


def regions_of(found: Any, dim: int, nodes: Array, what: str) -> tuple[Array, dict[str, Array]]:
    """Nodes (n_e, n_a) of the cells, each once, and the numbers of the cells of every group.

    Raises InputError for a cell that is there twice, but not for two groups.
    """
    blocks = [i for i, block in enumerate(found.cells) if block.dim == dim]
    start = dict(zip(blocks, np.cumsum([0, *(len(found.cells[i].data) for i in blocks)]), strict=False))
    first, number = _first_of(np.sort(nodes, axis=1))
    tags = found.cell_data.get("gmsh:physical") or [np.zeros(len(block.data)) for block in found.cells]
    tagged = np.column_stack([number, np.concatenate([tags[i] for i in blocks])])
    twice = len(nodes) - len(np.unique(tagged, axis=0))
    if twice:
        raise InputError(f"{what} has {twice} cells twice, of the same nodes - remove one of each")
    groups = _members(found, dim).items()
    return nodes[first], {
        name: np.unique(np.concatenate([number[start[i] + rows] for i, rows in parts])) for name, parts in groups
    }


def boundaries_of(found: Any, skfem_mesh: Any, what: str) -> dict[str, Array]:
    """The numbers of the facets of every group. Raises InputError for a group of which only some are sides of cells."""
    boundaries, facets = {}, np.sort(skfem_mesh.facets, axis=0).T
    for name, parts in _members(found, skfem_mesh.dim() - 1).items():
        wanted = np.concatenate([_corners(found.cells[block])[rows] for block, rows in parts])
        _, number = _first_of(np.concatenate([facets, wanted]))
        on = number[len(facets) :]
        if (on < len(facets)).any() and (on >= len(facets)).any():
            raise InputError(
                f"{what}: {(on >= len(facets)).sum()} of {len(on)} facets of {name} are sides of no cell - mesh bodies"
                " and faces together"
            )
        boundaries[name] = np.unique(on[on < len(facets)])
    return boundaries


def _members(found: Any, dim: int) -> dict[str, list[tuple[int, Array]]]:
    """Name by name the groups of cells of a dimension: pairs of a block of cells, and rows of it."""
    groups: dict[str, list[tuple[int, Array]]] = {}
    for name, block, rows in _named(found):
        if found.cells[block].dim == dim and len(rows):
            groups.setdefault(name, []).append((block, rows))
    return groups


def _named(found: Any) -> Iterator[tuple[str, int, Array]]:
    """Sets of cells of any format; groups of MSH 2.2, where there are no such sets, by their numbers."""
    for name, sets in found.cell_sets.items():
        if not name.startswith("gmsh:"):
            yield from (
                (name, block, np.asarray(rows, dtype=int)) for block, rows in enumerate(sets) if rows is not None
            )
    if not found.cell_sets:
        for block, tags in enumerate(found.cell_data.get("gmsh:physical", ())):
            for name, (tag, dim) in found.field_data.items():
                if dim == found.cells[block].dim:
                    yield name, block, np.flatnonzero(tags == tag)


def _corners(block: Any) -> Array:
    """(n, corners), sorted."""
    count = next(count for kind, count in CORNERS.items() if block.type.startswith(kind))
    return np.sort(block.data[:, :count], axis=1)


def _first_of(rows: Array) -> tuple[Array, Array]:
    """Where different rows occur first, in order, and for each row which of them it is."""
    _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return first[order], np.argsort(order)[number.ravel()]
