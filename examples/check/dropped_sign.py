"""A hand-written adjoint of -(a u')' = 1 on a line, one a for each of 20 cells, u measured in the middle.

The sign of lam was dropped: K lam = -J_u, dJ/da_e = lam^T (dK/da_e) u.
"""

import numpy as np

n = 20
h = 1.0 / n
f = h * np.ones(n - 1)


def stiffness(a):
    """K (n - 1, n - 1) of linear elements, fixed at both ends."""
    return (np.diag(a[:-1] + a[1:]) - np.diag(a[1:-1], 1) - np.diag(a[1:-1], -1)) / h


class Poisson:
    start = np.linspace(1.0, 2.0, n)
    names = tuple(f"a_{e + 1}" for e in range(n))
    bounds = (1e-6, np.inf)

    def objective(self, a):
        u = np.linalg.solve(stiffness(a), f)
        return 0.5 * (u[n // 2] - 0.05) ** 2

    def gradient(self, a):
        K = stiffness(a)
        u = np.linalg.solve(K, f)
        J_u = np.zeros(n - 1)
        J_u[n // 2] = u[n // 2] - 0.05
        lam = np.linalg.solve(K.T, -J_u)
        du, dlam = np.diff(u, prepend=0.0, append=0.0), np.diff(lam, prepend=0.0, append=0.0)
        return -dlam * du / h
