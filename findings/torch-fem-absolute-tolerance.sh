#!/usr/bin/env bash
# Software:  torch-fem 0.14.0 with torch 2.13.0 on a CPU, Python 3.11
# Behaviour: solve() ends where |R| < atol, 1e-6 by default in whatever unit the forces have, before it looks at rtol.
#            The same cube under the same strain, with moduli and forces in other units, is solved less and less, and
#            not at all where the forces are below 1e-6: u and the gradient are 0, without an error or a warning.
#            With atol=0 all units give the same.
# Output:    moduli of 1e+09: J 0.049725, |dJ/dE| 0.037117
#            moduli of 1e+00: J 0.049725, |dJ/dE| 0.037117
#            moduli of 1e-03: J 0.049716, |dJ/dE| 0.037110
#            moduli of 1e-04: J 0.046606, |dJ/dE| 0.034762
#            moduli of 1e-06: J 0.000000, |dJ/dE| 0.000000
#            moduli of 1e-06, atol=0: J 0.049725, |dJ/dE| 0.037117
# Used in:   adapters/torch-fem.py, which says atol=0
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check torch-fem==0.14.0 torch==2.13.0
cd "$folder"
cat >program.py <<'PROGRAM'
import torch
from torchfem import Solid
from torchfem.materials import Hyperelastic3D
from torchfem.mesh import cube_hexa

torch.set_default_dtype(torch.float64)
nodes, cells = cube_hexa(3, 3, 3)


def neo_hookean(F, q):
    C = F.mT @ F
    ln_J = 0.5 * torch.logdet(C)
    return q[0] / 2 * (torch.trace(C) - 3) - q[0] * ln_J + q[1] / 2 * ln_J**2


def gradient(unit, **options):
    """J = |u|^2 and |dJ/dE|, E in `unit`s, of a cube pulled by a tenth of its modulus."""
    E = torch.ones(len(cells), requires_grad=True)
    q = unit * torch.stack([E / 2.6, E * 0.3 / (1.3 * 0.4)], dim=-1)
    model = Solid(nodes, cells, Hyperelastic3D(neo_hookean, q))
    model.constraints[nodes[:, 2] == 0] = True
    model.forces[nodes[:, 2] == 1, 2] = unit * 0.1 / 16
    u, *_ = model.solve(differentiable_parameters=E, **options)
    J = (u**2).sum()
    J.backward()
    return J.item(), E.grad.norm().item()


found = {unit: gradient(unit) for unit in (1e9, 1.0, 1e-3, 1e-4, 1e-6)}
for unit, (J, slope) in found.items():
    print(f"moduli of {unit:.0e}: J {J:.6f}, |dJ/dE| {slope:.6f}")
right = gradient(1e-6, atol=0.0)
print(f"moduli of 1e-06, atol=0: J {right[0]:.6f}, |dJ/dE| {right[1]:.6f}")
off = {unit: abs(J / right[0] - 1.0) for unit, (J, _) in found.items()}
assert off[1e9] < 1e-6 and off[1.0] < 1e-6 and 1e-5 < off[1e-3] < 1e-2 < off[1e-4], "it behaves otherwise now"
assert found[1e-6] == (0.0, 0.0), "it behaves otherwise now: does the adapter need atol=0?"
PROGRAM
venv/bin/python program.py
