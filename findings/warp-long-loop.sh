#!/usr/bin/env bash
# Software:  warp-lang 1.19.0 on a CPU, Python 3.11
# Behaviour: the gradient of a loop of 17 trips in which a variable is updated is wrong, without an error; of one of 16 it
#            is right, since that is unrolled (max_unroll = 16). The backward kernel linearizes at the u of the start and
#            repeats the trips forward while the adjoint goes backward. An array with an entry for every trip is right.
# Output:    16 trips: [39.099 28.059], exact [39.099 28.059]
#            17 trips: [9.757 8.332], exact [41.784 29.160]
#            17 trips, array: [41.784 29.160], exact [41.784 29.160]
# Used in:   examples/check/long_loop.py, which computes the same numbers
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
def unrolled(p: wp.array(dtype=float), us: wp.array(dtype=float), J: wp.array(dtype=float)):
    u = float(0.5)
    for i in range(16):
        u = p[0] * u + p[1]
    J[0] = u * u


@wp.kernel
def dynamic(p: wp.array(dtype=float), us: wp.array(dtype=float), J: wp.array(dtype=float)):
    u = float(0.5)
    for i in range(17):
        u = p[0] * u + p[1]
    J[0] = u * u


@wp.kernel
def array(p: wp.array(dtype=float), us: wp.array(dtype=float), J: wp.array(dtype=float)):
    us[0] = 0.5
    for i in range(17):
        us[i + 1] = p[0] * us[i] + p[1]
    J[0] = us[17] * us[17]


def gradient(kernel):
    p = wp.array([0.9, 0.2], dtype=float, requires_grad=True, device="cpu")
    us = wp.zeros(18, dtype=float, requires_grad=True, device="cpu")
    J = wp.zeros(1, dtype=float, requires_grad=True, device="cpu")
    with wp.Tape() as tape:
        wp.launch(kernel, dim=1, inputs=[p, us], outputs=[J], device="cpu")
    tape.backward(loss=J)
    return p.grad.numpy()


def exact(trips):
    """Of J = u^2 by the derivatives of u, carried along."""
    u, du = 0.5, np.zeros(2)
    for _ in range(trips):
        u, du = 0.9 * u + 0.2, 0.9 * du + np.array([u, 1.0])
    return 2.0 * u * du


np.set_printoptions(formatter={"float": "{:.3f}".format})
for name, kernel, trips, right in (
    ("16 trips", unrolled, 16, True),
    ("17 trips", dynamic, 17, False),
    ("17 trips, array", array, 17, True),
):
    print(f"{name}: {gradient(kernel)}, exact {exact(trips)}")
    assert np.allclose(gradient(kernel), exact(trips), rtol=1e-5) == right, "it behaves otherwise now: is the example true?"
PROGRAM
venv/bin/python program.py
