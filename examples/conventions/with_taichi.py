"""What Taichi returns where there is no derivative, where fields are overwritten and where a solve has not ended."""

import json
import sys
from itertools import pairwise

printed, sys.stdout = sys.stdout, sys.stderr  # Taichi prints its version

import numpy as np
import taichi as ti
import taichi.math as tm
from taichi.linalg import LinearOperator, MatrixFreeCG

ti.init(arch=ti.cpu, default_fp=ti.f64, log_level=ti.ERROR)
x = ti.field(ti.f64, shape=32, needs_grad=True)
A = ti.Matrix.field(2, 2, ti.f64, shape=(), needs_grad=True)
J = ti.field(ti.f64, shape=(), needs_grad=True)
us = [ti.field(ti.f64, shape=(), needs_grad=True) for _ in range(5)]
f, u = ti.field(ti.f64, shape=8), ti.field(ti.f64, shape=8)


@ti.kernel
def scalars():
    J[None] += ti.max(x[0], x[1])
    J[None] += ti.min(x[2], x[3])
    J[None] += ti.max(x[4], 0.0)
    J[None] += ti.max(0.0, x[5])
    J[None] += ti.select(x[6] > 0, x[6], 0.0)
    J[None] += ti.select(x[7] >= 0, x[7], 0.0)
    J[None] += (x[8] + ti.abs(x[8])) / 2
    J[None] += tm.clamp(x[9], 0.0, 1.0)
    J[None] += tm.clamp(x[10], 0.0, 1.0)
    J[None] += ti.max(ti.min(x[11], 1.0), 0.0)
    J[None] += ti.max(ti.min(x[12], 1.0), 0.0)
    J[None] += ti.abs(x[13])
    J[None] += ti.sqrt(x[14] ** 2)
    J[None] += ti.sqrt(x[15])
    J[None] += x[16] ** 0.5
    J[None] += x[17] ** 1.5
    J[None] += ti.sqrt(x[18]) ** 3
    J[None] += x[19] ** x[20]
    J[None] += tm.vec2(x[21], x[22]).norm()
    J[None] += ti.sqrt(x[23] ** 2 + x[24] ** 2)
    J[None] += ti.atan2(x[25], x[26])
    J[None] += ti.select(x[27] > 0, ti.sqrt(x[27]), 0.0)
    if x[28] > 0:
        J[None] += ti.sqrt(x[28])
    J[None] += tm.vec3(x[29], x[30], x[31]).max()


AT = {
    "max(x, y) at 1, 1": [1, 1],
    "min(x, y) at 1, 1": [1, 1],
    "max(x, 0)": [0],
    "max(0, x)": [0],
    "x where x > 0, else 0": [0],
    "x where x >= 0, else 0": [0],
    "(x + |x|) / 2": [0],
    "clamp(x, 0, 1) at 0": [0],
    "clamp(x, 0, 1) at 1": [1],
    "max(min(x, 1), 0) at 0": [0],
    "max(min(x, 1), 0) at 1": [1],
    "|x|": [0],
    "sqrt(x^2)": [0],
    "sqrt(x)": [0],
    "x^0.5": [0],
    "x^1.5": [0],
    "sqrt(x)^3": [0],
    "x^n by x and n at 0, 2": [0, 2],
    "norm of (x, y)": [0, 0],
    "sqrt(x^2 + y^2)": [0, 0],
    "atan2(y, x)": [0, 0],
    "sqrt(x) where x > 0, else 0": [0],
    "sqrt(x) if x > 0, else 0": [0],
    "largest of 1, 1, 1": [1, 1, 1],
}


@ti.kernel
def squares():
    w, _ = ti.sym_eig(A[None])
    J[None] += w.dot(w)


@ti.kernel
def largest():
    w, _ = ti.sym_eig(A[None])
    J[None] += w.max()


@ti.kernel
def logarithm():
    w, V = ti.sym_eig(A[None])
    J[None] += (V @ tm.mat2(ti.log(w[0]), 0, 0, ti.log(w[1])) @ V.transpose())[1, 0]


@ti.kernel
def rotation():
    W, _, V = ti.svd(A[None])
    J[None] += (W @ V.transpose())[1, 0]


@ti.kernel
def determinant():
    J[None] += A[None].determinant()


@ti.kernel
def square(u: ti.template(), u_new: ti.template()):
    u_new[None] = u[None] ** 2


@ti.kernel
def copy(u: ti.template(), u_new: ti.template()):
    u_new[None] = u[None]


@ti.kernel
def add(u: ti.template()):
    J[None] += u[None]


@ti.kernel
def K_times(u: ti.template(), f: ti.template()):
    for i in u:
        f[i] = (2.0 if i < 7 else 1.0) * u[i] - (u[i - 1] if i > 0 else 0.0) - (u[i + 1] if i < 7 else 0.0)


def slope(kernel, at):
    A.from_numpy(np.array(at, float))
    A.grad.fill(0)
    J.grad[None] = 1
    kernel.grad()
    return A.grad.to_numpy()


def squared(in_place):
    p, *states = us
    if in_place:
        states = [states[0]] * 4
    p[None], J[None] = 1.1, 0
    with ti.ad.Tape(J):
        copy(p, states[0])
        for u, u_new in pairwise(states):
            square(u, u_new)
        add(states[-1])
    return [p.grad[None]]


def solved():
    """What CG says of a bar of 8 springs after 2 iterations, and u_8."""
    f.fill(1)
    says = MatrixFreeCG(LinearOperator(K_times), f, u, tol=1e-12, maxiter=2)
    return [str(says), float(u[7])]


I, beside = np.eye(2), np.diag([1, 2])
x.from_numpy(np.concatenate([*AT.values()]).astype(float))
J.grad[None] = 1
scalars.grad()
ends = np.cumsum([len(at) for at in AT.values()])[:-1]
found = {name: s.tolist() for name, s in zip(AT, np.split(x.grad.to_numpy(), ends), strict=True)}
found |= {
    "sum of squared eigenvalues of [[1, 0], [0, a]], a = 1": slope(squares, I)[1, 1],
    "largest eigenvalue of [[2, a], [b, 2]], a = b = 1": slope(largest, [[2, 1], [1, 2]])[[0, 1], [1, 0]].tolist(),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 2]]": slope(logarithm, beside)[[0, 1], [1, 0]].sum(),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 1]]": slope(logarithm, I)[[0, 1], [1, 0]].sum(),
    "R_21 by SVD of F = R U = [[1, 0], [a, 2]]": slope(rotation, beside)[1, 0],
    "R_21 by SVD of F = R U = [[1, 0], [a, 1]]": slope(rotation, I)[1, 0],
    "det [[1, 0], [0, a]]": slope(determinant, [[1, 0], [0, 0]])[1, 1],
    "u = u^2, three times, into new memory": squared(in_place=False),
    "u = u^2, three times, in place": squared(in_place=True),
    "`taichi.linalg.MatrixFreeCG`": solved(),
}
print(json.dumps({f"Taichi {'.'.join(map(str, ti.__version__))}": found}), file=printed)
