"""An iterative adjoint solve whose tolerance is absolute: a chain of springs, k in N/m, its tip measured in m.

What the libraries do: `cg` of scipy.sparse.linalg (SciPy 1.17.1) and jax.scipy.sparse.linalg (JAX 0.10.2) ends where
|b - K x| <= max(rtol |b|, atol). The right side b of the adjoint equation is the misfit, here 2e-8 m. With atol = 1e-6
the start x = 0 is good enough: no iteration, no message, info = 0, lam = 0.
How it shows: dJ/dk is exactly 0 while J changes with k. Far from the data, where the misfit is larger, it is not.
The verdict: `Absolute` is a wrong-gradient.
To mend it: a tolerance relative to the right side, as in `Relative`, which agrees.
"""

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import cg, spsolve

n = 8
B = diags_array([np.ones(n), -np.ones(n - 1)], offsets=[0, -1], format="csc")  # extensions of the springs: B u
f = np.full(n, 0.1)  # [N]
d = 4.1e-7  # [m]


class Absolute:
    start = np.linspace(0.8e7, 1.2e7, n)
    bounds = (1.0, np.inf)
    atol = 1e-6

    def stiffness(self, k):
        return B.T @ diags_array(k) @ B

    def objective(self, k):
        return 0.5 * (spsolve(self.stiffness(k), f)[-1] - d) ** 2

    def gradient(self, k):
        K = self.stiffness(k)
        u = spsolve(K, f)
        J_u = np.zeros(n)
        J_u[-1] = u[-1] - d
        lam, _ = cg(K, -J_u, rtol=1e-12, atol=self.atol)
        return (B @ lam) * (B @ u)


class Relative(Absolute):
    atol = 0.0
