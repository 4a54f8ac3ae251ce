"""Sums of powers of the eigenvalues of a 3 x 3 tensor from its invariants: differentiable where eigenvalues are not.

Where eigenvalues x_i > 0 coincide, as at F = I, they have no derivatives; sum_i x_i^s has all of them. With
0 < sigma < 1 and y = (1 + xi)/(1 - xi), a = 1 - xi, b = 1 + xi,

    x^sigma = (sin pi sigma / pi) int_0^inf y^(sigma - 1) x/(x + y) dy
            = (2 sin pi sigma / pi) int_-1^1 (1 - xi)^-sigma (1 + xi)^(sigma - 1) x/(a x + b) dxi

is a Gauss-Jacobi sum of w x/(a x + b). Over three points 1/(a x + b) has the divided difference a^2/D, where
D = prod_i (a x_i + b) = b^3 + a (b^2 e1 + a b e2 + a^2 e3), and so x^(sigma + k), k = 1, 0, -1, have

    d_k = sum of w (b^2, -a b, a^2)/D,     d_k = e1 d_(k-1) - e2 d_(k-2) + e3 d_(k-3) for the others,

the latter because x^3 = e1 x^2 - e2 x + e3 at every x_i. As sum_i f(x_i) is the divided difference of f p', p the
polynomial with these roots, sum_i x_i^(sigma + n) = 3 d_(n+2) - 2 e1 d_(n+1) + e2 d_n. With m nodes the relative error
is about ((sqrt x - 1)/(sqrt x + 1))^(2 m); around x = 1 it vanishes to high order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np

from gradient_routes.problems.jax64 import jax, jnp
from gradient_routes.problems.problem import Array

NODES = 24  # 1e-12 for principal stretches from 1/3 to 3 in any combination, 1e-7 to 5, 1e-3 to 10


def isochoric_powers(i1: Any, i2: Any, exponents: tuple[float, ...]) -> Any:
    """sum_i lambar_i^alpha for every alpha, with lambar_i = J^(-1/3) lambda_i: (len(exponents),).

    From the isochoric invariants i1 = J^(-2/3) I1 - 3 and i2 = J^(-4/3) I2 - 3, scalars of jax.numpy.
    """

    def powers(i: Any) -> Any:
        return jnp.stack([power_trace(3.0 + i[0], 3.0 + i[1], 1.0, alpha / 2.0) for alpha in exponents])

    return differentiate_by_jacobian(powers)(jnp.stack([i1, i2]))


def differentiate_by_jacobian(f: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """f of few numbers x (k,) with the derivative rule df = (df/dx) dx, to any order.

    Nine directions dF then share one df/dx instead of differentiating f nine times: a sixth of the time for A.
    """
    f_at = jax.custom_jvp(f)

    @f_at.defjvp
    def jvp(primals: tuple[Any], tangents: tuple[Any]) -> tuple[Any, Any]:
        (x,), (dx,) = primals, tangents
        f_x = differentiate_by_jacobian(jax.jacfwd(f, holomorphic=bool(jnp.iscomplexobj(x))))
        return f_at(x), (f_x(x) * dx).sum(-1)

    return f_at


def power_trace(e1: Any, e2: Any, e3: Any, s: float) -> Any:
    """sum_i x_i^s of the eigenvalues x_i > 0 (or near it in the complex plane) for any real s, by jax.numpy.

    e1 = sum x_i, e2 = x_1 x_2 + x_2 x_3 + x_3 x_1, e3 = x_1 x_2 x_3 are scalars. Holomorphic, differentiable to any
    order, at the cost of one sum over the nodes an order.
    """
    if s < 0:
        return power_trace(e2 / e3, e1 / e3, 1.0 / e3, -s)
    n = math.floor(s)
    if n == s:
        return _recurrence([3.0, e1, e1 * e1 - 2.0 * e2], e1, e2, e3, n)[n]
    x = (e1 * e3 / e2) ** 0.5  # about sqrt(max x_i min x_i): scales the x_i to around 1
    return x**s * _fractional_power_trace(e1 / x, e2 / x**2, e3 / x**3, n, s - n)


def _fractional_power_trace(e1: Any, e2: Any, e3: Any, n: int, sigma: float) -> Any:
    """sum_i x_i^(n + sigma)."""
    S = _quadrature_sums(jnp.stack([e1, e2, e3]), sigma, 1)
    d = _recurrence([S[2], -S[1], S[0]], e1, e2, e3, n + 3)  # d_-1, d_0, d_1, ...
    return 3.0 * d[n + 3] - 2.0 * e1 * d[n + 2] + e2 * d[n + 1]


def _recurrence(P: list[Any], e1: Any, e2: Any, e3: Any, last: int) -> list[Any]:
    """P_0, ..., P_last, continued by x^3 = e1 x^2 - e2 x + e3."""
    while len(P) <= last:
        P = [*P, e1 * P[-1] - e2 * P[-2] + e3 * P[-3]]
    return P


@partial(jax.custom_jvp, nondiff_argnums=(1, 2))
def _quadrature_sums(e: Any, sigma: float, r: int) -> Any:
    """S^r_k = sum over nodes of w a^(r-1) b^(2r-k) a^k / D^r, k = 0 to 2 r: (2 r + 1,) of e (3,)."""
    w, a, b = _gauss_jacobi(sigma)
    D = b**3 + e[0] * (a * b**2) + e[1] * (a**2 * b) + e[2] * a**3
    return np.stack([w * a ** (r - 1 + k) * b ** (2 * r - k) for k in range(2 * r + 1)]) @ D**-r


@_quadrature_sums.defjvp
def _quadrature_sums_jvp(sigma: float, r: int, primals: tuple[Any], tangents: tuple[Any]) -> tuple[Any, Any]:
    """dS^r_k = -r (S^(r+1)_k de1 + S^(r+1)_(k+1) de2 + S^(r+1)_(k+2) de3): independent of the number of directions."""
    (e,), (de,) = primals, tangents
    S = _quadrature_sums(e, sigma, r + 1)
    return _quadrature_sums(e, sigma, r), -r * (S[:-2] * de[0] + S[1:-1] * de[1] + S[2:] * de[2])


@cache
def _gauss_jacobi(sigma: float) -> tuple[Array, Array, Array]:
    """w, a = 1 - xi and b = 1 + xi (NODES,) with x^sigma = sum of w x/(a x + b)."""
    from scipy.special import roots_jacobi

    with np.errstate(invalid="ignore"):  # SciPy computes, and discards, a 0/0 where the exponents sum to -1
        xi, w = roots_jacobi(NODES, -sigma, sigma - 1.0)
    return 2.0 * np.sin(np.pi * sigma) / np.pi * w, 1.0 - xi, 1.0 + xi
