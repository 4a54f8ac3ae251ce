"""What SciPy says where a solve has not ended."""

import json
import warnings

import numpy as np
import scipy
from scipy.optimize import NoConvergence, newton_krylov, root
from scipy.sparse import csr_array
from scipy.sparse.linalg import cg, spsolve

K, f = 2 * np.eye(8) - np.eye(8, k=1) - np.eye(8, k=-1), np.ones(8)
K[-1, -1] = 1  # a bar of 8 springs, u_8 = 36


def R(u):
    return K @ u + u**3 / 100 - f


def linear():
    u, info = cg(K, f, rtol=1e-12, maxiter=2)
    return [f"info {info}", u[-1]]


def singular():
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        u = spsolve(csr_array((1, 1)), np.ones(1))
    return [f"warns {caught[-1].category.__name__}", u[0]]


def powell():
    solution = root(R, np.zeros(8), options={"maxfev": 20})
    return [f"success {solution.success}", solution.x[-1]]


def krylov():
    try:
        return ["nothing", newton_krylov(R, np.zeros(8), maxiter=2, f_tol=1e-12)[-1]]
    except NoConvergence as error:
        return [f"raises {type(error).__name__}"]


found = {
    "`scipy.sparse.linalg.cg`": linear(),
    "`scipy.sparse.linalg.spsolve`, K singular": singular(),
    "`scipy.optimize.root`": powell(),
    "`scipy.optimize.newton_krylov`": krylov(),
}
print(json.dumps({f"SciPy {scipy.__version__}": found}))
