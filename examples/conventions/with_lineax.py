"""What Lineax and Optimistix say where they stop before they have converged, and what derivatives they then give."""

import json
from importlib.metadata import version

import jax
import jax.numpy as jnp
import lineax as lx
import numpy as np
import optimistix as optx

jax.config.update("jax_enable_x64", True)
K, f = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1), np.ones(8)
K[-1, -1] = 1  # a bar of 8 springs, u_8 = 36


def linear(p, throw):
    A = lx.MatrixLinearOperator(p * K, lx.positive_semidefinite_tag)
    solution = lx.linear_solve(A, f, lx.CG(1e-12, 1e-12, max_steps=2), throw=throw)
    return solution.value[-1], solution.result == lx.RESULTS.max_steps_reached


def nonlinear(p, throw):
    def R(u, p):
        return p * K @ u + u**3 / 100 - f

    solution = optx.root_find(R, optx.Newton(1e-12, 1e-12), jnp.zeros(8), p, max_steps=2, throw=throw)
    return solution.value[-1], solution.result == optx.RESULTS.nonlinear_max_steps_reached


def solved(J, throw):
    """What is said after 2 steps, u_8 and its slope by a factor of K."""
    try:
        value, stopped = J(1.0, throw)
    except RuntimeError as error:
        return [f"raises {type(error).__name__}"]
    says = "`result` max_steps_reached" if stopped else "`result` successful"
    try:
        return [says, float(value), float(jax.grad(J, has_aux=True)(1.0, throw)[0])]
    except RuntimeError as error:
        return [says, float(value), f"raises {type(error).__name__}"]


found = {
    "`lineax.CG`": solved(linear, True),
    "`lineax.CG`, `throw=False`": solved(linear, False),
    "`optimistix.Newton`": solved(nonlinear, True),
    "`optimistix.Newton`, `throw=False`": solved(nonlinear, False),
}

print(json.dumps({f"Lineax {version('lineax')}": found}))
