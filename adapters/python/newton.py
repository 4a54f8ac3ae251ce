"""Newton's method for frameworks that give R and R_u, a sparse matrix, but no solver; R and u have one shape."""

import numpy as np
from routes_adapter import NotConverged
from scipy.sparse.linalg import splu

STEPS = 20


def solve(R_u, b, free):
    """R_u^-1 b among the components `free`, a mask of the shape of b; 0 elsewhere."""
    x, inside = np.zeros_like(b), free.ravel()
    x[free] = splu(R_u.tocsc()[:, inside][inside]).solve(b[free])
    return x


def newton(residual, tangent, free, rtol):
    """u with |R(u)| <= rtol |R(0)|, largest of the components `free`, and 0 elsewhere."""
    u = np.zeros(free.shape)
    R = residual(u)
    wanted = rtol * abs(R[free]).max()
    for _ in range(STEPS):
        if abs(R[free]).max() <= wanted:
            return u
        u = u - solve(tangent(), R, free)
        R = residual(u)
    raise NotConverged(f"Newton's method: |R| = {abs(R[free]).max():.1e} after {STEPS} steps, wanted {wanted:.1e}")
