"""What torch-fem says where Newton's method has not converged after one iteration."""

import json
from importlib.metadata import version

import torch
from torchfem import Solid
from torchfem.materials import Hyperelastic3D
from torchfem.mesh import cube_hexa
from torchfem.sparse import ConvergenceError

torch.set_default_dtype(torch.float64)


def neo_hookean(F, q):
    C = F.mT @ F
    ln_J = 0.5 * torch.logdet(C)
    return q[0] / 2 * (torch.trace(C) - 3) - q[0] * ln_J + q[1] / 2 * ln_J**2


nodes, cells = cube_hexa(2, 2, 2)
cube = Solid(nodes, cells, Hyperelastic3D(neo_hookean, torch.tensor([0.4, 0.6]).expand(len(cells), 2)))
cube.constraints[nodes[:, 2] == 0] = True
cube.forces[nodes[:, 2] == 1, 2] = 0.1
try:
    cube.solve(max_iter=1, max_cutbacks=0)
    says = ["nothing"]
except ConvergenceError as error:
    says = [f"raises {type(error).__name__}"]
print(json.dumps({f"torch-fem {version('torch-fem')}": {"`Solid.solve`": says}}))
