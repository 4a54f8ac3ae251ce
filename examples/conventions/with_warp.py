"""What Warp returns where there is no derivative, where arrays are overwritten and where a solve has not ended."""

import json
import sys
from itertools import pairwise

import numpy as np
import warp as wp
from warp.optim.linear import cg
from warp.sparse import bsr_from_triplets

printed, sys.stdout = sys.stdout, sys.stderr  # Warp prints what it compiles
wp.config.quiet = True
wp.set_device("cpu")
real = wp.float64
Reals = wp.array(dtype=real)
Matrices2, Matrices3 = wp.array(dtype=wp.mat22d), wp.array(dtype=wp.mat33d)


@wp.kernel
def scalars(x: Reals, J: Reals):
    zero, one = real(0.0), real(1.0)
    J[0] = wp.max(x[0], x[1])
    J[1] = wp.min(x[2], x[3])
    J[2] = wp.max(x[4], zero)
    J[3] = wp.max(zero, x[5])
    J[4] = wp.where(x[6] > zero, x[6], zero)
    J[5] = wp.where(x[7] >= zero, x[7], zero)
    J[6] = (x[8] + wp.abs(x[8])) / real(2.0)
    J[7] = wp.clamp(x[9], zero, one)
    J[8] = wp.clamp(x[10], zero, one)
    J[9] = wp.max(wp.min(x[11], one), zero)
    J[10] = wp.max(wp.min(x[12], one), zero)
    J[11] = wp.abs(x[13])
    J[12] = wp.sqrt(x[14] * x[14])
    J[13] = wp.sqrt(x[15])
    J[14] = wp.pow(x[16], real(0.5))
    J[15] = wp.pow(x[17], real(1.5))
    J[16] = wp.pow(wp.sqrt(x[18]), real(3.0))
    J[17] = wp.pow(x[19], x[20])
    J[18] = wp.length(wp.vector(x[21], x[22]))
    J[19] = wp.sqrt(x[23] * x[23] + x[24] * x[24])
    J[20] = wp.atan2(x[25], x[26])
    J[21] = wp.where(x[27] > zero, wp.sqrt(x[27]), zero)
    if x[28] > zero:
        J[22] = wp.sqrt(x[28])
    J[23] = wp.max(wp.vector(x[29], x[30], x[31]))
    v = wp.vector(x[32], x[33], x[34])
    J[24] = v[int(wp.argmax(v))]


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
    "x[argmax(x)] of 1, 1, 1": [1, 1, 1],
}


@wp.func
def log_21(A: wp.mat33d):
    V, w = wp.eig3(A)
    return (V * wp.diag(wp.vector(wp.log(w[0]), wp.log(w[1]), wp.log(w[2]))) * wp.transpose(V))[1, 0]


@wp.kernel
def eigen(A: Matrices3, J: Reals):
    _, w = wp.eig3(A[0])
    J[0] = wp.dot(w, w)
    _, w = wp.eig3(A[1])
    J[1] = wp.max(w)
    J[2] = log_21(A[2])
    J[3] = log_21(A[3])
    J[4] = wp.determinant(A[4])


@wp.kernel
def rotations(F: Matrices2, J: Reals):
    W, _, V = wp.svd2(F[wp.tid()])
    J[wp.tid()] = (W * wp.transpose(V))[1, 0]


@wp.kernel
def square(u: Reals, u_new: Reals):
    u_new[0] = u[0] * u[0]


def backward(kernel, x, J, dim=1):
    with wp.Tape() as tape:
        wp.launch(kernel, dim, [x], [J])
    tape.backward(grads={J: wp.ones_like(J)})
    return x.grad.numpy()


def variable(at, dtype=real):
    return wp.array(np.array(at, float), dtype=dtype, requires_grad=True)


def squared(in_place):
    p = variable([1.1])
    us = [variable([0.0]) for _ in range(4)]
    if in_place:
        us = [us[0]] * 4
    with wp.Tape() as tape:
        wp.copy(us[0], p)
        for u, u_new in pairwise(us):
            wp.launch(square, 1, [u], [u_new])
    tape.backward(grads={us[-1]: wp.ones_like(p)})
    return p.grad.numpy().tolist()


def overwritten():
    """The slope of x * x at 1.1, of which the NumPy array becomes 5 in between."""
    memory = np.array([1.1])
    x, J = wp.array(memory, dtype=real, copy=False, requires_grad=True), variable([0.0])
    with wp.Tape() as tape:
        wp.launch(square, 1, [x], [J])
    memory[:] = 5.0
    tape.backward(grads={J: wp.ones_like(J)})
    return x.grad.numpy().item()


def solved():
    """What CG says of a bar of 8 springs after 2 iterations, and u_8."""
    K = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1)
    K[-1, -1] = 1
    i, j = np.nonzero(K)
    K = bsr_from_triplets(8, 8, wp.array(i.astype(np.int32)), wp.array(j.astype(np.int32)), wp.array(K[i, j]))
    u = wp.zeros(8, dtype=real)
    _, residual, wanted = cg(K, wp.ones(8, dtype=real), u, tol=1e-12, maxiter=2)
    return [f"residual {residual:.2g}, wanted {wanted:.2g}", float(u.numpy()[-1])]


g = backward(scalars, variable(np.concatenate([*AT.values()])), variable(np.zeros(len(AT))))
ends = np.cumsum([len(at) for at in AT.values()])[:-1]
found = {name: s.tolist() for name, s in zip(AT, np.split(g, ends), strict=True)}
at = [np.eye(3), [[2, 1, 0], [1, 2, 0], [0, 0, 1]], np.diag([1, 2, 3]), np.eye(3), np.diag([1, 0, 1])]
g = backward(eigen, variable(at, wp.mat33d), variable(np.zeros(5)))
r = backward(rotations, variable([np.diag([1, 2]), np.eye(2)], wp.mat22d), variable(np.zeros(2)), 2)
found |= {
    "sum of squared eigenvalues of [[1, 0], [0, a]], a = 1": g[0, 1, 1].item(),
    "largest eigenvalue of [[2, a], [b, 2]], a = b = 1": [g[1, 0, 1], g[1, 1, 0]],
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 2]]": np.sum(g[2, [0, 1], [1, 0]]),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 1]]": np.sum(g[3, [0, 1], [1, 0]]),
    "R_21 by SVD of F = R U = [[1, 0], [a, 2]]": r[0, 1, 0].item(),
    "R_21 by SVD of F = R U = [[1, 0], [a, 1]]": r[1, 1, 0].item(),
    "det [[1, 0], [0, a]]": g[4, 1, 1].item(),
    "u = u^2, three times, into new memory": squared(in_place=False),
    "u = u^2, three times, in place": squared(in_place=True),
    "`wp.array(x, copy=False)`": overwritten(),
    "`warp.optim.linear.cg`": solved(),
}
print(json.dumps({f"Warp {wp.__version__}": found}), file=printed)
