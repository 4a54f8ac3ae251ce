#!/usr/bin/env bash
# Software:  taichi 1.7.4 on a CPU, Python 3.11
# Behaviour: at a tie max and min give all of the slope to their second argument, so max(x, 0) and max(0, x) differ at
#            0; the largest of equal entries is the last. clamp has the slope 1 at both bounds.
# Output:    max(x, y) 0 1
#            min(x, y) 0 1
#            max of three 0 0 1
#            max(x, 0) 0
#            max(0, x) 1
#            clamp at 0 1
#            clamp at 1 1
#            abs 0
#            norm nan nan
#            root nan nan
#            sqrt inf
# Used in:   docs/explanation/conventions.md
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check taichi==1.7.4 numpy
cd "$folder"
cat >program.py <<'PROGRAM'
import numpy as np
import taichi as ti
import taichi.math as tm

ti.init(arch=ti.cpu, default_fp=ti.f64, log_level=ti.ERROR)
x = ti.field(ti.f64, shape=17, needs_grad=True)
J = ti.field(ti.f64, shape=(), needs_grad=True)


@ti.kernel
def ties():
    J[None] += ti.max(x[0], x[1])
    J[None] += ti.min(x[2], x[3])
    J[None] += ti.Vector([x[4], x[5], x[6]]).max()
    J[None] += ti.max(x[7], 0.0)
    J[None] += ti.max(0.0, x[8])
    J[None] += tm.clamp(x[9], 0.0, 1.0)
    J[None] += tm.clamp(x[10], 0.0, 1.0)
    J[None] += ti.abs(x[11])
    J[None] += ti.Vector([x[12], x[13]]).norm()
    J[None] += ti.sqrt(x[14] * x[14] + x[15] * x[15])
    J[None] += ti.sqrt(x[16])


nan, inf = np.nan, np.inf
seen = {  # function: (at, slopes)
    "max(x, y)": ([1, 1], [0, 1]),
    "min(x, y)": ([1, 1], [0, 1]),
    "max of three": ([1, 1, 1], [0, 0, 1]),
    "max(x, 0)": ([0], [0]),
    "max(0, x)": ([0], [1]),
    "clamp at 0": ([0], [1]),
    "clamp at 1": ([1], [1]),
    "abs": ([0], [0]),
    "norm": ([0, 0], [nan, nan]),
    "root": ([0, 0], [nan, nan]),
    "sqrt": ([0], [inf]),
}
x.from_numpy(np.concatenate([at for at, _ in seen.values()]).astype(float))
J.grad[None] = 1.0
ties()
ties.grad()
slopes = np.split(x.grad.to_numpy(), np.cumsum([len(at) for at, _ in seen.values()])[:-1])
for (name, (_, expected)), slope in zip(seen.items(), slopes):
    print(name, *(f"{s:g}" for s in slope))
    np.testing.assert_array_equal(slope, expected, "it behaves otherwise now: change the table")
PROGRAM
venv/bin/python program.py | grep -v '^\[Taichi\]'
