#!/usr/bin/env bash
# Software:  warp-lang 1.19.0 on a CPU, Python 3.11
# Behaviour: the gradient through svd3 and svd2 is finite and wrong where singular values are equal, and right beside it:
#            dR_21/dF_21 of the rotation R = W V^T of F = W diag(s) V^T, which is smooth; exact is 1 / (s_1 + s_2).
# Output:    svd3 at 1 2 3: 0.3333, exact 0.3333
#            svd3 at 1 1 3: -0.1250, exact 0.5000
#            svd3 at 1 1 1: 0.0625, exact 0.5000
#            svd2 at 1 2: 0.3333, exact 0.3333
#            svd2 at 1 1: 0.0000, exact 0.5000
# Used in:   examples/check/equal_stretches.py
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check warp-lang==1.19.0 numpy
cd "$folder"
cat >program.py <<'PROGRAM'
import numpy as np
import warp as wp

wp.config.quiet = True


@wp.kernel
def three(F: wp.array(dtype=wp.mat33), R_21: wp.array(dtype=float)):
    W = wp.mat33()
    s = wp.vec3()
    V = wp.mat33()
    wp.svd3(F[0], W, s, V)
    R = W * wp.transpose(V)
    R_21[0] = R[1, 0]


@wp.kernel
def two(F: wp.array(dtype=wp.mat22), R_21: wp.array(dtype=float)):
    W = wp.mat22()
    s = wp.vec2()
    V = wp.mat22()
    wp.svd2(F[0], W, s, V)
    R = W * wp.transpose(V)
    R_21[0] = R[1, 0]


def slope(kernel, matrix, stretches):
    F = wp.array(np.diag(stretches)[None], dtype=matrix, requires_grad=True, device="cpu")
    R_21 = wp.zeros(1, dtype=float, requires_grad=True, device="cpu")
    with wp.Tape() as tape:
        wp.launch(kernel, dim=1, inputs=[F], outputs=[R_21], device="cpu")
    tape.backward(loss=R_21)
    return F.grad.numpy()[0, 1, 0]


for name, kernel, matrix, stretches in (
    ("svd3", three, wp.mat33, (1, 2, 3)),
    ("svd3", three, wp.mat33, (1, 1, 3)),
    ("svd3", three, wp.mat33, (1, 1, 1)),
    ("svd2", two, wp.mat22, (1, 2)),
    ("svd2", two, wp.mat22, (1, 1)),
):
    found, exact = slope(kernel, matrix, stretches), 1 / (stretches[0] + stretches[1])
    print(name, "at", *stretches, end=f": {found:.4f}, exact {exact:.4f}\n")
    distinct = stretches[0] != stretches[1]
    assert np.isfinite(found), "it behaves otherwise now: is the example true?"
    assert np.isclose(found, exact, rtol=1e-3) == distinct, "it behaves otherwise now: is the example true?"
PROGRAM
venv/bin/python program.py
