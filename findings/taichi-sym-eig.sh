#!/usr/bin/env bash
# Software:  taichi 1.7.4 on a CPU, Python 3.11
# Behaviour: ti.sym_eig gives an eigenvector of NaN for every diagonal 2 x 2 matrix with different entries, as the strain
#            of a uniaxial test is. For many 3 x 3 matrices of plane strain, A_13 = A_23 = 0, it gives vectors that are
#            finite, not orthogonal and no eigenvectors, without an error. Eigenvalues are right, and so are the
#            eigenvectors of full matrices. The slope of the sum of the squared eigenvalues of a 2 x 2 matrix, which is
#            2 A, is NaN at the identity. (taichi-dev/taichi#5434, #8468)
# Output:    diag(1, 2): w 2 1, |A v - w v| nan 0
#            diag(2, 1): w 2 1, |A v - w v| 0 nan
#            full 2 x 2: w 3 1, |A v - w v| 0 0
#            diag(1, 2, 3): w 1 2 3, |A v - w v| 2 0 0
#            plane strain: w 1 3 5, |A v - w v| 2.83 1.41 0
#            full 3 x 3: w 0.88168 1.38676 3.73156, |A v - w v| 0 0 0
#            slope of w_1^2 + w_2^2 at the identity: nan, exact 2
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

ti.init(arch=ti.cpu, default_fp=ti.f64, log_level=ti.ERROR)


def fields(n):
    A = ti.Matrix.field(n, n, ti.f64, shape=(), needs_grad=True)
    return A, ti.Matrix.field(n, n, ti.f64, shape=()), ti.Vector.field(n, ti.f64, shape=())


A2, V2, w2 = fields(2)
A3, V3, w3 = fields(3)
J = ti.field(ti.f64, shape=(), needs_grad=True)


@ti.kernel
def eigen(A: ti.template(), V: ti.template(), w: ti.template()):
    w[None], V[None] = ti.sym_eig(A[None])


@ti.kernel
def squares():
    w, _ = ti.sym_eig(A2[None])
    J[None] += w.dot(w)


def misfit(name, matrix, A, V, w):
    A.from_numpy(np.array(matrix, float))
    eigen(A, V, w)
    values, vectors = w.to_numpy(), V.to_numpy()
    off = np.linalg.norm(matrix @ vectors - values * vectors, axis=0).round(9) + 0.0
    print(f"{name}: w {' '.join(f'{v:g}' for v in values)}, |A v - w v| {' '.join(f'{v:.3g}' for v in off)}")
    assert np.allclose(np.sort(values), np.linalg.eigvalsh(matrix)), "it behaves otherwise now: change the table"
    return off


nan = np.nan
for name, matrix, given, expected in (
    ("diag(1, 2)", np.diag([1, 2]), (A2, V2, w2), [nan, 0]),
    ("diag(2, 1)", np.diag([2, 1]), (A2, V2, w2), [0, nan]),
    ("full 2 x 2", np.array([[2, 1], [1, 2]]), (A2, V2, w2), [0, 0]),
    ("diag(1, 2, 3)", np.diag([1, 2, 3]), (A3, V3, w3), [2, 0, 0]),
    ("plane strain", np.array([[2, 1, 0], [1, 2, 0], [0, 0, 5]]), (A3, V3, w3), [8**0.5, 2**0.5, 0]),
    ("full 3 x 3", np.array([[3, 1, 0.5], [1, 2, 0.25], [0.5, 0.25, 1]]), (A3, V3, w3), [0, 0, 0]),
):
    found = misfit(name, matrix, *given)
    np.testing.assert_allclose(found, expected, atol=1e-8, err_msg="it behaves otherwise now: change the table")
A2.from_numpy(np.eye(2))
J.grad[None] = 1.0
squares.grad()
slope = A2.grad.to_numpy()[0, 0]
print(f"slope of w_1^2 + w_2^2 at the identity: {slope:g}, exact 2")
assert np.isnan(slope), "it behaves otherwise now: change the table"
PROGRAM
venv/bin/python program.py | grep -v '^\[Taichi\]'
