#!/usr/bin/env bash
# Software:  Ipopt 3.12.12 in ipyopt 0.12.10 with numpy 2.4.6, Python 3.11
# Behaviour: `derivative_test=first-order` compares quotients with the gradient, and a comparison with NaN holds. Where
#            the objective is NaN beside the start, as beside a state that does not converge, a gradient of seven times
#            the right size and the wrong sign has no errors. With a finite objective both its components have.
# Output:    finite objective: Derivative checker detected 2 error(s).
#            NaN beside the start: No errors detected by derivative checker.
# Used in:   docs/how-to/umbridge-and-tesseract.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check ipyopt==0.12.10 numpy==2.4.6
cd "$folder"
cat >program.py <<'PROGRAM'
import sys

import ipyopt
import numpy as np

START = np.array([2.0, 2.0])
BESIDE = {"finite": None, "nan": float("nan")}[sys.argv[1]]


def objective(x):
    return 0.5 * float((x - 1.0) @ (x - 1.0)) if BESIDE is None or (x == START).all() else BESIDE


def gradient(x, out):
    out[()] = -7.0 * (x - 1.0)
    return out


def nothing(x, out):
    return out


none = np.zeros(0, int), np.zeros(0, int)
ipyopt.Problem(
    n=2, x_l=np.full(2, -10.0), x_u=np.full(2, 10.0), m=0, g_l=np.zeros(0), g_u=np.zeros(0),
    sparsity_indices_jac_g=none, sparsity_indices_h=none,
    eval_f=objective, eval_grad_f=gradient, eval_g=nothing, eval_jac_g=nothing,
    ipopt_options={"derivative_test": "first-order", "hessian_approximation": "limited-memory", "max_iter": 0},
).solve(x0=START.copy())
PROGRAM
said() {
  venv/bin/python program.py "$1" | grep -i 'derivative checker\.\|derivative checker detected'
}
finite=$(said finite)
nan=$(said nan)
printf '%s\n' "finite objective: $finite" "NaN beside the start: $nan"
[[ $finite == "Derivative checker detected 2 error(s)." ]]
[[ $nan == "No errors detected by derivative checker." ]]
