"""Newton's method for frameworks that give R and R_u, a sparse matrix, but no solver; R and u have one shape."""

import numpy as np
from routes_adapter import NotConverged, Singular
from scipy.sparse.linalg import splu

STEPS = 20


def solve(R_u, b, free):
    """R_u^-1 b among the components `free`, a mask of the shape of b; 0 elsewhere."""
    x, inside = np.zeros_like(b), free.ravel()
    try:
        x[free] = splu(R_u.tocsc()[:, inside][inside]).solve(b[free])
    except RuntimeError as error:
        raise Singular(error) from None
    return x


def newton(residual, tangent, free, rtol):
    """u with |R(u)| <= rtol |R(0)|, largest of the components `free`, and 0 elsewhere."""
    u = np.zeros(free.shape)
    R = residual(u)
    wanted = rtol * abs(R[free]).max()
    for step in range(STEPS):
        size = abs(R[free]).max()
        if size <= wanted:
            return u
        if not np.isfinite(size):
            raise NotConverged(f"Newton's method: |R| = {size} after {step} steps, which are not damped")
        u = u - solve(tangent(), R, free)
        R = residual(u)
    raise NotConverged(f"Newton's method: |R| = {abs(R[free]).max():.1e} after {STEPS} steps, wanted {wanted:.1e}")
