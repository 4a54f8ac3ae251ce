#!/usr/bin/env bash
# Software:  scikit-fem 12.0.2, Python 3.11
# Behaviour: MeshTri2, MeshTet2 and MeshQuad2.from_mesh raise the order of a mesh and keep its points and cells, but not
#            its named boundaries, and say nothing. `refined()` keeps them (triangles, quadrilaterals), or warns that it
#            does not (tetrahedra).
# Output:    MeshTri: boundaries left; of second order: None
#            MeshQuad: boundaries left; of second order: None
#            MeshTet: boundaries left; of second order: None
# Used in:   problems/fem/mesh.py, which keeps the mesh of first order for boundaries
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check scikit-fem==12.0.2
cd "$folder"
cat >program.py <<'PROGRAM'
import skfem


def names(mesh):
    return None if mesh.boundaries is None else ", ".join(sorted(mesh.boundaries))


for first, second in (("MeshTri", "MeshTri2"), ("MeshQuad", "MeshQuad2"), ("MeshTet", "MeshTet2")):
    mesh = getattr(skfem, first)().with_boundaries({"left": lambda x: x[0] == 0.0})
    raised = getattr(skfem, second).from_mesh(mesh)
    print(f"{first}: boundaries {names(mesh)}; of second order: {names(raised)}")
    assert names(mesh) == "left"
    assert names(raised) is None, "boundaries are kept now: may they be used?"
PROGRAM
venv/bin/python program.py
