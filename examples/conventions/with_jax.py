"""What JAX returns where there is no derivative, where memory is overwritten and where a solve has not ended."""

import json

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.scipy.linalg import solve, sqrtm
from jax.scipy.sparse.linalg import cg, gmres

jax.config.update("jax_enable_x64", True)


def log(A):
    w, V = jnp.linalg.eigh(A)
    return (V * jnp.log(w)) @ V.T


def rotation(F):
    W, _, V_t = jnp.linalg.svd(F)
    return W @ V_t


def lower_eigenvalue(a):
    return jnp.linalg.eigh(jnp.array([[2, 0], [a, 2]]), UPLO="L", symmetrize_input=False)[0][1]


def lower_solve(a):
    return solve(jnp.array([[2, 0], [a, 2]]), jnp.ones(2), lower=True, assume_a="pos")[0]


def squared(p):
    u = p
    for _ in range(3):
        u = u.at[0].set(u[0] ** 2)
    return u[0]


def assigned(p):
    u = p + 0.0
    u[0] = u[0] ** 2
    return u[0]


SLOPES = {
    "max(x, y) at 1, 1": (jnp.maximum, 1, 1),
    "min(x, y) at 1, 1": (jnp.minimum, 1, 1),
    "max(x, 0)": (lambda x: jnp.maximum(x, 0), 0),
    "max(0, x)": (lambda x: jnp.maximum(0, x), 0),
    "relu(x)": (jax.nn.relu, 0),
    "x where x > 0, else 0": (lambda x: jnp.where(x > 0, x, 0), 0),
    "x where x >= 0, else 0": (lambda x: jnp.where(x >= 0, x, 0), 0),
    "(x + |x|) / 2": (lambda x: (x + jnp.abs(x)) / 2, 0),
    "clamp(x, 0, 1) at 0": (lambda x: jnp.clip(x, 0, 1), 0),
    "clamp(x, 0, 1) at 1": (lambda x: jnp.clip(x, 0, 1), 1),
    "max(min(x, 1), 0) at 0": (lambda x: jnp.maximum(jnp.minimum(x, 1), 0), 0),
    "max(min(x, 1), 0) at 1": (lambda x: jnp.maximum(jnp.minimum(x, 1), 0), 1),
    "|x|": (jnp.abs, 0),
    "sqrt(x^2)": (lambda x: jnp.sqrt(x**2), 0),
    "sqrt(x)": (jnp.sqrt, 0),
    "x^0.5": (lambda x: x**0.5, 0),
    "x^1.5": (lambda x: x**1.5, 0),
    "sqrt(x)^3": (lambda x: jnp.sqrt(x) ** 3, 0),
    "x^n by x and n at 0, 2": (jnp.power, 0, 2),
    "norm of (x, y)": (lambda x, y: jnp.linalg.norm(jnp.stack([x, y])), 0, 0),
    "sqrt(x^2 + y^2)": (lambda x, y: jnp.sqrt(x**2 + y**2), 0, 0),
    "hypot(x, y)": (jnp.hypot, 0, 0),
    "atan2(y, x)": (jnp.arctan2, 0, 0),
    "sqrt(x) where x > 0, else 0": (lambda x: jnp.where(x > 0, jnp.sqrt(x), 0), 0),
    "sqrt(x) if x > 0, else 0": (lambda x: lax.cond(x > 0, jnp.sqrt, jnp.zeros_like, x), 0),
    "largest of 1, 1, 1": (jnp.max, np.ones(3)),
    "x[argmax(x)] of 1, 1, 1": (lambda x: x[jnp.argmax(x)], np.ones(3)),
    "last of 1, 1, 1 sorted": (lambda x: jnp.sort(x)[-1], np.ones(3)),
    "median of 1, 1, 1": (jnp.median, np.ones(3)),
    "`lax.clamp(0., x, 1.)` at 0": (lambda x: lax.clamp(0.0, x, 1.0), 0),
    "`lax.clamp(0., x, 1.)` at 1": (lambda x: lax.clamp(0.0, x, 1.0), 1),
    "`nn.relu6(x)` at 6": (jax.nn.relu6, 6),
    "`nn.leaky_relu(x, 0.)`": (lambda x: jax.nn.leaky_relu(x, 0.0), 0),
    "`linalg.norm(v, 1)`, v = 0, 0": (lambda v: jnp.linalg.norm(v, 1), np.zeros(2)),
    "sum of squared eigenvalues of [[1, 0], [0, a]], a = 1": (
        lambda a: jnp.sum(jnp.linalg.eigvalsh(jnp.array([[1, 0], [0, a]])) ** 2),
        1,
    ),
    "largest eigenvalue of [[1, 0], [0, a]], a = 1": (lambda a: jnp.linalg.eigvalsh(jnp.array([[1, 0], [0, a]]))[1], 1),
    "largest eigenvalue of [[2, a], [b, 2]], a = b = 1": (
        lambda a, b: jnp.linalg.eigvalsh(jnp.array([[2, a], [b, 2]]))[1],
        1,
        1,
    ),
    "largest eigenvalue, lower half of [[2, 0], [a, 2]], a = 1": (lower_eigenvalue, 1),
    "u_1, lower half of [[2, 0], [a, 2]] u = (1, 1), a = 1": (lower_solve, 1),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 2]]": (lambda a: log(jnp.array([[1, a], [a, 2]]))[1, 0], 0),
    "(log A)_21 by eigenvectors, A = [[1, a], [a, 1]]": (lambda a: log(jnp.array([[1, a], [a, 1]]))[1, 0], 0),
    "R_21 by SVD of F = R U = [[1, 0], [a, 2]]": (lambda a: rotation(jnp.array([[1, 0], [a, 2]]))[1, 0], 0),
    "R_21 by SVD of F = R U = [[1, 0], [a, 1]]": (lambda a: rotation(jnp.array([[1, 0], [a, 1]]))[1, 0], 0),
    "sqrtm(A)_21, A = [[1, a], [a, 1]]": (lambda a: sqrtm(jnp.array([[1, a], [a, 1]]))[1, 0].real, 0),
    "det [[1, 0], [0, a]]": (lambda a: jnp.linalg.det(jnp.array([[1, 0], [0, a]])), 0),
}
K, f = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1), np.ones(8)
K[-1, -1] = 1  # a bar of 8 springs, u_8 = 36


