"""What PyTorch returns where there is no derivative, and where memory is overwritten before the backward sweep."""

import json

import numpy as np
import torch
from torch.nn import functional

torch.set_default_dtype(torch.float64)
zero = torch.tensor(0.0)


def matrix(*entries):
    return torch.stack([torch.as_tensor(entry, dtype=torch.float64) for entry in entries]).reshape(2, 2)


def log(A):
    w, V = torch.linalg.eigh(A)
    return (V * torch.log(w)) @ V.T


def rotation(F):
    W, _, V_t = torch.linalg.svd(F)
    return W @ V_t


def lower_eigenvalue(a):
    return torch.linalg.eigvalsh(matrix(2, 0, a, 2))[1]


def lower_solve(a):
    return torch.cholesky_solve(torch.ones(2, 1), torch.linalg.cholesky(matrix(2, 0, a, 2)))[0]


def squared(p):
    u = p
    for _ in range(3):
        u = u**2
    return u


def assigned(p):
    u = p + 0
    for _ in range(3):
        u[:] = u**2
    return u


def assigned_data(p):
    u = p + 0
    for _ in range(3):
        u.data[:] = u**2
    return u


SLOPES = {
    "max(x, y) at 1, 1": (torch.maximum, 1, 1),
    "min(x, y) at 1, 1": (torch.minimum, 1, 1),
    "max(x, 0)": (lambda x: torch.maximum(x, zero), 0),
    "max(0, x)": (lambda x: torch.maximum(zero, x), 0),
    "relu(x)": (torch.relu, 0),
    "x where x > 0, else 0": (lambda x: torch.where(x > 0, x, 0), 0),
    "x where x >= 0, else 0": (lambda x: torch.where(x >= 0, x, 0), 0),
    "(x + |x|) / 2": (lambda x: (x + torch.abs(x)) / 2, 0),
    "clamp(x, 0, 1) at 0": (lambda x: torch.clamp(x, 0, 1), 0),
    "clamp(x, 0, 1) at 1": (lambda x: torch.clamp(x, 0, 1), 1),
    "max(min(x, 1), 0) at 0": (lambda x: torch.maximum(torch.minimum(x, zero + 1), zero), 0),
    "max(min(x, 1), 0) at 1": (lambda x: torch.maximum(torch.minimum(x, zero + 1), zero), 1),
    "|x|": (torch.abs, 0),
    "sqrt(x^2)": (lambda x: torch.sqrt(x**2), 0),
    "sqrt(x)": (torch.sqrt, 0),
    "x^0.5": (lambda x: x**0.5, 0),
    "x^1.5": (lambda x: x**1.5, 0),
    "sqrt(x)^3": (lambda x: torch.sqrt(x) ** 3, 0),
    "x^n by x and n at 0, 2": (torch.pow, 0, 2),
    "norm of (x, y)": (lambda x, y: torch.linalg.vector_norm(torch.stack([x, y])), 0, 0),
    "sqrt(x^2 + y^2)": (lambda x, y: torch.sqrt(x**2 + y**2), 0, 0),
    "hypot(x, y)": (torch.hypot, 0, 0),
    "atan2(y, x)": (torch.atan2, 0, 0),
    "sqrt(x) where x > 0, else 0": (lambda x: torch.where(x > 0, torch.sqrt(x), 0), 0),
    "sqrt(x) if x > 0, else 0": (lambda x: torch.sqrt(x) if x > 0 else 0 * x, 0),
    "largest of 1, 1, 1": (torch.amax, [1, 1, 1]),
    "x[argmax(x)] of 1, 1, 1": (lambda x: x[torch.argmax(x)], [1, 1, 1]),
    "last of 1, 1, 1 sorted": (lambda x: torch.sort(x).values[-1], [1, 1, 1]),
    "median of 1, 1, 1": (torch.median, [1, 1, 1]),
    "`clamp(x, min=0)`": (lambda x: torch.clamp(x, min=0), 0),
    "`fmax(x, 0)`": (lambda x: torch.fmax(x, zero), 0),
    "`max(x, 0)` of Python": (lambda x: max(x, 0), 0),
    "`nn.functional.hardtanh(x, 0., 1.)` at 0": (lambda x: functional.hardtanh(x, 0.0, 1.0), 0),
    "`nn.functional.hardtanh(x, 0., 1.)` at 1": (lambda x: functional.hardtanh(x, 0.0, 1.0), 1),
    "`nn.functional.elu(x)`": (functional.elu, 0),
    "`x.max(dim=0)` of 1, 1, 1": (lambda x: x.max(dim=0).values, [1, 1, 1]),
    "`x.median(dim=0)` of 1, 1, 1": (lambda x: x.median(dim=0).values, [1, 1, 1]),
    "`linalg.norm(v, 1)`, v = 0, 0": (lambda v: torch.linalg.norm(v, 1), [0, 0]),
    "sum of squared eigenvalues of [[1, 0], [0, a]], a = 1": (
        lambda a: torch.sum(torch.linalg.eigvalsh(matrix(1, 0, 0, a)) ** 2),
        1,
    ),
    "largest eigenvalue of [[1, 0], [0, a]], a = 1": (lambda a: torch.linalg.eigvalsh(matrix(1, 0, 0, a))[1], 1),
    "largest eigenvalue of [[2, a], [b, 2]], a = b = 1": (
        lambda a, b: torch.linalg.eigvalsh(matrix(2, a, b, 2))[1],
        1,
        1,
    ),
    "largest eigenvalue, lower half of [[2, 0], [a, 2]], a = 1": (lower_eigenvalue, 1),
    "u_1, lower half of [[2, 0], [a, 2]] u = (1, 1), a = 1": (lower_solve, 1),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 2]]": (lambda a: log(matrix(1, a, a, 2))[1, 0], 0),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 1]]": (lambda a: log(matrix(1, a, a, 1))[1, 0], 0),
    "R_21 by SVD of F = R U = [[1, 0], [a, 2]]": (lambda a: rotation(matrix(1, 0, a, 2))[1, 0], 0),
    "R_21 by SVD of F = R U = [[1, 0], [a, 1]]": (lambda a: rotation(matrix(1, 0, a, 1))[1, 0], 0),
    "det [[1, 0], [0, a]]": (lambda a: torch.linalg.det(matrix(1, 0, 0, a)), 0),
}


