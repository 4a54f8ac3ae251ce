"""Linear iterations on K(p) u = f, every step traceable: what unrolled AD puts on its tape.

They start at u = 0, so r = f. Each step costs one product with K; each carries its residual r along.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jax.extend.core import jaxprs_in_params

from problems.jax64 import jax, jnp
from problems.problem import Traced

PRODUCTS = ("gradient_routes_matvec", "gradient_routes_matvec_transposed")
CONVERGED = 1e-30  # |r| / |f| at which CG stands still: what follows would be 0 / 0


@dataclass(frozen=True)
class Iteration:
    """start(p) -> carry and step(p, carry) -> carry; a carry is a tuple that begins with (u, r)."""

    start: Callable[[Any], tuple[Any, ...]]
    step: Callable[[Any, tuple[Any, ...]], tuple[Any, ...]]

    def iterate(self, p: Any, k: int) -> Any:
        """u_k (n_u,) by jax.lax.scan, differentiable in p."""
        carry, _ = jax.lax.scan(lambda carry, _: (self.step(p, carry), None), self.start(p), None, length=k)
        return carry[0]

    def iterations_to(self, p: Any, rtol: float, at_most: int) -> int:
        """The smallest k with |r_k|_inf <= rtol |f|_inf, or at_most."""

        def unfinished(loop: Any) -> Any:
            (_, r, *_), k, target = loop
            return (jnp.abs(r).max() > target) & (k < at_most)

        @jax.jit
        def count(p: Any) -> Any:
            carry = self.start(p)
            target = rtol * jnp.abs(carry[1]).max()
            loop = (carry, 0, target)
            return jax.lax.while_loop(unfinished, lambda s: (self.step(p, s[0]), s[1] + 1, s[2]), loop)[1]

        return int(count(p))


def iteration(inner: str, traced: Traced, n_u: int) -> Iteration:
    """The iteration `inner` (cg, richardson or jacobi) for a problem whose R is affine in u."""
    zero = jnp.zeros(n_u)
    matvec = product_with_R_u(traced, zero)

    def first_residual(p: Any) -> Any:
        return -traced.residual(zero, p)

    if inner == "cg":
        return conjugate_gradients(matvec, first_residual, zero)
    if inner == "jacobi":
        return stationary(matvec, first_residual, zero, weight=lambda p: 1.0 / _known(traced.diagonal)(p))
    return stationary(matvec, first_residual, zero, weight=lambda p: 1.0 / _known(traced.spectral_bound)(p))


def _known(function: Callable[[Any], Any] | None) -> Callable[[Any], Any]:
    assert function is not None, "the route objects to problems that lack it"
    return function


def conjugate_gradients(matvec: Callable[[Any, Any], Any], f: Callable[[Any], Any], zero: Any) -> Iteration:
    """Hestenes & Stiefel 1952. Past convergence it stands still: no 0/0 in the iterate nor in its derivative.

    alpha = r.d / d.Kd equals r.r / d.Kd only while rounding leaves r.d = r.r, but minimizes along d always; on
    ill-conditioned K its reverse sweep loses up to five digits less. Both amplify rounding there, without bound: the
    iterate then converges and its gradient by AD does not (bench warns of it). Measure.
    """

    def start(p: Any) -> tuple[Any, ...]:
        r = f(p)
        return zero, r, r, r @ r, r @ r, r @ r

    def step(p: Any, carry: tuple[Any, ...]) -> tuple[Any, ...]:
        u, r, d, rr, rd, ff = carry
        Kd = matvec(p, d)
        # the unused branch of a `where` still enters the derivative: keep its numbers finite, too
        moving = rr > CONVERGED**2 * ff
        alpha = jnp.where(moving, rd / jnp.where(moving, d @ Kd, 1.0), 0.0)
        u, r = u + alpha * d, r - alpha * Kd
        rr_next = r @ r
        beta = jnp.where(moving, rr_next / jnp.where(moving, rr, 1.0), 0.0)
        # r.d from the old d: the tape then keeps three vectors a step, not four
        return u, r, r + beta * d, rr_next, rr_next + beta * (r @ d), ff

    return Iteration(start, step)


def stationary(
    matvec: Callable[[Any, Any], Any], f: Callable[[Any], Any], zero: Any, weight: Callable[[Any], Any]
) -> Iteration:
    """u <- u + w r: Richardson's iteration where w is a number, Jacobi's where it is 1 / diag K."""

    def start(p: Any) -> tuple[Any, ...]:
        return zero, f(p), weight(p)

    def step(p: Any, carry: tuple[Any, ...]) -> tuple[Any, ...]:
        u, r, w = carry
        du = w * r
        return u + du, r - matvec(p, du), w

    return Iteration(start, step)


def product_with_R_u(traced: Traced, zero: Any) -> Callable[[Any, Any], Any]:
    """(p, v) -> R_u v for R affine in u. Its pullback is one transposed product; both can be counted by name."""

    def matvec(p: Any, v: Any) -> Any:
        return jax.jvp(lambda u: traced.residual(u, p), (zero,), (v,))[1]

    def matvec_transposed(p: Any, v: Any, w: Any) -> Any:
        return jax.vjp(matvec, p, v)[1](w)

    matvec.__name__, matvec_transposed.__name__ = PRODUCTS  # a problem's own functions are not counted
    named, named_transposed = jax.jit(matvec), jax.jit(matvec_transposed)
    product = jax.custom_vjp(named)
    product.defvjp(lambda p, v: (named(p, v), (p, v)), lambda kept, w: named_transposed(*kept, w))
    return product


def count_products(jaxpr: Any, times: int = 0) -> int:
    """Products with R_u or its transpose that a traced program executes, read off the program itself.

    `times` is how often this jaxpr runs inside scans. Outside them (0) no product stands: what JAX has moved out
    of a loop under the product's name is only what the loop's products share.
    """
    count = 0
    for eqn in jaxpr.eqns:
        if eqn.params.get("name") in PRODUCTS:
            count += times
            continue
        inside = max(times, 1) * eqn.params["length"] if eqn.primitive.name == "scan" else times
        count += sum(count_products(inner, inside) for inner in jaxprs_in_params(eqn.params))
    return count
