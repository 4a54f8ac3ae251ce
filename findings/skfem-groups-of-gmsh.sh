#!/usr/bin/env bash
# Software:  scikit-fem 12.0.2, meshio 5.3.5, Python 3.11
# Behaviour: from_meshio numbers the vertices of second-order meshes anew, but looks facets up by the numbers of the file:
#            named lines and faces are lost or a part of them is (MSH 4.1: an IndexError for tetrahedra). Of a facet that
#            MSH 2.2 repeats for two groups, only the last group keeps it.
# Output:    triangles of first order, a side in two groups: lid 0 facets, painted 1
#            triangles of second order: lid 0 facets
# Used in:   problems/fem/mesh_groups.py, which reads the groups
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check scikit-fem==12.0.2 meshio==5.3.5
cd "$folder"
cat >program.py <<'PROGRAM'
import meshio
import numpy as np
from skfem.io.meshio import from_meshio

# points of the second order come first: (0.5, 1) between (0, 1) and (1, 1) is number 0
X = np.array([[0.5, 1], [0, 0.5], [0.5, 0.5], [0, 0], [1, 1], [0, 1]], dtype=float)
X = np.pad(X, ((0, 0), (0, 1)))
names = {"lid": np.array([2, 1]), "painted": np.array([3, 1]), "body": np.array([1, 2])}


def facets(kinds, tags):
    mesh = meshio.Mesh(X, kinds, field_data=names, cell_data={"gmsh:physical": [np.array(t) for t in tags]})
    found = from_meshio(mesh).boundaries or {}
    return {name: len(found.get(name, ())) for name in ("lid", "painted")}


first = facets([("line", [[4, 5], [4, 5]]), ("triangle", [[3, 4, 5]])], [[2, 3], [1]])
print(f"triangles of first order, a side in two groups: lid {first['lid']} facets, painted {first['painted']}")
second = facets([("line3", [[4, 5, 0]]), ("triangle6", [[3, 4, 5, 2, 0, 1]])], [[2], [1]])
print(f"triangles of second order: lid {second['lid']} facets")
assert first == {"lid": 0, "painted": 1}, "repeated facets are read now"
assert second["lid"] == 0, "groups of second-order meshes are read now"
PROGRAM
"$folder/venv/bin/python" program.py