def slopes(f, *at):
    at = [torch.as_tensor(x, dtype=torch.float64).clone().requires_grad_() for x in at]
    try:
        found = torch.autograd.grad(f(*at).sum(), at)
    except RuntimeError as error:
        return type(error).__name__
    return np.hstack([g.numpy() for g in found]).tolist()


def overwritten(become):
    """The slope of x * x at 1.1, where x becomes 5 in between."""
    memory = np.array([1.1])
    x = torch.from_numpy(memory).requires_grad_()
    J = torch.sum(x * x)
    become(x, memory)
    try:
        J.backward()
    except RuntimeError as error:
        return type(error).__name__
    return x.grad.item()


def of_numpy(x, memory):
    memory[:] = 5.0


def of_data(x, memory):
    x.data[:] = 5.0


def of_tensor(x, memory):
    with torch.no_grad():
        x[:] = 5.0


def singular():
    try:
        return ["nothing", torch.linalg.solve(torch.zeros(1, 1), torch.ones(1)).item()]
    except RuntimeError as error:
        return [f"raises {type(error).__name__}"]


found = {name: slopes(*case) for name, case in SLOPES.items()}
found |= {
    "u = u^2, three times, into new memory": slopes(squared, [1.1]),
    "u = u^2, three times, in place": slopes(assigned, [1.1]),
    "`torch.from_numpy(x)`": overwritten(of_numpy),
    "u = u^2, three times, in u.data": slopes(assigned_data, [1.1]),
    "`x.data[:] = 5`": overwritten(of_data),
    "`x[:] = 5` under `torch.no_grad()`": overwritten(of_tensor),
    "`torch.linalg.solve`, K singular": singular(),
}
print(json.dumps({f"PyTorch {torch.__version__.partition('+')[0]}": found}))
