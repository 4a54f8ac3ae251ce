#!/usr/bin/env bash
# Software:  torch 2.13.0 on a CPU, Python 3.11
# Behaviour: the gradient of torch.linalg.det at a singular matrix is 0. The derivative is the cofactor matrix, which is
#            not 0 at rank n - 1. Beside the singular matrix the gradient is right.
# Output:    diag(1, 2, 0): 0, exact 2
#            diag(1, 2, 1e-12): 2, exact 2
# Used in:   examples/check/flat_element.py
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check torch==2.13.0 numpy
cd "$folder"
cat >program.py <<'PROGRAM'
import torch

for last, expected in ((0.0, 0.0), (1e-12, 2.0)):
    F = torch.diag(torch.tensor([1.0, 2.0, last], dtype=torch.float64)).requires_grad_()
    torch.linalg.det(F).backward()
    found = F.grad[2, 2].item()
    print(f"diag(1, 2, {last:g}): {found:g}, exact 2")
    assert abs(found - expected) < 1e-9, "it behaves otherwise now: is the example true?"
PROGRAM
venv/bin/python program.py
