#!/usr/bin/env bash
# Software:  jax 0.10.2 on a CPU with scipy 1.17.1, Python 3.11
# Behaviour: jax.scipy.sparse.linalg has the signature of SciPy and not its `info`: gmres returns 0, which in SciPy means
#            success, and cg None, whether or not they have converged. The slope through either comes from an adjoint
#            solve that has not converged, too. For a bar of 8 springs and 2 iterations it is exactly 0 here, which
#            an optimizer takes for a minimum, and is the slope of neither the solution nor the iterate.
# Output:    gmres: jax info 0, scipy info 1; u_8 3, exact 36; slope 0, of the iterate -3, exact -36
#            cg: jax info None, scipy info 2; u_8 15, exact 36; slope 0, of the iterate -15, exact -36
# Used in:   docs/explanation/conventions.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check jax==0.10.2 scipy==1.17.1 numpy==2.4.6
cd "$folder"
cat >program.py <<'PROGRAM'
import jax
import jax.scipy.sparse.linalg as of_jax
import numpy as np
import scipy.sparse.linalg as of_scipy

jax.config.update("jax_enable_x64", True)
K, f = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1), np.ones(8)
K[-1, -1] = 1  # clamped at one end, under its weight: u_8 = 36 / p


def end(p, solver, options):
    u, info = getattr(of_jax, solver)(p * K, f, tol=1e-12, **options)
    return u[-1], info


seen = {"gmres": (0, 1, 3, 0, -3), "cg": (None, 2, 15, 0, -15)}
for solver, options in (("gmres", {"restart": 2, "maxiter": 1}), ("cg", {"maxiter": 2})):
    (u_8, info), slope = jax.value_and_grad(end, has_aux=True)(1.0, solver, options)
    iterate = (end(1 + 1e-6, solver, options)[0] - end(1 - 1e-6, solver, options)[0]) / 2e-6
    _, scipy_info = getattr(of_scipy, solver)(K, f, rtol=1e-12, **options)
    found = (info, scipy_info, round(float(u_8), 6), round(float(slope), 6) + 0.0, round(float(iterate), 6))
    says = "{}: jax info {}, scipy info {}; u_8 {:g}, exact 36; slope {:g}, of the iterate {:g}, exact -36"
    print(says.format(solver, *found))
    assert found == seen[solver], "it behaves otherwise now: change the table"
PROGRAM
venv/bin/python program.py
