"""The hexahedra of a case in DOLFINx, spread over the ranks of a communicator."""

import basix.ufl
import numpy as np
from dolfinx import fem, mesh

ORDER = [0, 1, 3, 2, 4, 5, 7, 6]  # of VTK's nodes


def displacements(case, comm):
    """V, trilinear, and for each of its nodes on this rank the node of the case."""
    hex8 = basix.ufl.element("Lagrange", "hexahedron", 1, shape=(3,))
    mine = slice(None if comm.rank == 0 else 0)  # the others get theirs from rank 0
    body = mesh.create_mesh(comm, case["cells"][mine, ORDER], hex8, case["points"][mine])
    V = fem.functionspace(body, hex8)
    node = np.empty(V.dofmap.index_map.size_local + V.dofmap.index_map.num_ghosts, np.int32)
    node[V.dofmap.list] = np.array(body.geometry.input_global_indices)[body.geometry.dofmaps[0]]
    return V, node