def solved(solver, **options):
    """What is said after 2 iterations, u_8 and its slope by a factor of K."""

    def J(p):
        u, info = solver(p * K, f, **options)
        return u[-1], info

    (value, info), slope = jax.value_and_grad(J, has_aux=True)(1.0)
    return [f"info {info}", float(value), round(float(slope), 12)]


def slopes(f, *at):
    at = [jnp.asarray(x, float) for x in at]
    try:
        found = jax.grad(f, range(len(at)))(*at)
    except (TypeError, NotImplementedError) as error:
        return type(error).__name__
    return np.hstack(found).tolist()


def overwritten(put):
    """The slope of x * x at 1.1, of which the NumPy array becomes 5 in between."""
    memory = np.empty(16)
    start = -memory.ctypes.data % 64 // 8
    x = memory[start : start + 1]  # JAX shares memory that begins at a multiple of 64 bytes
    x[:] = 1.1
    J, pull = jax.vjp(lambda x: jnp.sum(x * x), put(x))
    J.block_until_ready()
    x[:] = 5.0
    return float(pull(1.0)[0][0])


found = {name: slopes(*case) for name, case in SLOPES.items()}
found |= {
    "u = u^2, three times, into new memory": slopes(squared, [1.1]),
    "u = u^2, three times, in place": slopes(assigned, [1.1]),
    "`jnp.asarray(x)`": overwritten(jnp.asarray),
    "`jax.device_put(x)`": overwritten(jax.device_put),
    "`jax.vjp(f, x)`": overwritten(lambda x: x),
    "`jax.scipy.sparse.linalg.cg`": solved(cg, maxiter=2),
    "`jax.scipy.sparse.linalg.gmres`": solved(gmres, restart=2, maxiter=1),
    "`jax.numpy.linalg.solve`, K singular": ["nothing", float(jnp.linalg.solve(np.zeros((1, 1)), np.ones(1))[0])],
}
print(json.dumps({f"JAX {jax.__version__}": found}))
