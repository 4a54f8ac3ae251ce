#!/usr/bin/env bash
# Software:  warp-lang 1.19.0 on a CPU, Python 3.11
# Behaviour: at a tie max and min give all of the slope to their second argument, so max(x, 0) and max(0, x) differ at
#            0. clamp has the slope 1 at its lower bound and 0 at its upper one.
# Output:    max(x, y) 0 1
#            min(x, y) 0 1
#            max of three 1 0 0
#            max(x, 0) 0
#            max(0, x) 1
#            clamp at 0 1
#            clamp at 1 0
#            abs 1
#            length 0 0
#            root nan nan
#            sqrt inf
# Used in:   docs/explanation/conventions.md
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
def ties(x: wp.array(dtype=float), J: wp.array(dtype=float)):
    J[0] = wp.max(x[0], x[1])
    J[1] = wp.min(x[2], x[3])
    J[2] = wp.max(wp.vec3(x[4], x[5], x[6]))
    J[3] = wp.max(x[7], 0.0)
    J[4] = wp.max(0.0, x[8])
    J[5] = wp.clamp(x[9], 0.0, 1.0)
    J[6] = wp.clamp(x[10], 0.0, 1.0)
    J[7] = wp.abs(x[11])
    J[8] = wp.length(wp.vec2(x[12], x[13]))
    J[9] = wp.sqrt(x[14] * x[14] + x[15] * x[15])
    J[10] = wp.sqrt(x[16])


nan, inf = np.nan, np.inf
seen = {  # function: (at, slopes)
    "max(x, y)": ([1, 1], [0, 1]),
    "min(x, y)": ([1, 1], [0, 1]),
    "max of three": ([1, 1, 1], [1, 0, 0]),
    "max(x, 0)": ([0], [0]),
    "max(0, x)": ([0], [1]),
    "clamp at 0": ([0], [1]),
    "clamp at 1": ([1], [0]),
    "abs": ([0], [1]),
    "length": ([0, 0], [0, 0]),
    "root": ([0, 0], [nan, nan]),
    "sqrt": ([0], [inf]),
}
x = wp.array(np.concatenate([at for at, _ in seen.values()]), dtype=float, requires_grad=True, device="cpu")
J = wp.zeros(len(seen), dtype=float, requires_grad=True, device="cpu")
with wp.Tape() as tape:
    wp.launch(ties, dim=1, inputs=[x], outputs=[J], device="cpu")
tape.backward(grads={J: wp.full(len(seen), 1.0, dtype=float, device="cpu")})
slopes = np.split(x.grad.numpy(), np.cumsum([len(at) for at, _ in seen.values()])[:-1])
for (name, (_, expected)), slope in zip(seen.items(), slopes):
    print(name, *(f"{s:g}" for s in slope))
    np.testing.assert_array_equal(slope, expected, "it behaves otherwise now: change the table")
PROGRAM
venv/bin/python program.py
