"""Newton's method for frameworks that give R and products with R_u, symmetric, but no solver."""

from routes_adapter import NotConverged
from scipy.sparse.linalg import LinearOperator, cg

STEPS, STEP_RTOL = 20, 1e-8


def solve(product, b, rtol):
    """x with |b - R_u x| <= rtol |b|, of the shape of b, by conjugate gradients."""
    A = LinearOperator((b.size, b.size), lambda v: product(v.reshape(b.shape)).ravel(), dtype=float)
    x, failed = cg(A, b.ravel(), rtol=rtol, atol=0.0)
    if failed:
        raise NotConverged(f"conjugate gradients: not to {rtol:g} after {failed} iterations")
    return x.reshape(b.shape)


def newton(residual, product, u, rtol):
    """u with |R(u)| <= rtol |R(u_0)|, largest entries. `product` is with R_u at the last u that `residual` was told."""
    R = residual(u)
    wanted = rtol * abs(R).max()
    for _ in range(STEPS):
        if abs(R).max() <= wanted:
            return u
        u = u - solve(product, R, STEP_RTOL)
        R = residual(u)
    raise NotConverged(f"Newton's method: |R| = {abs(R).max():.1e} after {STEPS} steps, wanted {wanted:.1e}")
